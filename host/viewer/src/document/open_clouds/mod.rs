//! The open clouds, visible and hidden, edited and as on disk.

mod layers;

use super::packed_clouds::columns_of;
use super::recovery::CloudRow;
use layers::SharedLayerFile;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_cloud::display::{self, unhidden};
use surfelshop_cloud::scene::SceneFile;
use surfelshop_cloud::selection::SurfelRuns;
use surfelshop_cloud::selection::{Selection, SelectionError};
use surfelshop_cloud::{Cloud, CloudError, Column, Loaded, Summary, Transform};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::pyramids::OpenPyramid;
use surfelshop_session::input::scenes::NamedRenderer;

/// A cloud that is open.
#[derive(Clone)]
pub(crate) struct OpenCloud {
    pub(crate) loaded: Loaded,
    pub(crate) visible: bool,
    /// Its index among the clouds of the scene; none for one that a tool made.
    pub(crate) entry: Option<usize>,
    /// The file it was saved to after it was opened.
    pub(crate) saved_as: Option<PathBuf>,
    /// Generations of the columns of its file.
    on_disk: Vec<u64>,
    /// Whether its edits come from an earlier session.
    pub(crate) recovered: bool,
    /// What draws it; none where that is the view's renderer.
    pub(crate) renderer: Option<NamedRenderer>,
    /// What it is called, where that is not its file's name.
    title: Option<String>,
    /// How it was placed in the window, and the cloud before that.
    placed: Option<(Transform, Cloud)>,
    /// The pyramid that the cloud stands for, where it does.
    pyramid: Option<Arc<OpenPyramid>>,
    /// The file that the pyramid's edits are in.
    layer_file: SharedLayerFile,
}

impl OpenCloud {
    fn read(loaded: Loaded, entry: usize) -> Self {
        let on_disk = generations_on_disk(&loaded.cloud);
        Self { entry: Some(entry), on_disk, ..Self::new(loaded) }
    }

    /// The same of a pyramid, where the cloud stands for one of these.
    fn of_pyramid(self, clouds: &Clouds) -> Self {
        let pyramid = clouds.pyramid_of(&self.loaded.cloud).cloned();
        Self { pyramid, ..self }
    }

    /// A cloud that is in no file.
    fn new(loaded: Loaded) -> Self {
        let (visible, recovered, on_disk) = (true, false, Vec::new());
        let (entry, saved_as, renderer, title, placed) = (None, None, None, None, None);
        let (pyramid, layer_file) = (None, SharedLayerFile::default());
        Self {
            loaded,
            visible,
            entry,
            saved_as,
            on_disk,
            recovered,
            renderer,
            title,
            placed,
            pyramid,
            layer_file,
        }
    }

    /// The pyramid that it stands for, where it does.
    pub(crate) fn pyramid(&self) -> Option<&Arc<OpenPyramid>> {
        self.pyramid.as_ref()
    }

    /// What it was called; else its file's name, or the name of its source cloud and the tool.
    pub(crate) fn name(&self) -> String {
        self.title.clone().unwrap_or_else(|| self.file_name())
    }

    /// What it was called in the window or in its scene.
    pub(crate) fn title(&self) -> Option<&String> {
        self.title.as_ref()
    }

    /// How it was placed in the window, after how its scene places it.
    pub(crate) fn placement(&self) -> Transform {
        self.placed.as_ref().map_or_else(Transform::default, |(transform, _)| *transform)
    }

    /// The same with another cloud.
    pub(super) fn holding(&self, cloud: Cloud) -> Self {
        let summary = self.loaded.summary.clone();
        Self { loaded: Loaded { cloud, summary }, ..self.clone() }
    }

    /// Whether it was placed in the window.
    pub(super) fn is_placed(&self) -> bool {
        self.placed.is_some()
    }

    /// Which of its surfels are hidden, as a scene notes it.
    pub(crate) fn hidden(&self) -> Option<SurfelRuns> {
        let hidden = display::hidden(&self.loaded.cloud).ok()??;
        Some(SurfelRuns::of(&hidden))
    }

