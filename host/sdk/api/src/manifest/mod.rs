//! The pointer-free description of a plugin, read from the file before it is loaded.
//!
//! The exported symbol [`SYMBOL`] is a byte array: 16 bytes magic, ABI major and minor (u16, little
//! endian), length of the text (u32, little endian), then lines `key TAB value...`. It holds no
//! pointers, so it can be read without relocating or running anything.

mod writer;

use crate::columns::role_of;
use crate::format::file_types::{HEAD_LEN, MAX_ENDING_LEN, Magic, Recognition};
use crate::need::Need;
use crate::unit_info::{UnitInfo, UnitKind};
use serde::Serialize;
use writer::{Writer, files_len, handling_len, line_len, needs_len};

/// Name of the exported byte array.
pub const SYMBOL: &str = "SURFELSHOP_MANIFEST";
/// First bytes of a manifest.
pub const MAGIC: [u8; 16] = *b"SURFELSHOP-PLUG\n";
/// Plugins with another major version are refused.
pub const ABI_MAJOR: u16 = 3;
/// Plugins with a larger minor version are refused: they may need what this host lacks.
///
/// 1: scenes may have lights with a place ([`Light::Point`](crate::Light), `Spot`), and the WGSL
/// module `surfelshop::light` says what of them arrives where. Plugins of 3.0 work in scenes without
/// such lights.
///
/// 2: units say what they cannot do ([`Limit`](crate::Limit)); those of 3.0 and 3.1 say nothing.
///
/// 3: passes say which features of their shaders are there
/// ([`Pass::feature`](crate::graph::Pass::feature)); those of older plugins have none;
/// and limits have a bound.
///
/// 4: passes may read normals that vary over surfels
/// ([`SurfaceMode::Fields`](crate::graph::SurfaceMode)).
///
/// 5: graphs have cameras of their own ([`Graph::camera`](crate::Graph::camera)), read the scene's
/// surfels as data ([`Graph::surfels`](crate::Graph::surfels)), and keep buffers from frame to frame
/// ([`Lifetime::History`](crate::graph::Lifetime)).
///
/// 6: renderers are told how much of the scene is drawn while something moves
/// ([`Graph::stride`](crate::Graph::stride)).
///
/// 7: uniforms may be given by name ([`Graph::parameters`](crate::Graph::parameters),
/// [`Graph::members`](crate::Graph::members)).
///
/// 8: plugins read and write files ([`Format`](crate::Format)); the table of their functions is a symbol of its
/// own.
///
/// 9: columns have roles ([`Role`](crate::columns::Role)), units say what they need of a cloud
/// ([`Need`]), graphs read columns ([`Graph::columns`](crate::Graph::columns)) and draw splats of their own
/// ([`Pass::splats`](crate::graph::Pass::splats)).
///
/// 10: splats are told pixel by pixel ([`Pass::per_pixel`](crate::graph::Pass::per_pixel)), are averaged within a
/// tolerance ([`Composition::Normalized`](crate::graph::Composition)) and say how far they lie apart
/// ([`SplatDepth::Distortion`](crate::graph::SplatDepth)); graphs sort and sum up
/// ([`Pass::sort`](crate::graph::Pass::sort), [`Pass::scan`](crate::graph::Pass::scan)), run as many invocations as a
/// buffer says ([`Groups::Counted`](crate::graph::Groups)), say what they need of a device
/// ([`Pass::needs`](crate::graph::Pass::needs)) and send bytes that stay once
/// ([`Graph::resident`](crate::Graph::resident)); hosts say how much a device takes
/// ([`DeviceLimits`](crate::DeviceLimits)); uniforms bring the WGSL module that declares them
/// ([`Graph::settings`](crate::Graph::settings)); packages name the oldest minor version that will do (`minor` of
/// [`export_plugin!`](crate::export_plugin)); renderers that draw some clouds beside others say how their colours go over
/// these ([`Graph::blend_encoded`](crate::Graph::blend_encoded)); and shaders are told where the picture is seen in each
/// pixel (`shift_px` of `surfelshop::view`).
///
/// 11: tools are handled ([`Tool::HANDLING`](crate::Tool)): they get the surfels along a stroke with their weights
/// ([`Job::stroke`](crate::Job::stroke)), and answer with values of some surfels or new ones
/// ([`Edit::Values`](crate::Edit), `Add`).
pub const ABI_MINOR: u16 = 11;
/// Bytes before the text.
pub const HEADER_LEN: usize = 24;
/// Longest text a reader accepts, in bytes.
pub const MAX_TEXT_LEN: usize = 1 << 20;

