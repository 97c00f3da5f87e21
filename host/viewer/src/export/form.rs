//! What is chosen in the export window.

use super::job::ExportPicture;
use surfelshop_api::Camera;

/// Which cameras are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExportKind {
    View,
    Turntable,
    Path,
}

/// Which renderers of the focused view are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RendererChoice {
    First,
    Second,
    Both,
}

impl RendererChoice {
    pub(super) fn sides(self) -> &'static [usize] {
        match self {
            Self::First => &[0],
            Self::Second => &[1],
            Self::Both => &[0, 1],
        }
    }
}

/// The fields of the export window.
pub(crate) struct ExportForm {
    pub(crate) open: bool,
    pub(super) kind: ExportKind,
    pub(super) renderers: RendererChoice,
    pub(crate) path: String,
    /// Whether pictures have the size of the view, and not [`Self::size`], pixels.
    pub(super) as_view: bool,
    pub(super) size: [u32; 2],
    /// Whether a new width takes the height along, and the reverse.
    pub(super) keeps_proportions: bool,
    /// Width by height that it keeps: digits that are typed one by one would round it away.
    pub(super) proportions: f64,
    pub(super) n_frames: usize,
    /// Whether what is behind the clouds is left out.
    pub(crate) transparent: bool,
    /// Whether what colours mean is drawn into the pictures.
    pub(crate) legend: bool,
    /// Whether measures are.
    pub(crate) measures: bool,
    /// The cameras of a path, in order.
    pub(super) keys: Vec<Camera>,
    /// Pictures that would overwrite files, with the number of these files, until the user has decided.
    pub(super) overwrite: Option<(Vec<ExportPicture>, usize)>,
}

impl Default for ExportForm {
    fn default() -> Self {
        Self {
            open: false,
            kind: ExportKind::View,
            renderers: RendererChoice::First,
            path: usual_path(),
            as_view: true,
            size: [1920, 1080],
            keeps_proportions: true,
            proportions: 1920.0 / 1080.0,
            n_frames: 120,
            transparent: false,
            legend: true,
            measures: true,
            keys: Vec::new(),
            overwrite: None,
        }
    }
}

impl ExportForm {
    /// Sets a size, whose proportions are kept.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.proportions = f64::from(size[0].max(1)) / f64::from(size[1].max(1));
    }
}

/// A file in the user's folder of pictures, else in the present one.
fn usual_path() -> String {
    let home = std::env::var_os(if cfg!(windows) { "USERPROFILE" } else { "HOME" });
    let pictures = home.map(|home| std::path::PathBuf::from(home).join("Pictures"));
    let folder = pictures.filter(|folder| folder.is_dir()).or(std::env::current_dir().ok());
    folder.unwrap_or_default().join("surfelshop.png").display().to_string()
}

#[cfg(test)]
impl ExportForm {
    /// Sets path, size and number of pictures.
    pub(crate) fn set(&mut self, path: &str, size: [u32; 2], n_frames: usize) {
        path.clone_into(&mut self.path);
        self.resize(size);
        (self.as_view, self.n_frames) = (false, n_frames);
    }
}
