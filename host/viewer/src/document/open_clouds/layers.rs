//! Edits of pyramids, and the files that they are in.

use super::{OpenCloud, OpenClouds};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_cloud::selection::EditLayer;

/// What is in the file of a pyramid's edits. All states of the pyramid share it: what undo brings back is not in there
/// for that reason.
#[derive(Default)]
pub(super) struct LayerFile {
    path: Option<PathBuf>,
    /// The edits in there; none where these are not known to be any that are open.
    edits: Option<EditLayer>,
}

/// A file that several states of a pyramid share.
pub(super) type SharedLayerFile = Arc<Mutex<LayerFile>>;

impl OpenCloud {
    /// The file of its edits, where it is a pyramid whose edits were read or saved.
    pub(crate) fn layer_file(&self) -> Option<PathBuf> {
        self.layer_file.lock().unwrap_or_else(PoisonError::into_inner).path.clone()
    }

    /// The same as a scene names it: not where all edits in there were undone.
    pub(crate) fn layer_in_scene(&self) -> Option<PathBuf> {
        let file = self.layer_file.lock().unwrap_or_else(PoisonError::into_inner);
        let is_empty = file.edits.as_ref().is_some_and(EditLayer::is_empty);
        file.path.clone().filter(|_| !is_empty)
    }

    /// Whether it is a pyramid with edits that its file has not.
    pub(super) fn has_other_edits(&self) -> bool {
        let Some(pyramid) = &self.pyramid else { return false };
        let file = self.layer_file.lock().unwrap_or_else(PoisonError::into_inner);
        match (&file.path, &file.edits) {
            (None, _) => !pyramid.layer().is_empty(),
            (_, saved) => saved.as_ref() != Some(pyramid.layer()),
        }
    }

    /// Notes that its edits, as they are, come from a file.
    pub(super) fn with_layer_from(&self, path: Option<&Path>, is_it: bool) -> Self {
        let edits = self.pyramid.as_ref().map(|pyramid| pyramid.layer().clone());
        let edits = edits.filter(|_| is_it && path.is_some());
        let file = LayerFile { path: path.map(Path::to_owned), edits };
        Self { layer_file: Arc::new(Mutex::new(file)), ..self.clone() }
    }
}

impl OpenClouds {
    /// With other edits of a pyramid.
    ///
    /// # Errors
    /// As [`edited`](surfelshop_session::input::pyramids::OpenPyramid::edited).
    pub(crate) fn layered(&self, index: usize, layer: EditLayer) -> anyhow::Result<Self> {
        let before = self.all.get(index).and_then(OpenCloud::pyramid);
        let Some(before) = before else { return Ok(self.clone()) };
        let (cloud, pyramid) = before.edited(layer)?;
        Ok(self.changed(index, |open_cloud| {
            (open_cloud.loaded.cloud, open_cloud.pyramid) = (cloud, Some(Arc::new(pyramid)));
        }))
    }

    /// With the edits of a pyramid marked as saved to a file, which is not there where it has none.
    pub(crate) fn layer_saved(&self, index: usize, path: &Path) -> Self {
        self.noted(index, |open_cloud| {
            let edits = open_cloud.pyramid.as_ref().map(|pyramid| pyramid.layer().clone());
            let mut file = open_cloud.layer_file.lock().unwrap_or_else(PoisonError::into_inner);
            *file = LayerFile { edits, path: Some(path.to_owned()) };
            drop(file);
            open_cloud.recovered = false;
        })
    }
}