/// What a plugin package says of itself at compile time.
#[derive(Clone, Copy, Debug)]
pub struct PackageInfo {
    /// Reverse-DNS id, such as `org.example.mine`.
    pub id: &'static str,
    /// Version of the package.
    pub version: &'static str,
    /// Authors, separated by colons; may be empty.
    pub authors: &'static str,
    /// Licence expression; may be empty.
    pub license: &'static str,
    /// ABI the plugin speaks: major and minor.
    pub abi: (u16, u16),
}

/// The oldest minor version that a package says will do: the one number that is given, else the crate's own.
///
/// # Panics
/// At compile time, where it is newer than the crate, or older than what the units are.
#[doc(hidden)]
#[must_use]
pub const fn least_minor(said: &[u16], units: &[(UnitKind, UnitInfo)]) -> u16 {
    let minor = if said.is_empty() { ABI_MINOR } else { said[0] };
    assert!(
        minor <= ABI_MINOR,
        "`minor` is newer than this surfelshop-api: build with a newer one"
    );
    let mut i = 0;
    while i < units.len() {
        let (kind, info) = units[i];
        assert!(
            minor >= 8 || !matches!(kind, UnitKind::Format),
            "formats came with ABI 3.8: `minor` is too low"
        );
        assert!(minor >= 9 || info.needs.is_empty(), "NEEDS came with ABI 3.9: `minor` is too low");
        assert!(
            minor >= 11 || info.handling.is_empty(),
            "HANDLING came with ABI 3.11: `minor` is too low"
        );
        i += 1;
    }
    minor
}

const fn text_len(package: &PackageInfo, units: &[(UnitKind, UnitInfo)]) -> usize {
    let mut len = line_len("id", &[package.id])
        + line_len("version", &[package.version])
        + line_len("authors", &[package.authors])
        + line_len("license", &[package.license])
        + line_len("api", &[env!("CARGO_PKG_VERSION")]);
    let mut i = 0;
    while i < units.len() {
        let (kind, info) = units[i];
        len += line_len(kind.word(), &[info.id, info.title, info.summary])
            + files_len(&info.files)
            + needs_len(info.needs)
            + handling_len(info.handling);
        i += 1;
    }
    len
}

/// Length of the manifest of a package, for use with [`encode`].
#[must_use]
pub const fn encoded_len(package: &PackageInfo, units: &[(UnitKind, UnitInfo)]) -> usize {
    HEADER_LEN + text_len(package, units)
}

/// Encodes a manifest at compile time; `N` is [`encoded_len`].
///
/// # Panics
/// At compile time, where a text holds control characters.
#[must_use]
pub const fn encode<const N: usize>(
    package: &PackageInfo,
    units: &[(UnitKind, UnitInfo)],
) -> [u8; N] {
    let mut out = Writer::<N>::new()
        .raw(&MAGIC)
        .raw(&package.abi.0.to_le_bytes())
        .raw(&package.abi.1.to_le_bytes())
        .raw(&(text_len(package, units) as u32).to_le_bytes())
        .line("id", &[package.id])
        .line("version", &[package.version])
        .line("authors", &[package.authors])
        .line("license", &[package.license])
        .line("api", &[env!("CARGO_PKG_VERSION")]);
    let mut i = 0;
    while i < units.len() {
        let (kind, info) = units[i];
        out = out
            .line(kind.word(), &[info.id, info.title, info.summary])
            .files(&info.files)
            .needs(info.needs);
        if !info.handling.is_empty() {
            out = out.line("handling", &[info.handling]);
        }
        i += 1;
    }
    out.bytes
}

