//! The interface as it was listed when each revision was made: nothing of it is gone or another.

use crate::versions::listing::{listing, names_of_use};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};

/// Set to 1, the listing of this revision is written anew: after something was added, and looked at.
const ACCEPT: &str = "SURFELSHOP_ACCEPT_INTERFACE";

fn stored(minor: u16) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stored");
    folder.join(format!("{ABI_MAJOR}.{minor}")).join("interface.txt")
}

fn lines(path: &Path) -> BTreeSet<String> {
    let text =
        fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let names = |line: &str| match line.strip_prefix("use ") {
        Some(tree) => names_of_use(tree),
        None => vec![line.to_owned()],
    };
    text.lines().flat_map(names).collect()
}

/// What plugins never linked and has another name now: the host's half of the boundary, whose items are
/// all listed, in `surfelshop_runtime::boundary`. An instance is a library's, or a module's in the sandbox.
const RENAMED: [&str; 4] =
    ["mod host_side", "impl Drop for Instance", "impl Send for Instance", "impl Sync for Instance"];

/// Invariant: nothing that plugins can name goes away within a major version, shader modules
/// included
#[test]
fn nothing_that_plugins_can_name_goes_away_within_a_major_version() {
    let now = listing();
    let mut n_listed = 0;
    for minor in 0..=ABI_MINOR {
        let path = stored(minor);
        // The first revision that was listed is 3.3.
        if !path.exists() {
            continue;
        }
        let then = lines(&path);
        let gone = then.difference(&now).filter(|line| !RENAMED.contains(&line.as_str()));
        let gone: Vec<&String> = gone.collect();
        assert!(
            gone.is_empty(),
            "the interface of {ABI_MAJOR}.{minor} had these, which are gone or another now; plugins that \
             name them would not build or load. Bring them back, or raise ABI_MAJOR:\n{}",
            gone.iter().map(|line| format!("  {line}\n")).collect::<String>()
        );
        n_listed += 1;
    }
    assert!(n_listed > 0, "no revision of ABI {ABI_MAJOR} is listed");
}

#[test]
fn what_was_added_is_listed() {
    let (now, path) = (listing(), stored(ABI_MINOR));
    if std::env::var(ACCEPT).is_ok_and(|value| value == "1") {
        let text: String = now.iter().map(|line| format!("{line}\n")).collect();
        fs::write(&path, text).unwrap();
    }
    let then = lines(&path);
    let added: Vec<&String> = now.difference(&then).collect();
    assert!(
        added.is_empty(),
        "{} lacks {} lines. Where a plugin of an older host could meet them, raise ABI_MINOR and refuse \
         them by name there; then set {ACCEPT}=1. The first: {}",
        path.display(),
        added.len(),
        added[0]
    );
}

#[test]
fn lines_tell_apart_what_must_not_change() {
    let lines = listing();
    for line in [
        "Renderer::fn frame (& mut self , frame : & Frame < Self :: Params > , graph : & mut Graph) -> Result < () >",
        "Renderer::const LIMITS: & 'static [LimitInfo] (given)",
        "serde (default) field Pass.features: BTreeMap < String , bool >",
        "variant Element::F32 = 6",
        "macro export_plugin!",
        "wgsl surfelshop::light fn arriving(i: u32, position: vec3<f32>) -> Arriving",
    ] {
        assert!(lines.contains(line), "{line} is not among {} lines", lines.len());
    }
}
