//! Files of plugins' formats, read and written as the program does it, with the plugins of this build.

use crate::assert_one_line;
use crate::cloud::with_file;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use surfelshop_cloud::{Cloud, ReadError, ReadOptions, WriteOptions, inspect, read, write};
use surfelshop_pyramid::{NodeReader, Pyramid};
use surfelshop_runtime::formats::PluginFormats;
use surfelshop_runtime::plugins::{Origin, Place, Registry, SearchPath, Timeouts, Trust};

/// Names the folder of the libraries; without it they lie beside the folder of the program that runs.
const FOLDER: &str = "SURFELSHOP_FUZZ_PLUGINS";

/// The libraries that have formats.
const LIBRARIES: [&str; 9] =
    ["e57", "gaussian_splatting", "gltf", "las", "pcd", "potree", "sfl", "stl", "text"];

static FORMATS: LazyLock<PluginFormats> = LazyLock::new(|| {
    let places = LIBRARIES.iter().map(|name| {
        let file = format!("{DLL_PREFIX}surfelshop_{name}{DLL_SUFFIX}");
        let path = folder().join(file);
        assert!(path.is_file(), "{} is missing: `cargo verify` builds it", path.display());
        Place::new(path, Origin::CommandLine)
    });
    let (files, trust) = (places.collect(), Trust::everything());
    let registry = Registry::scan(&SearchPath { files, trust, ..SearchPath::default() });
    PluginFormats::new(Arc::new(registry), Timeouts::default())
});

fn folder() -> PathBuf {
    if let Some(folder) = std::env::var_os(FOLDER) {
        return folder.into();
    }
    let program = std::env::current_exe().unwrap_or_default();
    // Test programs lie in `deps`.
    program.parent().and_then(Path::parent).unwrap_or(Path::new("")).to_owned()
}

/// A format: what it is called, the ending of its files, and whether it writes them.
struct Target {
    id: &'static str,
    ending: &'static str,
    written: bool,
}

const fn target(id: &'static str, ending: &'static str, written: bool) -> Target {
    Target { id, ending, written }
}

const COMPRESSED_PLY: Target =
    target("org.surfelshop.gaussian-splatting/compressed-ply", "compressed.ply", true);
const E57: Target = target("org.surfelshop.e57/e57", "e57", true);
const GLTF: Target = target("org.surfelshop.gltf/gltf", "glb", false);
const LAS: Target = target("org.surfelshop.las/las", "laz", true);
const PCD: Target = target("org.surfelshop.pcd/pcd", "pcd", true);
const POTREE: Target = target("org.surfelshop.potree/potree", "metadata.json", false);
const PTS: Target = target("org.surfelshop.text/pts", "pts", true);
const PTX: Target = target("org.surfelshop.text/ptx", "ptx", true);
const SFL: Target = target("org.surfelshop.sfl/sfl", "sfl", true);
const SOG: Target = target("org.surfelshop.gaussian-splatting/sog", "sog", true);
const SPLAT: Target = target("org.surfelshop.gaussian-splatting/splat", "splat", true);
const SPZ: Target = target("org.surfelshop.gaussian-splatting/spz", "spz", true);
const STL: Target = target("org.surfelshop.stl/stl", "stl", false);
const XYZ: Target = target("org.surfelshop.text/xyz", "xyz", true);

/// A line about the file, and nothing that the format did wrong: the host says that in words of its own.
fn assert_of_file(line: &str) {
    assert_one_line(line);
    for fault in ["the format `", "broke the plugin interface", "did not answer", "panicked"] {
        assert!(!line.contains(fault), "{line}");
    }
}

/// Reads nodes with a format.
struct InPlace(&'static str);

impl NodeReader for InPlace {
    fn with_options(&self, read: &mut dyn FnMut(&ReadOptions<'_>)) {
        read(&ReadOptions { formats: &*FORMATS, format: Some(self.0), ..ReadOptions::default() });
    }
}

impl Target {
    fn options(&self) -> ReadOptions<'static> {
        ReadOptions { formats: &*FORMATS, format: Some(self.id), ..ReadOptions::default() }
    }

    /// Looks at a file and reads it. What is read can be written and read again, by the format itself where it
    /// writes.
    fn run(&self, bytes: &[u8]) {
        with_file(bytes, self.ending, |path| self.run_file(path));
    }

    fn run_file(&self, path: &Path) {
        let refused = |error: ReadError| assert_of_file(&error.fault.to_string());
        self.run_in_place(path);
        let looked = inspect(path, &self.options()).map_err(refused);
        let Ok(loaded) = read(path, &self.options()).map_err(refused) else { return };
        loaded.summary.warnings.iter().for_each(|line| assert!(!line.contains('\n'), "{line}"));
        assert!(looked.is_ok(), "it is read, and cannot be looked at");
        if self.written && !loaded.cloud.is_empty() {
            self.write_again(path, &loaded.cloud);
        }
    }

    /// Reads cells of a file whose points lie in an octree.
    fn run_in_place(&self, path: &Path) {
        let file = match Pyramid::in_place(path, Arc::new(InPlace(self.id))) {
            Ok(Some(file)) => file,
            Ok(None) => return,
            Err(error) => return assert_of_file(&error.to_string()),
        };
        for node in file.overview(1 << 16).into_iter().take(4) {
            if let Err(error) = file.read(node) {
                assert_of_file(&error.to_string());
            }
        }
    }

    fn write_again(&self, path: &Path, cloud: &Cloud) {
        let copy = path.with_file_name(format!("copy.{}", self.ending));
        let options = WriteOptions { formats: &*FORMATS, ..WriteOptions::default() };
        if let Err(error) = write(&copy, cloud, &options) {
            return assert_of_file(&error.to_string());
        }
        let again = read(&copy, &self.options());
        let again = again.unwrap_or_else(|error| panic!("what was written: {error}"));
        assert_eq!(again.cloud.len(), cloud.len(), "what was written");
    }
}

macro_rules! functions {
    ($($name:ident: $target:ident, $what:literal;)*) => {
        $(
            #[doc = concat!("Takes the bytes as a file of ", $what, ".")]
            ///
            /// # Panics
            /// Where it finds what must not be: that is a finding.
            pub fn $name(bytes: &[u8]) {
                $target.run(bytes);
            }
        )*
    };
}

/// Takes the bytes as a file of terrestrial scans, E57; and once more with the checksums that its pages should
/// have, since any change would else be found by them alone.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn e57(bytes: &[u8]) {
    E57.run(bytes);
    let repaired = with_checksums(bytes);
    if repaired != bytes {
        E57.run(&repaired);
    }
}