/// A unit as a manifest names it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct UnitEntry {
    /// What the unit is.
    pub kind: UnitKind,
    /// Short id.
    pub id: String,
    /// Title in lists.
    pub title: String,
    /// One sentence.
    pub summary: String,
    /// Files that a format recognises; empty of other units.
    #[serde(skip_serializing_if = "is_empty")]
    pub files: Recognition,
    /// The columns that a renderer cannot do without; empty of other units.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<Need>,
    /// How a tool is handled: `stroke` or `click`; empty where it is not, and of other units. ABI 3.11.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub handling: String,
}

fn is_empty(files: &Recognition) -> bool {
    *files == Recognition::default()
}

/// A manifest as read from a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Manifest {
    /// ABI major version the plugin speaks.
    pub abi_major: u16,
    /// ABI minor version the plugin speaks.
    pub abi_minor: u16,
    /// Reverse-DNS id of the package.
    pub id: String,
    /// Version of the package.
    pub version: String,
    /// Authors, separated by colons; may be empty.
    pub authors: String,
    /// Licence expression; may be empty.
    pub license: String,
    /// Version of the API crate it was built with.
    pub api: String,
    /// The exported units.
    pub units: Vec<UnitEntry>,
}

/// Why a manifest was refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The bytes are no manifest; says what was expected and found.
    Malformed(String),
    /// The plugin speaks another ABI than this host.
    Incompatible {
        /// Major and minor version the plugin speaks.
        plugin: (u16, u16),
        /// Major and minor version this host speaks.
        host: (u16, u16),
    },
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Malformed(what) => write!(f, "the plugin manifest is damaged: {what}"),
            Self::Incompatible { plugin, host } => {
                let advice = if plugin.0 < host.0 {
                    "rebuild the plugin with the current surfelshop-api"
                } else {
                    "update Surfelshop"
                };
                write!(
                    f,
                    "the plugin speaks ABI {}.{}, this host speaks {}.{}: {advice}",
                    plugin.0, plugin.1, host.0, host.1
                )
            }
        }
    }
}

/// Reads a manifest; trailing bytes are ignored.
///
/// # Errors
/// Where the bytes are no manifest or speak an ABI this host does not: the major version must be
/// equal, the minor version not newer.
pub fn decode(bytes: &[u8]) -> Result<Manifest, Refusal> {
    let malformed = |what: String| Err(Refusal::Malformed(what));
    let Some(header) = bytes.get(..HEADER_LEN) else {
        return malformed(format!("expected at least {HEADER_LEN} bytes, found {}", bytes.len()));
    };
    if header[..16] != MAGIC {
        return malformed("the magic bytes are wrong".to_owned());
    }
    let plugin = (
        u16::from_le_bytes([header[16], header[17]]),
        u16::from_le_bytes([header[18], header[19]]),
    );
    let host = (ABI_MAJOR, ABI_MINOR);
    if plugin.0 != host.0 || plugin.1 > host.1 {
        return Err(Refusal::Incompatible { plugin, host });
    }
    let len = u32::from_le_bytes([header[20], header[21], header[22], header[23]]) as usize;
    if len > MAX_TEXT_LEN {
        return malformed(format!("its text has {len} bytes, at most {MAX_TEXT_LEN} are allowed"));
    }
    let Some(text) = bytes.get(HEADER_LEN..HEADER_LEN + len) else {
        return malformed(format!(
            "its text should have {len} bytes, found {}",
            bytes.len() - HEADER_LEN
        ));
    };
    let Ok(text) = std::str::from_utf8(text) else {
        return malformed("its text is not UTF-8".to_owned());
    };
    let mut manifest = Manifest { abi_major: plugin.0, abi_minor: plugin.1, ..Manifest::default() };
    for line in text.lines() {
        read_line(&mut manifest, line);
    }
    if manifest.id.is_empty() {
        return malformed("it names no package id".to_owned());
    }
    if manifest.units.is_empty() {
        return malformed("it exports no renderer, tracer, tool or format".to_owned());
    }
    Ok(manifest)
}

