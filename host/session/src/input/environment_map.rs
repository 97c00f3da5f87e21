//! The light around what is shown: probes as renderers are given them.

use crate::input::probe_info;
use crate::options::{EnvironmentArguments, UpAxis};
use crate::output::{files, terminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;
use surfelshop_api::{Environment, EnvironmentView};
use surfelshop_cloud::environment_map::{self, Mapping, Probe};
use surfelshop_cloud::scene::{Axis, ProbeSource, SceneEnvironment, SceneFile};
use surfelshop_render::DiskCache;
use surfelshop_runtime::plugins::cache_folder;

/// A probe that stands around the scene.
pub struct LoadedEnvironment {
    /// The light probe.
    pub probe: Arc<Probe>,
    environment: Environment,
}

impl LoadedEnvironment {
    fn new(probe: Arc<Probe>, wanted: &SceneEnvironment) -> Self {
        let environment = Environment {
            facts: probe.facts.clone(),
            probe_from_world: wanted.probe_from_world(),
            gain: wanted.gain(),
        };
        Self { probe, environment }
    }

    /// The same probe as another environment of it stands.
    #[must_use]
    pub fn standing_as(self, wanted: &SceneEnvironment) -> Self {
        Self::new(self.probe, wanted)
    }

    /// As the engine takes it.
    pub fn view(&self) -> EnvironmentView<'_> {
        EnvironmentView { environment: &self.environment, texels: &self.probe.texels }
    }
}

/// Which picture a probe is: where it comes from, how it is to be read, and the length and time of
/// the file, which may be written anew.
type Key = (ProbeSource, Option<Mapping>, Option<(u64, SystemTime)>);

fn key(wanted: &SceneEnvironment) -> Key {
    let state = match &wanted.source {
        ProbeSource::File(path) => path.metadata().ok(),
        ProbeSource::Studio | ProbeSource::Sky => None,
    };
    let state = state.and_then(|file| Some((file.len(), file.modified().ok()?)));
    (wanted.source.clone(), wanted.mapping, state)
}

/// Probes that were read, the last ones used.
#[derive(Default)]
pub struct Probes {
    kept: Vec<(Key, Arc<Probe>)>,
    /// The last one that could not be read, which is not tried again until its file changes.
    unreadable: Option<Key>,
}

/// Probes kept beside the one in use; each takes 12 MB and its picture.
const KEPT: usize = 2;

impl Probes {
    /// The light that a scene asks for, or none where its probe cannot be read; paths are relative
    /// to the current folder. Tells why not in a line, once for a file as it is.
    pub fn light_or_none(
        &mut self,
        wanted: &SceneEnvironment,
        mut tell: impl FnMut(String),
    ) -> Option<LoadedEnvironment> {
        let key = key(wanted);
        if self.unreadable.as_ref() == Some(&key) {
            return None;
        }
        let light = self.light(wanted, &mut tell);
        self.unreadable = light.is_err().then_some(key);
        light.map_err(|error| tell(format!("{error:#}"))).ok()
    }

    /// The light that a scene asks for; paths are relative to the current folder. Tells in a line
    /// what was replaced in a probe that is read for the first time.
    ///
    /// # Errors
    /// Where the probe cannot be read.
    pub fn light(
        &mut self,
        wanted: &SceneEnvironment,
        tell: impl FnOnce(String),
    ) -> anyhow::Result<LoadedEnvironment> {
        let key = key(wanted);
        let known = self.kept.iter().position(|(other, _)| *other == key);
        let probe = match known {
            Some(at) => self.kept.remove(at).1,
            None => {
                let probe = read(&wanted.source, wanted.mapping)?;
                if let Some(line) = probe_info::repairs(&probe) {
                    tell(format!("{}: {line}", probe.name));
                }
                Arc::new(probe)
            }
        };
        self.kept.insert(0, (key, probe.clone()));
        self.kept.truncate(1 + KEPT);
        Ok(LoadedEnvironment::new(probe, wanted))
    }
}

/// Reads a probe, or makes a built-in one.
///
/// # Errors
/// Where the file cannot be read.
pub fn read(source: &ProbeSource, mapping: Option<Mapping>) -> anyhow::Result<Probe> {
    match source {
        ProbeSource::Studio => Ok(Probe::studio()),
        ProbeSource::Sky => Ok(Probe::sky()),
        ProbeSource::File(path) => read_file(path, mapping),
    }
}

/// Where things are kept that could be made again.
pub fn store() -> Option<DiskCache> {
    // Tests must not find what other programs left.
    let folder = if cfg!(test) { None } else { cache_folder() };
    folder.map(DiskCache::in_folder)
}

/// Changes whenever the bytes of a stored probe do.
const STORED_VERSION: u32 = 2;

/// Files beyond this are not looked up, since that reads all of them.
const LARGEST_LOOKED_UP: u64 = 1 << 30;

/// Reads a file, or finds what was made of the same bytes before.
fn read_file(path: &Path, mapping: Option<Mapping>) -> anyhow::Result<Probe> {
    let store = store();
    let name = store.as_ref().and_then(|_| stored_name(path, mapping));
    if let (Some(store), Some(name)) = (&store, &name)
        && let Some(probe) = store.load(name).and_then(|bytes| Probe::from_bytes(&bytes))
    {
        return Ok(probe);
    }
    let probe = environment_map::read(path, mapping)?;
    if let (Some(store), Some(name)) = (&store, &name) {
        store.save(name, &probe.to_bytes());
    }
    Ok(probe)
}

