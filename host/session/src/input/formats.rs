//! The formats of plugins, found when a file needs one.

use crate::options::{LensArguments, PluginFiles, UpAxis};
use crate::output::terminal;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use surfelshop_api::format::{CloudSourceHost, FileHost, UpAxis as FileUpAxis};
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::{
    FormatCall, Formats, ReadFault, ReadOptions, SharedSink, WriteFault, WriteOptions,
};
use surfelshop_cloud::{Progress, scene, silent};
use surfelshop_pyramid::{NodeReader, Pyramid, is_pyramid_file};
use surfelshop_runtime::formats::PluginFormats;
use surfelshop_runtime::plugins::Registry;

/// The formats that plugin options name. Plugins are searched when the first file is not of a built-in format.
#[derive(Clone)]
pub struct SessionFormats {
    plugins: PluginFiles,
    values: Option<Values>,
    found: Arc<OnceLock<PluginFormats>>,
}

impl SessionFormats {
    /// The formats of these plugins; nothing is searched yet.
    #[must_use]
    pub fn new(plugins: &PluginFiles) -> Self {
        let values = plugins.format.values();
        Self { plugins: plugins.clone(), values, found: Arc::default() }
    }

    /// Those of plugins that were found already.
    #[must_use]
    pub fn of_registry(plugins: &PluginFiles, registry: Arc<Registry>) -> Self {
        let formats = Self::new(plugins);
        // It is new, so there is none.
        drop(formats.found.set(PluginFormats::new(registry, plugins.patience())));
        formats
    }

    fn found(&self) -> &PluginFormats {
        self.found.get_or_init(|| {
            let registry = match crate::session::registry(&self.plugins) {
                Ok(registry) => registry,
                Err(error) => {
                    terminal::warn_once(format!("{error:#}"));
                    Registry::default()
                }
            };
            PluginFormats::new(Arc::new(registry), self.plugins.patience())
        })
    }

    /// The plugins that options name.
    #[must_use]
    pub fn plugins(&self) -> &PluginFiles {
        &self.plugins
    }

    /// Formats that were loaded so far: none where every file was of a built-in format.
    #[must_use]
    pub fn n_loaded(&self) -> usize {
        self.found.get().map_or(0, PluginFormats::n_loaded)
    }

    /// How files are read with these formats, and with what was typed for them.
    #[must_use]
    pub fn reading<'a>(&'a self, progress: Progress<'a>) -> ReadOptions<'a> {
        ReadOptions {
            progress,
            formats: self,
            format: self.plugins.format.format.as_deref(),
            values: self.values.as_ref(),
            color_bits: self.plugins.format.color_bits.into(),
            ..ReadOptions::default()
        }
    }

    /// How files are written with these formats.
    #[must_use]
    pub fn writing<'a>(&'a self, progress: Progress<'a>) -> WriteOptions<'a> {
        WriteOptions { progress, formats: self, ..WriteOptions::default() }
    }
}

impl NodeReader for SessionFormats {
    fn with_options(&self, read: &mut dyn FnMut(&ReadOptions<'_>)) {
        read(&self.reading(&silent));
    }
}

impl Formats for SessionFormats {
    fn by_bytes(&self, head: &[u8]) -> Option<String> {
        self.found().by_bytes(head)
    }

    fn by_name(&self, name: &str, written: bool) -> Option<String> {
        self.found().by_name(name, written)
    }

    fn takes_several(&self, id: &str) -> bool {
        self.found().takes_several(id)
    }

    fn takes_grids(&self, id: &str) -> bool {
        self.found().takes_grids(id)
    }

    fn beside(&self, id: &str) -> Vec<String> {
        self.found().beside(id)
    }

    fn endings(&self, written: bool) -> Vec<String> {
        self.found().endings(written)
    }

    fn read(
        &self,
        id: &str,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        sink: SharedSink,
        progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        self.found().read(id, file, call, sink, progress)
    }

    fn write(
        &self,
        id: &str,
        clouds: Box<dyn CloudSourceHost + Send>,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault> {
        self.found().write(id, clouds, file, call, progress)
    }
}

/// The axis that points upwards in files, where it was not typed: their heads are looked at. Files that cannot be
/// read say nothing here; whoever reads them says why.
pub fn stand_upright(lens: &mut LensArguments, files: &[PathBuf], plugins: &PluginFiles) {
    if lens.up != UpAxis::Auto {
        return;
    }
    let formats = SessionFormats::new(plugins);
    let clouds = files.iter().flat_map(|file| clouds_of(file));
    // Meshes as text never say it, and to read their heads is to read them.
    let says_z = clouds.filter(|file| !is_text_mesh(file)).any(|file| {
        if is_pyramid_file(&file) {
            return Pyramid::directory_of(&file)
                .is_ok_and(|directory| directory.source.up == FileUpAxis::Z);
        }
        let heads = surfelshop_cloud::heads(&file, &formats.reading(&silent));
        heads.is_ok_and(|heads| heads.iter().any(|header| header.up == FileUpAxis::Z))
    });
    if says_z {
        lens.up = UpAxis::Z;
    }
}

/// The clouds that a scene shows as they are, or the file itself.
fn clouds_of(file: &Path) -> Vec<PathBuf> {
    if !scene::is_scene(file) {
        return vec![file.to_owned()];
    }
    let Ok(opened) = scene::read(file) else { return Vec::new() };
    let scene = &opened.scene;
    let shown = scene.clouds.iter().filter(|cloud| cloud.visible && cloud.transform.is_none());
    shown.map(|cloud| scene.path_of(cloud)).collect()
}

/// Whether a file's name is that of a mesh as text.
fn is_text_mesh(file: &Path) -> bool {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    matches!(ending.as_str(), "obj" | "off")
}

/// Values of a format's parameters as they were typed, to be read when the format is loaded; `None` where there are none.
pub fn typed_values<'a>(typed: impl Iterator<Item = (&'a str, &'a str)>) -> Option<Values> {
    let values: Values =
        typed.map(|(id, text)| (id.to_owned(), Value::Text(text.to_owned()))).collect();
    (!values.is_empty()).then_some(values)
}
