//! Scenes among the files of a command line, and the clouds they bring.

use crate::output::{files, terminal};
use anyhow::bail;
use std::path::{Path, PathBuf};
use surfelshop_cloud::Transform;
use surfelshop_cloud::scene::{self, CloudRenderer, OpenedScene};
use surfelshop_cloud::selection::SurfelRuns;

/// A cloud to read.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Where it stands, where a scene says so.
    pub transform: Option<Transform>,
    /// File and line of the scene that names it, where one does.
    pub place: Option<String>,
    /// What draws it, where a scene says so.
    pub renderer: Option<NamedRenderer>,
    /// Which of its surfels a scene hides.
    pub hidden: Option<SurfelRuns>,
    /// The file of its edits, where a scene names one.
    pub layer: Option<PathBuf>,
}

impl Source {
    /// A cloud that was typed.
    pub fn file(path: &Path) -> Self {
        let (transform, place, renderer, hidden, layer) = (None, None, None, None, None);
        Self { path: path.to_owned(), transform, place, renderer, hidden, layer }
    }
}

/// A renderer that a cloud names, and who says so.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRenderer {
    /// The renderer and its parameters.
    pub renderer: CloudRenderer,
    /// File and line of the cloud, or what the cloud is called.
    pub place: String,
    /// The folder that paths among the parameters are relative to.
    pub folder: PathBuf,
}

/// What the files of a command line are.
pub struct Inputs {
    /// The scene, where there is one.
    pub opened: Option<OpenedScene>,
    /// The clouds to read: those typed and the visible ones of the scene.
    pub sources: Vec<Source>,
}

impl Inputs {
    /// Opens the scene among these files, tells of its unknown keys, and looks for its clouds
    /// without reading them.
    pub fn open(named: &[PathBuf]) -> anyhow::Result<Self> {
        let mut inputs = Self { opened: None, sources: Vec::new() };
        for file in named {
            if !scene::is_scene(file) {
                inputs.sources.push(Source::file(file));
                continue;
            }
            if let Some(first) = &inputs.opened {
                let (first, second) = (first.path.display(), file.display());
                bail!("expected at most one scene, found {first} and {second}; leave out one");
            }
            let opened = open(file)?;
            inputs.sources.extend(visible(&opened)?);
            inputs.opened = Some(opened);
        }
        let files = |source: &Source| [Some(source.path.clone()), source.layer.clone()];
        let clouds: Vec<PathBuf> = inputs.sources.iter().flat_map(files).flatten().collect();
        let clouds = clouds.iter().map(PathBuf::as_path);
        files::protect(named.iter().map(PathBuf::as_path).chain(clouds));
        Ok(inputs)
    }
}

/// Reads a scene and tells of its unknown keys.
pub fn open(file: &Path) -> anyhow::Result<OpenedScene> {
    let opened = scene::read(file)?;
    opened.warnings.iter().for_each(terminal::warn);
    Ok(opened)
}

/// The clouds of a scene that are shown, all of which are there.
fn visible(opened: &OpenedScene) -> anyhow::Result<Vec<Source>> {
    let mut sources = Vec::new();
    for (cloud, line) in opened.scene.clouds.iter().zip(&opened.cloud_lines) {
        if !cloud.visible {
            continue;
        }
        let path = opened.scene.path_of(cloud);
        let place = format!("{}:{line}", opened.path.display());
        if !path.exists() {
            bail!(
                "{place}: expected the cloud {}, found no such file; correct `path`, or hide the \
                 cloud with `visible = false`",
                path.display()
            );
        }
        let transform = cloud.transform.as_ref().map(|transform| transform.known);
        let named = |renderer: &CloudRenderer| NamedRenderer {
            renderer: renderer.clone(),
            place: format!("{place} ({})", cloud.path.display()),
            folder: opened.scene.folder.clone(),
        };
        let renderer = cloud.renderer.as_ref().map(named);
        let (hidden, layer) = (cloud.hidden.clone(), opened.scene.path_of_layer(cloud));
        sources.push(Source { path, transform, place: Some(place), renderer, hidden, layer });
    }
    Ok(sources)
}