/// What a file is stored as; `None` for what cannot be read, which is left to the reader, who says
/// why.
fn stored_name(path: &Path, mapping: Option<Mapping>) -> Option<String> {
    use siphasher::sip128::{Hasher128 as _, SipHasher13};
    use std::hash::Hasher as _;
    let (mut file, metadata) = surfelshop_cloud::files::open(path).ok()?;
    if metadata.len() > LARGEST_LOOKED_UP {
        return None;
    }
    let (mut hasher, mut length, mut part) = (SipHasher13::new(), 0u64, vec![0; 1 << 16]);
    loop {
        let n = std::io::Read::read(&mut file, &mut part).ok()?;
        if n == 0 {
            break;
        }
        hasher.write(part.get(..n)?);
        length += n as u64;
    }
    let mapping = mapping.map_or("detected", Mapping::name);
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let (version, sum) = (environment_map::VERSION, hasher.finish128().as_u128());
    Some(format!("probe {STORED_VERSION} {version} {mapping} {file} {length} {sum:032x}"))
}

/// The light probe that an argument among clouds and scenes names: a file, by its ending, or a
/// built-in one that no file is called like.
pub fn probe_named(path: &Path) -> Option<ProbeSource> {
    let source = path.to_str().map_or_else(|| ProbeSource::File(path.to_owned()), source);
    let is_file = matches!(source, ProbeSource::File(_));
    let is_probe = if is_file { is_probe(path) } else { !path.exists() };
    is_probe.then_some(source)
}

/// Whether a file is a light probe, by its name.
pub fn is_probe(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    matches!(ending.as_str(), "hdr" | "pic" | "exr")
}

/// A probe named on the command line or chosen in a dialog.
pub fn source(name: &str) -> ProbeSource {
    match name {
        "studio" => ProbeSource::Studio,
        "sky" => ProbeSource::Sky,
        path => ProbeSource::File(PathBuf::from(path)),
    }
}

/// What a probe is called: a path, or the name of a built-in one.
pub fn name(source: &ProbeSource) -> String {
    match source {
        ProbeSource::Studio => "studio".to_owned(),
        ProbeSource::Sky => "sky".to_owned(),
        ProbeSource::File(path) => path.display().to_string(),
    }
}

/// The environment of a scene file with a path that can be opened from the current folder.
pub fn of_scene(file: &SceneFile) -> Option<SceneEnvironment> {
    let known = &file.environment.as_ref()?.known;
    let source = match file.path_of_probe(&known.source) {
        Some(path) => ProbeSource::File(path),
        None => known.source.clone(),
    };
    Some(SceneEnvironment { source, ..known.clone() })
}

/// Whether a light is named by its probe alone: it stands as the world does.
pub fn follows_up(typed: &EnvironmentArguments) -> bool {
    typed.env.is_some() && typed.env_forward.is_none() && typed.env_up.is_none()
}

/// A probe as it stands in a world whose clouds have this axis upwards.
pub fn standing(source: ProbeSource, up: UpAxis) -> SceneEnvironment {
    let environment = SceneEnvironment::new(source);
    let axis = |of: Axis| Axis::nearest(up.axis().from_y_up(of.direction()));
    let (forward, up) = (axis(environment.forward), axis(environment.up));
    SceneEnvironment { forward, up, ..environment }
}

/// What was typed, over what the scene says.
pub fn wanted(
    typed: &EnvironmentArguments,
    up: UpAxis,
    scene: Option<SceneEnvironment>,
) -> anyhow::Result<Option<SceneEnvironment>> {
    let named = match typed.env.as_deref() {
        Some("none") => return Ok(None),
        Some(name) => Some(standing(source(name), up)),
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
    if !environment.up.is_across(environment.forward) && typed.env_forward.is_none() {
        // The usual one of a world whose z points upwards.
        environment.forward = Axis::PlusY;
    }
    if let Some(degrees) = typed.env_rotation {
        environment.rotation = degrees.to_radians();
    }
    environment.stops = typed.env_exposure.unwrap_or(environment.stops);
    anyhow::ensure!(
        environment.up.is_across(environment.forward),
        "expected --env-forward and --env-up across each other, found {} and {}",
        environment.forward.name(),
        environment.up.name()
    );
    Ok(Some(environment))
}

/// Lets nothing replace the file of a probe that is read.
pub fn protect(wanted: Option<&SceneEnvironment>) {
    if let Some(ProbeSource::File(path)) = wanted.map(|wanted| &wanted.source) {
        files::protect([path.as_path()]);
    }
}

/// Reads the probe that is wanted, if one is.
pub fn read_wanted(wanted: Option<&SceneEnvironment>) -> anyhow::Result<Option<LoadedEnvironment>> {
    let Some(wanted) = wanted else { return Ok(None) };
    protect(Some(wanted));
    let tell = |line: String| terminal::warn(line);
    Probes::default().light(wanted, tell).map(Some)
}
