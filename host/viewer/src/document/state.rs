//! The state of the document: clouds, scene, history, and files being read or written.

use super::cloud_writer::CloudWriter;
use super::display::job::DisplayJob;
use super::history::{History, Snapshot};
use super::open::file_loader::FileLoader;
use super::open::preview::Preview;
use super::recovery::Recovery;
use super::state_folder::StateFolder;
use super::unsaved_prompt::UnsavedPrompt;
use super::visible_clouds::VisibleClouds;
use std::path::PathBuf;
use std::time::Instant;
use surfelshop_cloud::scene::{Keyed, SceneFile, SceneView};
use surfelshop_session::options::UpAxis;
use surfelshop_session::options::colors::ColorArguments;

/// Everything that is open, apart from the settings.
pub(crate) struct Document {
    pub(crate) history: History,
    pub(crate) clouds: Option<VisibleClouds>,
    /// Large clouds that are being coloured and filtered.
    pub(crate) display_job: Option<DisplayJob>,
    /// Files being read.
    pub(crate) loader: Option<FileLoader>,
    /// Whether the clouds that are shown are some points of these files.
    pub(crate) preview: Option<Preview>,
    /// A cloud being written.
    pub(crate) cloud_writer: Option<CloudWriter>,
    /// How often files were opened.
    pub(crate) n_opened: u64,
    /// The opened files that are clouds.
    pub(crate) files: Vec<PathBuf>,
    /// The scene that was opened or saved last, with all its keys.
    pub(crate) scene_file: Option<SceneFile>,
    pub(crate) scene_path: Option<PathBuf>,
    /// What was in the scene's file when it was written last; `None` since it was opened.
    pub(crate) written: Option<Snapshot>,
    /// Samples of pictures at rest where no scene says another number.
    pub(crate) usual_antialias: u32,
    /// The scene's views beyond the most panes of the window.
    pub(crate) hidden_views: Vec<Keyed<SceneView>>,
    /// The user's folder for recent files, the last session and presets.
    pub(crate) state_folder: Option<StateFolder>,
    pub(crate) recent: Vec<PathBuf>,
    /// The session as it was saved last, and when.
    pub(crate) last_session: Option<(SceneFile, Instant)>,
    /// Unsaved edits on disk, and those of earlier sessions.
    pub(crate) recovery: Option<Recovery>,
    /// The question before unsaved edits are lost.
    pub(crate) unsaved_prompt: Option<UnsavedPrompt>,
    /// Whether the window may close: the user said so, or nothing is unsaved.
    pub(crate) close_confirmed: bool,
    /// Whether the files being read may replace unsaved edits: the user said so.
    pub(crate) replace_confirmed: bool,
    /// The axis that points upwards in the clouds.
    pub(crate) up: UpAxis,
    /// The same as it was typed, if it was.
    pub(crate) typed_up: UpAxis,
    /// What was typed about colours and filters, for the first files.
    pub(crate) typed_colors: Option<ColorArguments>,
}

impl Document {
    /// An empty document; begins a session in the state folder.
    pub(crate) fn new(up: UpAxis, colors: &ColorArguments) -> Self {
        let state_folder = StateFolder::of_user();
        if let Some(state_folder) = &state_folder {
            state_folder.begin_session();
        }
        Self {
            history: History::default(),
            clouds: None,
            display_job: None,
            loader: None,
            preview: None,
            cloud_writer: None,
            n_opened: 0,
            files: Vec::new(),
            scene_file: None,
            scene_path: None,
            written: None,
            usual_antialias: 1,
            hidden_views: Vec::new(),
            recent: state_folder.as_ref().map(StateFolder::recent).unwrap_or_default(),
            state_folder,
            last_session: None,
            recovery: Recovery::of_user(),
            unsaved_prompt: None,
            close_confirmed: false,
            replace_confirmed: false,
            up: up.or_of([]),
            typed_up: up,
            typed_colors: Some(colors.clone()).filter(|colors| !colors.is_empty()),
        }
    }

    /// The open clouds, unless what is shown is a preview of files that are still being read.
    pub(crate) fn complete_clouds(&self) -> Option<&VisibleClouds> {
        self.clouds.as_ref().filter(|_| self.preview.is_none())
    }
}
