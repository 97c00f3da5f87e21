//! The file of a packed plugin: a tar archive of few files of known names, each with its SHA-256.
//!
//! Invariants: nothing of an archive is ever unpacked by a path that it names; what is none of the known files, comes
//! twice, is too long, or is not what its sum says, is refused.

use anyhow::{Context as _, anyhow, bail, ensure};
use sha2::{Digest as _, Sha256};
use std::io::Read as _;
use std::path::Path;
use surfelshop_runtime::plugins::is_module;
use surfelshop_session::output::files;
use surfelshop_session::plugin_facts::PREVIEW;

/// What such a file's name ends in.
pub(crate) const ENDING: &str = "surfelplug";

/// Most bytes of a module, which is what the sandbox takes.
const MAX_MODULE: u64 = 32 << 20;
/// Most bytes of a text or a preview.
const MAX_OTHER: u64 = 4 << 20;
/// Most bytes of the whole.
const MAX_ARCHIVE: u64 = MAX_MODULE + 4 * MAX_OTHER;

const README: &str = "README.md";
const LICENCE: &str = "LICENSE";
/// As `sha256sum --check` reads it.
const SUMS: &str = "SHA256SUMS";

/// A packed plugin.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Packed {
    /// The name of the module's file, which ends in `.wasm`.
    pub(crate) name: String,
    pub(crate) module: Vec<u8>,
    pub(crate) readme: Vec<u8>,
    pub(crate) licence: Vec<u8>,
    /// A PNG; empty where there is none.
    pub(crate) preview: Vec<u8>,
}

/// Whether a path names a packed plugin.
pub(crate) fn is_pack(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

impl Packed {
    fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        let all: [(&str, &[u8]); 4] = [
            (&self.name, &self.module),
            (README, &self.readme),
            (LICENCE, &self.licence),
            (PREVIEW, &self.preview),
        ];
        all.into_iter().filter(|(name, bytes)| *name != PREVIEW || !bytes.is_empty())
    }

    /// What it was packed with, by file name.
    pub(crate) fn texts(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files().filter(|(name, _)| *name != self.name)
    }

    /// The archive, the same bytes for the same files.
    pub(crate) fn to_bytes(&self) -> anyhow::Result<Vec<u8>> {
        let sums: String =
            self.files().map(|(name, bytes)| format!("{}  {name}\n", sum_of(bytes))).collect();
        let mut archive = tar::Builder::new(Vec::new());
        for (name, bytes) in self.files().chain([(SUMS, sums.as_bytes())]) {
            let mut header = tar::Header::new_ustar();
            header.set_size(bytes.len() as u64);
            header.set_mode(0o644);
            header.set_mtime(0);
            archive.append_data(&mut header, name, bytes)?;
        }
        Ok(archive.into_inner()?)
    }

    /// Reads a packed plugin.
    ///
    /// # Errors
    /// One line where it is none, or damaged.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        let bytes = files::read_short(path, MAX_ARCHIVE)?;
        Self::of(&bytes).with_context(|| format!("{}: expected a packed plugin", path.display()))
    }

    fn of(bytes: &[u8]) -> anyhow::Result<Self> {
        let mut found: Vec<(String, Vec<u8>)> = Vec::new();
        let mut archive = tar::Archive::new(bytes);
        for entry in archive.entries().map_err(|error| damaged(&error))? {
            let mut entry = entry.map_err(|error| damaged(&error))?;
            let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
            let is_known = [README, LICENCE, PREVIEW, SUMS].contains(&name.as_str());
            let shown = name.escape_debug();
            ensure!(
                entry.header().entry_type().is_file() && (is_known || is_module_name(&name)),
                "found `{shown}` in it, and a pack holds a module, {README}, {LICENCE}, {PREVIEW} and {SUMS}"
            );
            ensure!(!found.iter().any(|(other, _)| *other == name), "found `{shown}` in it twice");
            let most = if is_known { MAX_OTHER } else { MAX_MODULE };
            let size = entry.size();
            ensure!(size <= most, "found {size} bytes of `{shown}`, at most {most} are taken");
            // No longer than the archive, which is in memory.
            let mut contents = Vec::new();
            contents.try_reserve_exact(usize::try_from(size)?.min(bytes.len()))?;
            entry.read_to_end(&mut contents).map_err(|error| damaged(&error))?;
            found.push((name, contents));
        }
        let mut take = |wanted: &dyn Fn(&str) -> bool| {
            let at = found.iter().position(|(name, _)| wanted(name))?;
            Some(found.swap_remove(at))
        };
        let mut named = |wanted: &str| take(&|name| name == wanted).map(|(_, contents)| contents);
        let sums = named(SUMS).ok_or_else(|| anyhow!("found no {SUMS} in it"))?;
        let readme = named(README).ok_or_else(|| anyhow!("found no {README} in it"))?;
        let licence = named(LICENCE).ok_or_else(|| anyhow!("found no {LICENCE} in it"))?;
        let preview = named(PREVIEW).unwrap_or_default();
        let Some((name, module)) = take(&is_module_name) else { bail!("found no module in it") };
        ensure!(found.is_empty(), "found two modules in it");
        let packed = Self { name, module, readme, licence, preview };
        let sums = String::from_utf8_lossy(&sums).into_owned();
        for (name, contents) in packed.files() {
            let sum = format!("{}  {name}", sum_of(contents));
            ensure!(
                sums.lines().any(|line| line == sum),
                "found a `{}` that is not what {SUMS} says: the file is damaged or was changed",
                name.escape_debug()
            );
        }
        ensure!(
            is_module(&packed.module),
            "found a `{}` that is no WebAssembly module",
            packed.name.escape_debug()
        );
        ensure!(
            packed.preview.is_empty() || packed.preview.starts_with(b"\x89PNG\r\n\x1a\n"),
            "found a {PREVIEW} that is no PNG"
        );
        Ok(packed)
    }
}