/// Reads one line; keys of newer minor versions are ignored.
fn read_line(manifest: &mut Manifest, line: &str) {
    let mut fields = line.split('\t');
    let key = fields.next().unwrap_or_default();
    let mut next = || fields.next().unwrap_or_default().to_owned();
    let kind = match key {
        "id" => return manifest.id = next(),
        "version" => return manifest.version = next(),
        "authors" => return manifest.authors = next(),
        "license" => return manifest.license = next(),
        "api" => return manifest.api = next(),
        "renderer" => UnitKind::Renderer,
        "tracer" => UnitKind::Tracer,
        "tool" => UnitKind::Tool,
        "format" => UnitKind::Format,
        "need" => {
            let renderer = manifest.units.last_mut().filter(|unit| unit.kind == UnitKind::Renderer);
            return renderer.map_or((), |renderer| need_line(&mut renderer.needs, next));
        }
        "handling" => {
            let tool = manifest.units.last_mut().filter(|unit| unit.kind == UnitKind::Tool);
            return tool.map_or((), |tool| tool.handling = next());
        }
        "ending" | "magic" | "written" | "several" | "grid" | "beside" => {
            let format = manifest.units.last_mut().filter(|unit| unit.kind == UnitKind::Format);
            return format.map_or((), |format| files_line(&mut format.files, key, next));
        }
        _ => return,
    };
    let (id, title, summary) = (next(), next(), next());
    let (files, needs, handling) = Default::default();
    manifest.units.push(UnitEntry { kind, id, title, summary, files, needs, handling });
}

/// Reads one column that a renderer cannot do without; what is damaged is needed by nobody.
fn need_line(needs: &mut Vec<Need>, mut next: impl FnMut() -> String) {
    let (column, components) = (next(), next().parse::<u32>());
    if let Ok(components) = components
        && !column.is_empty()
        && needs.len() < MOST_FILES
    {
        let role = role_of(&column);
        needs.push(Need { column, components, role, required: true });
    }
}

/// Most endings, and most first bytes, that are read of a format.
const MOST_FILES: usize = 64;

/// Reads one line of a format's files; what is damaged recognises nothing.
fn files_line(files: &mut Recognition, key: &str, mut next: impl FnMut() -> String) {
    match key {
        "ending" if files.endings.len() < MOST_FILES => {
            let ending = next().to_ascii_lowercase();
            let typed = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
            if !ending.is_empty() && ending.len() <= MAX_ENDING_LEN && ending.bytes().all(typed) {
                files.endings.push(ending);
            }
        }
        "magic" if files.magics.len() < MOST_FILES => {
            let (offset, digits) = (next().parse::<u32>(), next());
            let pairs = digits.as_bytes().chunks_exact(2);
            let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
            let bytes: Option<Vec<u8>> = pairs.map(byte).collect();
            if let (Ok(offset), Some(bytes)) = (offset, bytes) {
                if !bytes.is_empty() && offset as usize + bytes.len() <= HEAD_LEN {
                    files.magics.push(Magic { offset, bytes });
                }
            }
        }
        "written" => files.written = true,
        "several" => files.several = true,
        "grid" => files.grid = true,
        "beside" if files.beside.len() < MOST_FILES => {
            let name = next().to_ascii_lowercase();
            let typed = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
            let letters = match name.strip_prefix('*') {
                Some(end) if end.len() > 1 && end.starts_with('.') => end,
                Some(_) => "",
                None => &name,
            };
            if !letters.is_empty() && letters.len() <= 64 && letters.bytes().all(typed) {
                files.beside.push(name);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests;