    fn file_name(&self) -> String {
        let path = self.saved_as.as_deref().unwrap_or(Path::new(&self.loaded.summary.file));
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| self.loaded.summary.file.clone())
    }

    /// Whether it has edits that its file has not.
    pub(crate) fn is_unsaved(&self) -> bool {
        if self.pyramid.is_some() {
            return self.has_other_edits();
        }
        // A scene says how it is placed.
        let has_file = self.entry.is_some() || self.saved_as.is_some();
        let cloud = match &self.placed {
            Some((_, before)) if has_file => before,
            _ => &self.loaded.cloud,
        };
        self.on_disk != generations_on_disk(cloud)
    }
}

/// The generations of all columns: equal generations mean equal values.
pub(crate) fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

/// The same without the column that files do not have.
fn generations_on_disk(cloud: &Cloud) -> Vec<u64> {
    generations(&unhidden(cloud))
}

/// All open clouds; a clone shares them.
#[derive(Clone)]
pub(crate) struct OpenClouds {
    all: Arc<Vec<OpenCloud>>,
    /// The clouds of the scene that were removed, by their indices there.
    removed: Arc<Vec<usize>>,
    /// The visible ones.
    pub(crate) clouds: Arc<Clouds>,
}

/// Equal where the same clouds are visible and the same are hidden, drawn by the same renderers, saved or not.
impl PartialEq for OpenClouds {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&OpenCloud, &OpenCloud)| {
            a.visible == b.visible
                && a.renderer == b.renderer
                && a.title == b.title
                && a.placement() == b.placement()
                && generations(&a.loaded.cloud) == generations(&b.loaded.cloud)
        };
        Arc::ptr_eq(&self.all, &other.all)
            || self.all.len() == other.all.len() && self.all.iter().zip(&*other.all).all(same)
    }
}

impl OpenClouds {
    /// Clouds that were read, with their indices in the scene.
    pub(crate) fn read(clouds: Clouds, entries: &[usize]) -> Self {
        let all = clouds.loaded.iter().zip(entries);
        let all =
            all.map(|(loaded, entry)| OpenCloud::read(loaded.clone(), *entry).of_pyramid(&clouds));
        let all = all.collect();
        Self { all: Arc::new(all), removed: Arc::default(), clouds: Arc::new(clouds) }
    }

    /// Recovered clouds, with the rows of the manifest.
    pub(crate) fn recovered(
        clouds: Clouds,
        entries: &[usize],
        rows: &[CloudRow],
        n_opened: usize,
    ) -> Self {
        let open_cloud = |(loaded, at): (&Loaded, &usize)| {
            let mut open_cloud = OpenCloud::read(loaded.clone(), *at).of_pyramid(&clouds);
            if let Some(row) = rows.iter().find(|row| row.at == *at) {
                (open_cloud.visible, open_cloud.saved_as) = (row.visible, row.saved_as.clone());
                open_cloud.entry = row.was_opened.then_some(*at);
                open_cloud.title.clone_from(&row.title);
                if row.file.is_some() {
                    open_cloud.loaded.summary.file.clone_from(&row.name);
                    (open_cloud.on_disk, open_cloud.recovered) = (Vec::new(), true);
                }
            }
            open_cloud
        };
        let all = clouds.loaded.iter().zip(entries).map(open_cloud).collect();
        // What was opened and is no more open was removed.
        let is_open = |at: &usize| rows.iter().any(|row| row.was_opened && row.at == *at);
        let removed = (0..n_opened).filter(|at| !is_open(at)).collect();
        Self::of(all, Arc::new(removed), &clouds)
    }

