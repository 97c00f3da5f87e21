//! Judges a plugin file by its bytes, before any of its code runs.

use super::binary::{self, ELF_MAGIC, Library};
use super::modules::{self, MAX_MODULE_LEN, Unfit, is_module};
use object::{ReadCache, ReadRef};
use sha2::{Digest as _, Sha256};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::{fmt, io};
use surfelshop_api::UnitKind;
use surfelshop_api::abi::format_table::{self, FormatTable};
use surfelshop_api::abi::table::{self, PluginTable};
use surfelshop_api::manifest::{self, HEADER_LEN, MAX_TEXT_LEN, Manifest, Refusal};
use surfelshop_cloud::files::{self, OpenFault};

/// Files longer than this are refused unread; plugins have a few megabytes.
pub const MAX_FILE_LEN: u64 = 1 << 30;

/// What tells one state of a file from another: its contents rather than the time of its change,
/// since a copy may keep the time of its source. It is their SHA-256, since trust is given to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Contents([u8; 32]);

impl Contents {
    /// Those of a file as it is now; files that cannot be read are all alike.
    #[must_use]
    pub fn of_file(path: &Path) -> Self {
        read(path).map(|bytes| Self::of(&bytes)).unwrap_or_default()
    }

    pub(super) fn of(bytes: &[u8]) -> Self {
        Self(Sha256::digest(bytes).into())
    }

    /// Those of a written SHA-256: 64 hexadecimal digits.
    #[must_use]
    pub fn from_sha256(text: &str) -> Option<Self> {
        let mut digest = [0; 32];
        let pairs = text.as_bytes().chunks_exact(2);
        if text.len() != 64 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return None;
        }
        for (byte, pair) in digest.iter_mut().zip(pairs) {
            *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
        }
        Some(Self(digest))
    }
}

/// The SHA-256, in hexadecimal digits.
impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
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
    /// The library's manifest names formats, and it exports no functions of them.
    #[error("names formats but {0} `{symbol}`; build it again with export_plugin!", symbol = format_table::SYMBOL)]
    NoFormats(&'static str),
    /// The manifest cannot be read or speaks another ABI.
    #[error("is refused: {0}")]
    Manifest(Refusal),
    /// A WebAssembly module that is no plugin.
    #[error(transparent)]
    Module(#[from] Unfit),
}

/// Reads the manifest of a plugin file without loading it, and its contents.
///
/// # Errors
/// Where the file is not a whole plugin for this host; says what was expected and found, without
/// naming the file.
pub fn inspect(path: &Path) -> Result<(Manifest, Contents), Refused> {
    let bytes = read(path)?;
    Ok((inspect_bytes(&bytes)?, Contents::of(&bytes)))
}

/// Reads the manifest of a library of Linux without the rest of the file; `None` where it is another kind of file.
///
/// The program has dozens of its own, of megabytes each, and every command asks what they are.
///
/// # Errors
/// As [`inspect`].
pub(super) fn inspect_in_place(path: &Path) -> Result<Option<Manifest>, Refused> {
    let (mut file, len) = open(path)?;
    let mut magic = [0; ELF_MAGIC.len()];
    let starts = file.read_exact(&mut magic).is_ok() && magic == ELF_MAGIC;
    if !starts || len > MAX_FILE_LEN {
        return Ok(None);
    }
    let cache = ReadCache::new(file);
    inspect_library(&Library::of(&cache)?).map(Some)
}

/// The contents of a plugin file.
///
/// # Errors
/// Where the path leads to no regular file of acceptable length.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Refused> {
    let is_named_module = is_named_module(path);
    let most = if is_named_module { MAX_MODULE_LEN } else { MAX_FILE_LEN };
    files::read(path, most).map_err(|fault| refused(fault, is_named_module))
}

fn open(path: &Path) -> Result<(File, u64), Refused> {
    let (file, metadata) =
        files::open(path).map_err(|fault| refused(fault, is_named_module(path)))?;
    Ok((file, metadata.len()))
}

fn is_named_module(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("wasm"))
}

/// Why a file is refused that cannot be read.
fn refused(fault: OpenFault, is_named_module: bool) -> Refused {
    match fault {
        OpenFault::Io(error) if error.kind() == io::ErrorKind::NotFound => Refused::Missing,
        OpenFault::Io(error) => Refused::Unreadable(error),
        OpenFault::NotAFile { found: found @ "a folder" } => Refused::NotAFile { found },
        OpenFault::NotAFile { .. } => Refused::NotAFile { found: "no regular file" },
        OpenFault::TooLong { found, .. } if is_named_module => Refused::too_long(found),
        OpenFault::TooLong { found, .. } => Refused::TooLarge { found },
        OpenFault::Memory(out) => Refused::Unreadable(io::Error::other(out.to_string())),
    }
}

