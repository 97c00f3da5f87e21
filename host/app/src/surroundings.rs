//! The light around what is shown: probes as renderers are given them.

use crate::arguments::EnvironmentArguments;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_api::{Environment, EnvironmentView};
use surfelshop_cloud::probe::{self, Mapping, Probe};
use surfelshop_cloud::scene::{ProbeSource, SceneEnvironment, SceneFile};
use surfelshop_engine::{Store, cache_folder};

/// A probe that stands around the scene.
#[derive(Clone)]
pub(crate) struct Surroundings {
    pub(crate) probe: Arc<Probe>,
    environment: Environment,
}

impl Surroundings {
    /// As the engine takes it.
    pub(crate) fn view(&self) -> EnvironmentView<'_> {
        EnvironmentView { environment: &self.environment, texels: &self.probe.texels }
    }
}

/// Which picture a probe is: where it comes from, and how it is to be read.
type Key = (ProbeSource, Option<Mapping>);

/// Probes that were read, the last ones used.
#[derive(Default)]
pub(crate) struct Probes {
    kept: Vec<(Key, Arc<Probe>)>,
}

/// Probes kept beside the one in use; each takes 12 MB and its picture.
const KEPT: usize = 2;

impl Probes {
    /// The light that a scene asks for; paths are relative to the current folder.
    ///
    /// # Errors
    /// Where the probe cannot be read.
    pub(crate) fn light(&mut self, wanted: &SceneEnvironment) -> anyhow::Result<Surroundings> {
        let key = (wanted.source.clone(), wanted.mapping);
        let known = self.kept.iter().position(|(other, _)| *other == key);
        let probe = match known {
            Some(at) => self.kept.remove(at).1,
            None => Arc::new(read(&key)?),
        };
        self.kept.insert(0, (key, probe.clone()));
        self.kept.truncate(1 + KEPT);
        let environment = Environment {
            facts: probe.facts.clone(),
            probe_from_world: wanted.probe_from_world(),
            gain: wanted.gain(),
        };
        Ok(Surroundings { probe, environment })
    }
}

fn read((source, mapping): &Key) -> anyhow::Result<Probe> {
    match source {
        ProbeSource::Studio => Ok(Probe::studio()),
        ProbeSource::Sky => Ok(Probe::sky()),
        ProbeSource::File(path) => read_file(path, *mapping),
    }
}

/// Where things are kept that could be made again.
pub(crate) fn store() -> Option<Store> {
    // Tests must not find what other programs left.
    let folder = if cfg!(test) { None } else { cache_folder() };
    folder.map(Store::in_folder)
}

/// Changes whenever a probe's bytes or what they say of the same file do.
const STORED_VERSION: u32 = 1;

/// Reads a file, or finds what was made of the same bytes before.
pub(crate) fn read_file(path: &Path, mapping: Option<Mapping>) -> anyhow::Result<Probe> {
    // What cannot be read is left to the reader, which says why.
    let contents = path.metadata().ok().filter(std::fs::Metadata::is_file);
    let contents = contents.and_then(|_| std::fs::read(path).ok()).map(|bytes| sum(&bytes));
    let store = store();
    let name = contents.map(|sum| {
        let mapping = mapping.map_or("detected", Mapping::name);
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        format!("probe {STORED_VERSION} {mapping} {file} {sum:?}")
    });
    if let (Some(store), Some(name)) = (&store, &name)
        && let Some(probe) = store.load(name).and_then(|bytes| Probe::from_bytes(&bytes))
    {
        return Ok(probe);
    }
    let probe = probe::read(path, mapping)?;
    if let (Some(store), Some(name)) = (&store, &name) {
        store.save(name, &probe.to_bytes());
    }
    Ok(probe)
}

/// A sum over the bytes of a file and their number.
fn sum(bytes: &[u8]) -> (u64, usize) {
    use std::hash::{DefaultHasher, Hasher as _};
    let mut hasher = DefaultHasher::new();
    hasher.write(bytes);
    (hasher.finish(), bytes.len())
}

/// Whether a file is a light probe, by its name.
pub(crate) fn is_probe(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    matches!(ending.as_str(), "hdr" | "pic" | "exr")
}

/// A probe named on the command line or chosen in a dialog.
pub(crate) fn source(name: &str) -> ProbeSource {
    match name {
        "studio" => ProbeSource::Studio,
        "sky" => ProbeSource::Sky,
        path => ProbeSource::File(PathBuf::from(path)),
    }
}

/// The environment of a scene file with a path that can be opened from the current folder.
pub(crate) fn of_scene(file: &SceneFile) -> Option<SceneEnvironment> {
    let known = &file.environment.as_ref()?.known;
    let source = match file.path_of_probe(&known.source) {
        Some(path) => ProbeSource::File(path),
        None => known.source.clone(),
    };
    Some(SceneEnvironment { source, ..known.clone() })
}

/// What was typed, over what the scene says.
pub(crate) fn wanted(
    typed: &EnvironmentArguments,
    scene: Option<SceneEnvironment>,
) -> anyhow::Result<Option<SceneEnvironment>> {
    let named = match typed.env.as_deref() {
        Some("none") => return Ok(None),
        Some(name) => Some(SceneEnvironment::new(source(name))),
        None => scene,
    };
    let Some(mut environment) = named else {
        let turned = typed.env_mapping.is_some()
            || typed.env_forward.is_some()
            || typed.env_up.is_some()
            || typed.env_rotation.is_some()
            || typed.env_exposure.is_some();
        anyhow::ensure!(!turned, "expected --env PROBE beside other --env- options");
        return Ok(None);
    };
    environment.mapping = typed.env_mapping.or(environment.mapping);
    environment.forward = typed.env_forward.unwrap_or(environment.forward);
    environment.up = typed.env_up.unwrap_or(environment.up);
    if let Some(degrees) = typed.env_rotation {
        environment.rotation = degrees.to_radians();
    }
    environment.stops = typed.env_exposure.unwrap_or(environment.stops);
    let across = environment.forward.direction().cross(environment.up.direction());
    anyhow::ensure!(
        across.length_squared() > 0.5,
        "expected --env-forward and --env-up across each other, found {} and {}",
        environment.forward.name(),
        environment.up.name()
    );
    Ok(Some(environment))
}

/// Reads the probe that is wanted, if one is.
pub(crate) fn read_wanted(
    wanted: Option<&SceneEnvironment>,
) -> anyhow::Result<Option<Surroundings>> {
    let Some(wanted) = wanted else { return Ok(None) };
    Probes::default().light(wanted).map(Some)
}
