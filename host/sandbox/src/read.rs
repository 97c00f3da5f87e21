//! What a module says of itself: its sections, looked through without running or compiling it.

use crate::stop::one_line;
use surfelshop_api::abi::{format_table, table};
use wasmparser::{Encoding, ExternalKind, Parser, Payload, TypeRef};

/// Modules longer than this are refused unread. The largest of this project's have 2 MB.
pub const MAX_MODULE_LEN: u64 = 32 << 20;

/// The custom section that holds the manifest.
const MANIFEST: &str = "surfelshop.manifest";
/// The name that linkers export the function table by.
pub(crate) const FUNCTIONS: &str = "__indirect_function_table";
/// The name that linkers export the memory by.
pub(crate) const MEMORY: &str = "memory";

/// Why a module is no plugin; reads on from the file's name: `x.wasm imports …`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// It is longer than [`MAX_MODULE_LEN`].
    #[error("is a WebAssembly module of {0} bytes, at most {MAX_MODULE_LEN} are accepted")]
    TooLong(u64),
    /// Its sections contradict each other, or it ends before they do.
    #[error("is a WebAssembly module that is damaged or cut off: {0}; build or copy it again")]
    Damaged(String),
    /// It is no core module.
    #[error(
        "is a WebAssembly component, expected a core module: build it for wasm32-unknown-unknown"
    )]
    Component,
    /// It has no manifest.
    #[error(
        "is a WebAssembly module but no Surfelshop plugin: it has no section `{MANIFEST}` \
         (a plugin calls export_plugin!)"
    )]
    NoManifest,
    /// It has several manifests, of which readers may take different ones.
    #[error("has {0} sections `{MANIFEST}`, expected one")]
    Manifests(usize),
    /// It needs something of a host.
    #[error(
        "imports `{module}.{name}`, and a sandboxed plugin imports nothing: build it for \
         wasm32-unknown-unknown, without a system's libraries"
    )]
    Imports {
        /// What it is imported from.
        module: String,
        /// What is imported.
        name: String,
    },
    /// It does not export what is needed.
    #[error("does not export `{0}`{1}")]
    Lacks(&'static str, &'static str),
}

/// What is to be done where an export is missing.
fn advice(name: &str) -> &'static str {
    match name {
        FUNCTIONS => ": link it with --export-table and --growable-table",
        _ => "; build it again with export_plugin!",
    }
}

/// Whether a file is a WebAssembly module or component, by its first bytes.
#[must_use]
pub fn is_module(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\0asm")
}

/// The bytes of a module's manifest; `formats` says of them whether the module has to export the functions of
/// formats. Functions of the module are not looked at: whether they are sound is found when it is compiled.
///
/// # Errors
/// Where it is no whole module that exports what a plugin does and imports nothing.
pub fn read(bytes: &[u8], formats: impl FnOnce(&[u8]) -> bool) -> Result<&[u8], Unfit> {
    if bytes.len() as u64 > MAX_MODULE_LEN {
        return Err(Unfit::TooLong(bytes.len() as u64));
    }
    // Some of its messages show bytes, a line each.
    let damaged = |error: wasmparser::BinaryReaderError| Unfit::Damaged(one_line(error.message()));
    let mut manifests = Vec::new();
    let mut exports = Vec::new();
    for payload in Parser::new(0).parse_all(bytes) {
        match payload.map_err(damaged)? {
            Payload::Version { encoding: Encoding::Component, .. } => return Err(Unfit::Component),
            Payload::CustomSection(section) if section.name() == MANIFEST => {
                manifests.push(section.data());
            }
            Payload::ImportSection(imports) => {
                if let Some(import) = imports.into_iter().next() {
                    let import = import.map_err(damaged)?;
                    return Err(Unfit::Imports {
                        module: shown(import.module),
                        name: shown(&format!("{}{}", import.name, kind(import.ty))),
                    });
                }
            }
            Payload::ExportSection(section) => {
                for export in section {
                    let export = export.map_err(damaged)?;
                    exports.push((export.name, export.kind));
                }
            }
            _ => {}
        }
    }
    let manifest = match manifests[..] {
        [] => return Err(Unfit::NoManifest),
        [manifest] => manifest,
        _ => return Err(Unfit::Manifests(manifests.len())),
    };
    let mut needed = vec![
        (MEMORY, ExternalKind::Memory),
        (FUNCTIONS, ExternalKind::Table),
        (table::SYMBOL, ExternalKind::Global),
    ];
    if formats(manifest) {
        needed.push((format_table::SYMBOL, ExternalKind::Global));
    }
    match needed.into_iter().find(|needed| !exports.contains(needed)) {
        Some((name, _)) => Err(Unfit::Lacks(name, advice(name))),
        None => Ok(manifest),
    }
}

/// What an import is, where it is no function.
fn kind(ty: TypeRef) -> &'static str {
    match ty {
        TypeRef::Func(_) => "",
        TypeRef::Table(_) => " (a table)",
        TypeRef::Memory(_) => " (a memory)",
        TypeRef::Global(_) => " (a global)",
        TypeRef::Tag(_) => " (a tag)",
    }
}

/// A name of a module as it may be shown: short, and of characters that show.
fn shown(name: &str) -> String {
    name.chars().take(64).map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}
