//! The examples of the start page.

use super::splat_scene;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::Context;
use std::path::PathBuf;
use surfelshop_runtime::plugins::cache_folder;
use surfelshop_session::input::sample::find_sample;

/// Something to look at that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Example {
    Sample,
    CornellBox,
    Splats,
}

impl Example {
    pub(super) const ALL: [Self; 3] = [Self::Sample, Self::CornellBox, Self::Splats];

    pub(super) fn words(self) -> (Icon, &'static str, &'static str) {
        match self {
            Self::Sample => {
                (Icon::Shapes, "Sample", "mushrooms and a snail, 119,051 surfels with colours")
            }
            Self::CornellBox => {
                (Icon::Box, "Cornell box", "a room with a lamp, for indirect light")
            }
            Self::Splats => (
                Icon::Sparkles,
                "Gaussian splats",
                "a knot of translucent Gaussians, made on the spot",
            ),
        }
    }

    /// The file of the example, which is written where it is made; a line where there is none.
    fn file(self) -> anyhow::Result<PathBuf> {
        match self {
            Self::Sample => find_sample(),
            Self::CornellBox => {
                let file = find_sample()?.with_file_name("cornell-box.scene.toml");
                anyhow::ensure!(
                    file.is_file(),
                    "{}: expected a scene, found no file",
                    file.display()
                );
                Ok(file)
            }
            Self::Splats => {
                let folder =
                    cache_folder().unwrap_or_else(|| std::env::temp_dir().join("surfelshop"));
                let folder = folder.join("examples");
                std::fs::create_dir_all(&folder)?;
                splat_scene::make(&folder)
            }
        }
    }

    pub(super) fn open(self, window: &mut Window, ctx: &Context) {
        match self.file() {
            Ok(file) => window.open(ctx, vec![file]),
            Err(error) => window.messages.warn(format!("{error:#}")),
        }
    }
}