    /// Whether it is the same set of clouds, with the same ones saved.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.all, &other.all)
    }

    /// These clouds; `before` is what was open before, whose standpoint stays.
    fn of(all: Vec<OpenCloud>, removed: Arc<Vec<usize>>, before: &Clouds) -> Self {
        let shown = all
            .iter()
            .filter(|open_cloud| open_cloud.visible)
            .map(|open_cloud| open_cloud.loaded.clone());
        let pyramids = all.iter().filter_map(|open_cloud| open_cloud.pyramid.clone()).collect();
        let standpoint = before.standpoint;
        let clouds = Clouds { pyramids, standpoint, ..Clouds::of(shown.collect()) };
        Self { clouds: Arc::new(clouds), removed, all: Arc::new(all) }
    }

    /// All clouds, hidden ones too.
    pub(crate) fn all(&self) -> &[OpenCloud] {
        &self.all
    }

    fn changed(&self, index: usize, change: impl FnOnce(&mut OpenCloud)) -> Self {
        let mut all = self.all.to_vec();
        if let Some(open_cloud) = all.get_mut(index) {
            change(open_cloud);
        }
        Self::of(all, self.removed.clone(), &self.clouds)
    }

    /// The same clouds, one of them with what does not change how it is drawn.
    fn noted(&self, index: usize, change: impl FnOnce(&mut OpenCloud)) -> Self {
        let mut all = self.all.to_vec();
        if let Some(open_cloud) = all.get_mut(index) {
            change(open_cloud);
        }
        Self { all: Arc::new(all), ..self.clone() }
    }

    /// With one cloud called as the user likes; by its file where the title is empty.
    pub(crate) fn titled(&self, index: usize, title: &str) -> Self {
        self.noted(index, |open_cloud| {
            let title = title.trim();
            open_cloud.title = Some(title.to_owned())
                .filter(|title| !title.is_empty() && *title != open_cloud.file_name());
        })
    }

    /// With one cloud placed anew, from where its scene puts it.
    pub(crate) fn placed(&self, index: usize, transform: &Transform) -> Result<Self, CloudError> {
        let Some(open_cloud) = self.all.get(index) else { return Ok(self.clone()) };
        let before = match &open_cloud.placed {
            Some((_, before)) => before.clone(),
            None => open_cloud.loaded.cloud.clone(),
        };
        let cloud = before.transformed(transform)?;
        Ok(self.changed(index, |open_cloud| {
            open_cloud.loaded.cloud = cloud;
            open_cloud.placed = Some((*transform, before));
        }))
    }

    /// Without one cloud; the file stays. The last one cannot be removed.
    pub(crate) fn without(&self, index: usize) -> Self {
        let mut all = self.all.to_vec();
        if index >= all.len() || all.len() == 1 {
            return self.clone();
        }
        let gone = all.remove(index);
        let removed = self.removed.iter().copied().chain(gone.entry).collect();
        Self::of(all, Arc::new(removed), &self.clouds)
    }

    /// The clouds of the scene that were removed, by their indices there.
    pub(crate) fn removed(&self) -> &[usize] {
        &self.removed
    }

    /// With another cloud at an index.
    pub(crate) fn edited(&self, index: usize, cloud: Cloud) -> Self {
        self.changed(index, |open_cloud| {
            (open_cloud.loaded.cloud, open_cloud.placed) = (cloud, None);
        })
    }

    /// With these surfels of a cloud hidden, and no others; the cloud stays as it is.
    pub(crate) fn hiding(&self, index: usize, hidden: &Selection) -> Result<Self, SelectionError> {
        let Some(open_cloud) = self.all.get(index) else { return Ok(self.clone()) };
        let cloud = display::hiding(&open_cloud.loaded.cloud, hidden)?;
        let placed = match &open_cloud.placed {
            Some((transform, before)) => Some((*transform, display::hiding(before, hidden)?)),
            None => None,
        };
        Ok(self.changed(index, |open_cloud| {
            (open_cloud.loaded.cloud, open_cloud.placed) = (cloud, placed);
        }))
    }

    /// With the surfels hidden that a scene hides; and a line for each cloud of which that is not known any more.
    pub(crate) fn hiding_as_in(&self, scene: &SceneFile) -> (Self, Vec<String>) {
        let (mut hiding, mut faults) = (self.clone(), Vec::new());
        for (index, open_cloud) in self.all.iter().enumerate() {
            let entry = open_cloud.entry.and_then(|entry| scene.clouds.get(entry));
            let Some(hidden) = entry.and_then(|cloud| cloud.hidden.as_ref()) else { continue };
            let selection = hidden.selection(open_cloud.loaded.cloud.len());
            match selection.and_then(|selection| hiding.hiding(index, &selection)) {
                Ok(changed) => hiding = changed,
                Err(error) => faults.push(format!(
                    "{}: what was hidden is shown, its file has changed ({error})",
                    open_cloud.name()
                )),
            }
        }
        (hiding, faults)
    }

    /// With a cloud that a tool made from another one, which becomes hidden.
    pub(crate) fn derived(&self, from: usize, cloud: Cloud, tool: &str) -> Self {
        let mut all = self.all.to_vec();
        let name = all.get(from).map(OpenCloud::name).unwrap_or_default();
        if let Some(open_cloud) = all.get_mut(from) {
            open_cloud.visible = false;
        }
        let summary = Summary {
            file: format!("{name} ({tool})"),
            format: "not saved".to_owned(),
            n_surfels: cloud.len() as u64,
            columns: cloud.columns().iter().map(|column| column.name().to_owned()).collect(),
            ..Summary::default()
        };
        all.push(OpenCloud::new(Loaded { cloud, summary }));
        Self::of(all, self.removed.clone(), &self.clouds)
    }

    /// With clouds that were read from further files. They are in no scene yet, and saving one names their files.
    pub(crate) fn with(&self, added: &Clouds) -> Self {
        let mut all = self.all.to_vec();
        all.extend(added.loaded.iter().map(|loaded| {
            let file = Path::new(&loaded.summary.file);
            let path = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
            let on_disk = generations_on_disk(&loaded.cloud);
            let open_cloud =
                OpenCloud { saved_as: Some(path), on_disk, ..OpenCloud::new(loaded.clone()) };
            open_cloud.of_pyramid(added)
        }));
        Self::of(all, self.removed.clone(), &self.clouds)
    }

    /// With one cloud shown or hidden.
    pub(crate) fn showing(&self, index: usize, visible: bool) -> Self {
        self.changed(index, |open_cloud| open_cloud.visible = visible)
    }

    /// With one cloud drawn by a renderer of its own, or by the view's.
    pub(crate) fn drawn_by(&self, index: usize, renderer: Option<NamedRenderer>) -> Self {
        self.changed(index, |open_cloud| open_cloud.renderer = renderer)
    }

    /// With each cloud drawn as its entry of the scene says.
    pub(crate) fn drawn_as_in(&self, scene: &SceneFile) -> Self {
        let mut all = self.all.to_vec();
        for open_cloud in &mut all {
            let entry = open_cloud.entry.and_then(|entry| scene.clouds.get(entry));
            // What the user calls it now counts, as of a recovered one.
            let layer = entry.and_then(|cloud| scene.path_of_layer(cloud));
            *open_cloud = open_cloud.with_layer_from(layer.as_deref(), !open_cloud.recovered);
            let title = open_cloud.title.take();
            open_cloud.title = title.or_else(|| entry.and_then(|cloud| cloud.name.clone()));
            open_cloud.renderer = entry.and_then(|cloud| cloud.renderer.clone()).map(|renderer| {
                let place = open_cloud.name();
                NamedRenderer { renderer, place, folder: scene.folder.clone() }
            });
        }
        Self { all: Arc::new(all), ..self.clone() }
    }

    /// What the visible clouds name.
    pub(crate) fn named(&self) -> Vec<Option<NamedRenderer>> {
        let visible = self.all.iter().filter(|open_cloud| open_cloud.visible);
        visible.map(|open_cloud| open_cloud.renderer.clone()).collect()
    }

    /// With one cloud marked as saved, in the state that was written.
    pub(crate) fn saved(&self, index: usize, path: &Path, cloud: &Cloud) -> Self {
        self.noted(index, |open_cloud| {
            let on_disk = generations_on_disk(cloud);
            (open_cloud.saved_as, open_cloud.on_disk) = (Some(path.to_owned()), on_disk);
            // The file has it as it is placed.
            open_cloud.placed = None;
        })
    }

    /// The generation and bytes of every column.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (u64, u64)> {
        self.all.iter().flat_map(|open_cloud| columns_of(&open_cloud.loaded.cloud))
    }

    /// What was removed, without clouds.
    pub(super) fn without_clouds(&self) -> Self {
        let clouds = Arc::new(Clouds::of(Vec::new()));
        Self { all: Arc::default(), removed: self.removed.clone(), clouds }
    }

    /// These clouds in the place of those that are open; `before` is what was open before.
    pub(super) fn with_all(&self, all: Vec<OpenCloud>, before: &Self) -> Self {
        Self::of(all, self.removed.clone(), &before.clouds)
    }
}