/// Between the files of a Potree octree that are one input.
const NEXT_FILE: &[u8] = b"\n-- next file --\n";

/// Takes the bytes as the three files of a Potree octree, with a line between them.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn potree(bytes: &[u8]) {
    let end = |bytes: &[u8]| bytes.windows(NEXT_FILE.len()).position(|line| line == NEXT_FILE);
    let part = |bytes: &[u8]| match end(bytes) {
        Some(end) => (bytes[..end].to_vec(), bytes[end + NEXT_FILE.len()..].to_vec()),
        None => (bytes.to_vec(), Vec::new()),
    };
    let (metadata, rest) = part(bytes);
    let (hierarchy, octree) = part(&rest);
    with_file(&metadata, POTREE.ending, |path| {
        for (name, bytes) in [("hierarchy.bin", hierarchy), ("octree.bin", octree)] {
            let written = std::fs::write(path.with_file_name(name), bytes);
            written.unwrap_or_else(|error| panic!("no file: {error}"));
        }
        POTREE.run_file(path);
    });
}

/// Bytes of a page and, behind it, of its checksum.
const PAYLOAD: usize = 1020;
const CHECKSUM: usize = 4;

/// The same with a right checksum behind every page.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for page in bytes.chunks_exact_mut(PAYLOAD + CHECKSUM) {
        let (payload, checksum) = page.split_at_mut(PAYLOAD);
        checksum.copy_from_slice(&crc32c(payload).to_be_bytes());
    }
    bytes
}

/// CRC-32C, bit by bit: inputs are small.
fn crc32c(bytes: &[u8]) -> u32 {
    crc(bytes, 0x82f6_3b78)
}

/// A checksum of a polynomial, whose lowest power is the highest bit.
fn crc(bytes: &[u8], polynomial: u32) -> u32 {
    let of_byte = |crc: u32, byte: &u8| {
        let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ polynomial } else { crc >> 1 };
        (0..8).fold(crc ^ u32::from(*byte), step)
    };
    !bytes.iter().fold(u32::MAX, of_byte)
}

/// Takes the bytes as a file of Gaussians in images, SOG; and once more with the checksums that its files should have.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn sog(bytes: &[u8]) {
    SOG.run(bytes);
    let repaired = with_checksums_of_archive(bytes);
    if repaired != bytes {
        SOG.run(&repaired);
    }
}

/// The same with a right checksum in each entry of a zip archive's table, of files that are stored.
fn with_checksums_of_archive(bytes: &[u8]) -> Vec<u8> {
    let mut repaired = bytes.to_vec();
    let number = |place: usize, n: usize| {
        let bytes = bytes.get(place..place + n)?;
        Some(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    };
    let entries = bytes.windows(4).enumerate().filter(|(_, magic)| magic == b"PK\x01\x02");
    for (entry, _) in entries {
        let facts = number(entry + 20, 4).zip(number(entry + 42, 4));
        let start = facts.and_then(|(len, start)| {
            let names = number(start + 26, 2)? + number(start + 28, 2)?;
            Some((start + 30 + names, len))
        });
        let contents = start.and_then(|(start, len)| bytes.get(start..start + len));
        if let (Some(contents), Some(place)) = (contents, repaired.get_mut(entry + 16..entry + 20))
        {
            place.copy_from_slice(&crc(contents, 0xedb8_8320).to_le_bytes());
        }
    }
    repaired
}

functions! {
    compressed_ply: COMPRESSED_PLY, "packed Gaussians, PLY";
    gltf: GLTF, "a scene, glTF";
    las: LAS, "airborne scans, LAS or LAZ";
    pcd: PCD, "the Point Cloud Library";
    pts: PTS, "lines of text behind their number";
    ptx: PTX, "scans as lines of text";
    sfl: SFL, "surfels of `Pointshop3D`";
    splat: SPLAT, "Gaussians in records";
    spz: SPZ, "packed Gaussians, SPZ";
    stl: STL, "triangles of solids, STL";
    xyz: XYZ, "lines of numbers";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksums_are_those_of_the_polynomial_of_castagnoli() {
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(crc(b"123456789", 0xedb8_8320), 0xcbf4_3926);
        let good = with_checksums(&[7; 2100]);
        assert_eq!(good[1020..1024], crc32c(&[7; 1020]).to_be_bytes());
        assert_eq!((&good[2048..], with_checksums(&good)), (&[7u8; 52][..], good.clone()));
    }
}