/// The SHA-256 of bytes in hexadecimal digits.
fn sum_of(bytes: &[u8]) -> String {
    let digit = |half: u8| char::from_digit(u32::from(half), 16).unwrap_or_default();
    let digits = |byte: &u8| [digit(byte >> 4), digit(byte & 15)];
    Sha256::digest(bytes).iter().flat_map(digits).collect()
}

/// A plain file name of a module: it is what the file is called in the folder of plugins.
fn is_module_name(name: &str) -> bool {
    let stem = name.strip_suffix(".wasm").unwrap_or_default();
    let plain = stem.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'));
    plain && (1..=64).contains(&stem.len())
}

fn damaged(error: &std::io::Error) -> anyhow::Error {
    let line = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    anyhow!("found a damaged archive: {line}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed() -> Packed {
        Packed {
            name: "rim.wasm".to_owned(),
            module: b"\0asm\x01\0\0\0".to_vec(),
            readme: b"# Rim\n".to_vec(),
            licence: b"MIT\n".to_vec(),
            preview: b"\x89PNG\r\n\x1a\n and more".to_vec(),
        }
    }

    #[test]
    fn what_is_packed_is_read_back() {
        let bytes = packed().to_bytes().unwrap();
        assert_eq!(bytes, packed().to_bytes().unwrap(), "the same bytes again");
        assert_eq!(Packed::of(&bytes).unwrap(), packed());
        let plain = Packed { preview: Vec::new(), ..packed() };
        assert_eq!(Packed::of(&plain.to_bytes().unwrap()).unwrap(), plain);
    }

    /// Invariant: a damaged pack is refused in a line, wherever the damage is, or read as it was
    #[test]
    fn damage_is_told_in_a_line() {
        let good = packed().to_bytes().unwrap();
        let line = |bytes: &[u8]| format!("{:#}", Packed::of(bytes).unwrap_err());
        for at in (0..good.len()).step_by(7) {
            let mut bytes = good.clone();
            bytes[at] ^= 0x41;
            match Packed::of(&bytes) {
                Ok(found) => assert_eq!(found, packed(), "byte {at}"),
                Err(error) => assert!(!format!("{error:#}").contains('\n'), "{error:#}"),
            }
            assert!(!line(&good[..at.min(3000)]).contains('\n'));
        }
        assert!(line(b"no archive").contains("found"));
    }

    /// Invariant: names that lead elsewhere, links and strange files are refused
    #[test]
    fn only_the_known_files_are_taken() {
        let with = |name: &str, kind: tar::EntryType| {
            let mut archive = tar::Builder::new(Vec::new());
            let mut header = tar::Header::new_ustar();
            header.set_size(4);
            header.set_entry_type(kind);
            let field = &mut header.as_old_mut().name;
            field[..name.len()].copy_from_slice(name.as_bytes());
            header.set_cksum();
            archive.append(&header, &b"evil"[..]).unwrap();
            let bytes = archive.into_inner().unwrap();
            format!("{:#}", Packed::of(&bytes).unwrap_err())
        };
        for name in ["../evil.wasm", "/etc/evil.wasm", "a/b.wasm", ".wasm", "other.txt"] {
            let line = with(name, tar::EntryType::Regular);
            assert!(line.contains("a pack holds a module"), "{name}: {line}");
        }
        assert!(with("rim.wasm", tar::EntryType::Symlink).contains("a pack holds a module"));
        assert!(with("rim.wasm", tar::EntryType::Regular).contains("found no SHA256SUMS"));
    }
}
