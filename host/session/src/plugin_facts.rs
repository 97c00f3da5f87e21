//! Facts of plugins as they are shown.

use std::path::{Path, PathBuf};
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::{Entry, Origin, TrustState};

/// The picture in a pack.
pub const PREVIEW: &str = "preview.png";

/// The folder beside an installed plugin of what it was packed with.
pub fn packed_with(plugin: &Path) -> PathBuf {
    plugin.with_extension("pack")
}

/// The picture that a plugin was packed with, where it was installed from a pack that has one.
pub fn preview(entry: &Entry) -> Option<PathBuf> {
    let preview = packed_with(&entry.path).join(PREVIEW);
    (entry.origin == Origin::UserFolder && preview.is_file()).then_some(preview)
}

/// Who made a plugin, as it says itself.
pub fn author(manifest: &Manifest) -> String {
    // As Cargo joins them.
    let authors = manifest.authors.replace(':', ", ");
    if authors.is_empty() { "nobody named".to_owned() } else { authors }
}

/// The same of a plugin that was found: those that lie beside the program are its own and name nobody. A name alone proves
/// nothing.
pub fn author_of(manifest: &Manifest, trust: TrustState) -> String {
    match trust {
        TrustState::OfProgram if manifest.authors.is_empty() => "Surfelshop".to_owned(),
        _ => author(manifest),
    }
}

/// Under which licence a plugin is.
pub fn licence(manifest: &Manifest) -> &str {
    if manifest.license.is_empty() { "none named" } else { &manifest.license }
}

/// Which hosts a plugin works in.
pub fn api_range(manifest: &Manifest) -> String {
    let Manifest { api, abi_major: major, abi_minor: minor, .. } = manifest;
    let next = u32::from(*major) + 1;
    // C has no version of the crate.
    let of = if api.is_empty() { String::new() } else { format!("{api}, ") };
    format!("{of}for hosts of ABI {major}.{minor} and later, before {next}.0")
}

/// How a library runs that is isolated.
pub const ISOLATED: &str = "in a process of its own";

/// Whether a file may run, and why.
pub fn trusted(standing: TrustState) -> &'static str {
    match standing {
        TrustState::OfProgram => "yes, it came with the program",
        TrustState::Build => "yes, this build",
        TrustState::Place => "yes, whatever is built there",
        TrustState::Once => "yes, this once",
        TrustState::Sandboxed => "not needed, it runs in a sandbox",
        TrustState::New => "no: its code runs after `surfelshop plugins trust`, or with --trust",
    }
}