/// Reads the manifest out of the bytes of a library or a WebAssembly module.
///
/// # Errors
/// As [`inspect`].
pub fn inspect_bytes(bytes: &[u8]) -> Result<Manifest, Refused> {
    if bytes.is_empty() {
        return Err(Refused::Empty);
    }
    if is_module(bytes) {
        return inspect_module(bytes);
    }
    inspect_library(&Library::parse(bytes)?)
}

fn inspect_library<'a, R: ReadRef<'a>>(library: &Library<'a, R>) -> Result<Manifest, Refused> {
    library.check_machine()?;
    library.check_length()?;
    let [manifest, table, formats] =
        library.exports([manifest::SYMBOL, table::SYMBOL, format_table::SYMBOL])?;
    let address = manifest.ok_or(Refused::NoManifest)?;
    let Some(contents) = library.bytes_at(address, (HEADER_LEN + MAX_TEXT_LEN) as u64) else {
        return Err(malformed("it lies outside the file"));
    };
    let manifest = manifest::decode(contents).map_err(Refused::Manifest)?;
    check_names(&manifest)?;
    let Some(table) = table else {
        return Err(Refused::NoTable("does not export"));
    };
    if !library.holds(table, size_of::<PluginTable>() as u64) {
        return Err(Refused::NoTable("has no room for"));
    }
    // The address of a table is read where there is one, whether or not the manifest names formats.
    match formats {
        Some(formats) if !library.holds(formats, size_of::<FormatTable>() as u64) => {
            Err(Refused::NoFormats("has no room for"))
        }
        None if manifest.units.iter().any(|unit| unit.kind == UnitKind::Format) => {
            Err(Refused::NoFormats("does not export"))
        }
        _ => Ok(manifest),
    }
}

fn inspect_module(bytes: &[u8]) -> Result<Manifest, Refused> {
    let has_formats =
        |manifest: &Manifest| manifest.units.iter().any(|unit| unit.kind == UnitKind::Format);
    let contents = modules::read(bytes, |contents| {
        manifest::decode(contents).is_ok_and(|manifest| has_formats(&manifest))
    })?;
    let contents = &contents[..contents.len().min(HEADER_LEN + MAX_TEXT_LEN)];
    let manifest = manifest::decode(contents).map_err(Refused::Manifest)?;
    check_names(&manifest)?;
    Ok(manifest)
}

fn malformed(what: impl Into<String>) -> Refused {
    Refused::Manifest(Refusal::Malformed(what.into()))
}

/// Whether a text can be the id of a package: 1 to 128 ASCII letters, digits, `-`, `_` and `.`.
#[must_use]
pub fn is_package_id(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
    !text.is_empty() && text.len() <= MAX_NAME_LEN && text.bytes().all(allowed)
}

/// Longest id of a package or unit, in bytes.
const MAX_NAME_LEN: usize = 128;
/// Longest other text of a manifest, in bytes: a long sentence, or many authors.
const MAX_SHOWN_LEN: usize = 1024;
/// Most units of a library.
const MAX_UNITS: usize = 256;

/// Whether a character does not show, or changes how others are shown: what a person decides by must be
/// what is written.
#[must_use]
pub fn is_deceptive(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}')
        || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
        || matches!(c, '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// The start of a text, with what does not show written out.
fn shortened(text: &str) -> String {
    let escaped = |c: char| match is_deceptive(c) {
        true => c.escape_unicode().to_string(),
        false => c.to_string(),
    };
    text.chars().take(MAX_NAME_LEN).map(escaped).collect()
}

/// Whether a text can be the id of a unit.
fn is_unit_id(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    !text.is_empty() && text.len() <= MAX_NAME_LEN && text.bytes().all(allowed)
}

/// Refuses names that could not be typed or that would disturb a terminal.
fn check_names(manifest: &Manifest) -> Result<(), Refused> {
    if !is_package_id(&manifest.id) {
        let id = shortened(&manifest.id);
        return Err(malformed(format!("`{id}` is no package id such as org.example.mine")));
    }
    let shown = [&manifest.version, &manifest.authors, &manifest.license, &manifest.api];
    let units = manifest.units.iter().flat_map(|unit| [&unit.title, &unit.summary]);
    for text in shown.into_iter().chain(units) {
        if text.chars().any(is_deceptive) {
            let text = shortened(text);
            return Err(malformed(format!("its text \"{text}\" has characters that do not show")));
        }
        if text.len() > MAX_SHOWN_LEN {
            let found = text.len();
            return Err(malformed(format!(
                "a text of it has {found} bytes, at most {MAX_SHOWN_LEN} are shown"
            )));
        }
    }
    if manifest.units.len() > MAX_UNITS {
        let found = manifest.units.len();
        return Err(malformed(format!("it exports {found} units, at most {MAX_UNITS} are listed")));
    }
    for (i, unit) in manifest.units.iter().enumerate() {
        if !is_unit_id(&unit.id) {
            let id = shortened(&unit.id);
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
