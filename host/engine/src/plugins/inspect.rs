//! Judges a plugin file by its bytes, before any of its code runs.

use super::binary::{self, Library};
use std::fmt;
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, Read};
use std::path::Path;
use surfelshop_api::abi::table::{self, PluginTable};
use surfelshop_api::manifest::{self, HEADER_LEN, MAX_TEXT_LEN, Manifest, Refusal};

/// Files longer than this are refused unread; plugins have a few megabytes.
pub const MAX_FILE_LEN: u64 = 1 << 30;

/// What tells one state of a file from another: its contents rather than the time of its change,
/// since a copy may keep the time of its source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Contents {
    len: u64,
    digest: u64,
}

impl Contents {
    /// Those of a file as it is now; files that cannot be read are all alike.
    #[must_use]
    pub fn of_file(path: &Path) -> Self {
        read(path).map(|bytes| Self::of(&bytes)).unwrap_or_default()
    }

    pub(super) fn of(bytes: &[u8]) -> Self {
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        Self { len: bytes.len() as u64, digest: hasher.finish() }
    }
}

impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.digest)
    }
}

/// Why a file is not taken as a plugin; reads on from the file's name: `x.so is empty`.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// There is no such file.
    #[error("does not exist")]
    Missing,
    /// The path leads to a folder, a pipe or a device.
    #[error("is {found}, expected a shared library")]
    NotAFile {
        /// What it is.
        found: &'static str,
    },
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(#[source] io::Error),
    /// The file has no contents.
    #[error("is empty, expected a shared library; build or copy it again")]
    Empty,
    /// The file is longer than [`MAX_FILE_LEN`].
    #[error("has {found} bytes, at most {MAX_FILE_LEN} are accepted")]
    TooLarge {
        /// The file's length.
        found: u64,
    },
    /// The contents are of another type.
    #[error("is not a shared library (first bytes \"{first_bytes}\")")]
    NotALibrary {
        /// The first bytes, printable.
        first_bytes: String,
    },
    /// The file ends before what its headers announce.
    #[error(
        "is cut off: its headers need {needed} bytes, the file has {found}; build or copy it again"
    )]
    Truncated {
        /// The least length that holds everything announced.
        needed: u64,
        /// The file's length.
        found: u64,
    },
    /// The headers contradict each other.
    #[error("is damaged: {0}; build or copy it again")]
    Damaged(String),
    /// The file is a program or an object file.
    #[error("is {found}, expected a shared library (crate-type = [\"cdylib\"])")]
    OtherKind {
        /// What it is.
        found: &'static str,
    },
    /// The library is for other processors or another system.
    #[error("is built for {found}, this host is {host}: build it for this machine")]
    OtherMachine {
        /// Processor and system of the file.
        found: String,
        /// Processor and system of this program.
        host: String,
    },
    /// The library does not export a manifest.
    #[error(
        "is a shared library but no Surfelshop plugin: it does not export `{}` \
         (a plugin calls export_plugin!)",
        manifest::SYMBOL
    )]
    NoManifest,
    /// The library exports a manifest and no functions.
    #[error(
        "has a plugin manifest but {0} `{symbol}`; build it again with export_plugin!",
        symbol = table::SYMBOL
    )]
    NoTable(&'static str),
    /// The manifest cannot be read or speaks another ABI.
    #[error("is refused: {0}")]
    Manifest(Refusal),
}

/// Reads the manifest of a plugin file without loading it.
///
/// # Errors
/// Where the file is not a whole plugin for this host; says what was expected and found, without
/// naming the file.
pub fn inspect(path: &Path) -> Result<Manifest, Refused> {
    inspect_bytes(&read(path)?)
}

/// The contents of a plugin file.
///
/// # Errors
/// Where the path leads to no regular file of acceptable length.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Refused> {
    let unreadable = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => Refused::Missing,
        _ => Refused::Unreadable(error),
    };
    // Opening a pipe would wait for a writer, so the type is asked for first.
    let metadata = path.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(Refused::NotAFile { found: "a folder" });
    }
    if !metadata.is_file() {
        return Err(Refused::NotAFile { found: "no regular file" });
    }
    if metadata.len() > MAX_FILE_LEN {
        return Err(Refused::TooLarge { found: metadata.len() });
    }
    let mut bytes = Vec::new();
    // The file may grow while it is read; the limit holds all the same.
    let mut file = File::open(path).map_err(unreadable)?.take(MAX_FILE_LEN + 1);
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    match bytes.len() as u64 {
        found if found > MAX_FILE_LEN => Err(Refused::TooLarge { found }),
        _ => Ok(bytes),
    }
}

/// Reads the manifest out of a library's bytes.
///
/// # Errors
/// As [`inspect`].
pub fn inspect_bytes(bytes: &[u8]) -> Result<Manifest, Refused> {
    if bytes.is_empty() {
        return Err(Refused::Empty);
    }
    let library = Library::parse(bytes)?;
    library.check_machine()?;
    library.check_length()?;
    let [manifest, table] = library.exports([manifest::SYMBOL, table::SYMBOL])?;
    let address = manifest.ok_or(Refused::NoManifest)?;
    let Some(contents) = library.bytes_at(address) else {
        return Err(malformed("it lies outside the file"));
    };
    let contents = &contents[..contents.len().min(HEADER_LEN + MAX_TEXT_LEN)];
    let manifest = manifest::decode(contents).map_err(Refused::Manifest)?;
    check_names(&manifest)?;
    let Some(table) = table else {
        return Err(Refused::NoTable("does not export"));
    };
    if !library.holds(table, size_of::<PluginTable>() as u64) {
        return Err(Refused::NoTable("has no room for"));
    }
    Ok(manifest)
}

fn malformed(what: impl Into<String>) -> Refused {
    Refused::Manifest(Refusal::Malformed(what.into()))
}

/// Refuses names that could not be typed or that would disturb a terminal.
fn check_names(manifest: &Manifest) -> Result<(), Refused> {
    let is_id = |id: &str, more: &str| {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || more.contains(c);
        !id.is_empty() && id.len() <= 128 && id.chars().all(allowed)
    };
    if !is_id(&manifest.id.to_ascii_lowercase(), "-_.") {
        let id = manifest.id.escape_debug();
        return Err(malformed(format!("`{id}` is no package id such as org.example.mine")));
    }
    let shown = [&manifest.version, &manifest.authors, &manifest.license, &manifest.api];
    let units = manifest.units.iter().flat_map(|unit| [&unit.title, &unit.summary]);
    if let Some(text) = shown.into_iter().chain(units).find(|t| t.chars().any(char::is_control)) {
        let text = text.escape_debug();
        return Err(malformed(format!("its text \"{text}\" has control characters")));
    }
    for (i, unit) in manifest.units.iter().enumerate() {
        if !is_id(&unit.id, "-") {
            let id = unit.id.escape_debug();
            return Err(malformed(format!("`{id}` is no unit id: a-z, 0-9 and - are allowed")));
        }
        if manifest.units[..i].iter().any(|other| other.kind == unit.kind && other.id == unit.id) {
            let kind = unit.kind.word();
            return Err(malformed(format!("it exports two {kind}s `{}`", unit.id)));
        }
    }
    Ok(())
}

/// The first bytes of a file, printable.
pub(super) fn first_bytes(bytes: &[u8]) -> String {
    bytes[..bytes.len().min(binary::MAGIC_LEN)].escape_ascii().to_string()
}
