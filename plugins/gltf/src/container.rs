//! The JSON of a file, and where its binary chunk lies.

use crate::extensions;
use crate::names::AllNames;
use gltf::json::Root;
use std::ops::Range;
use surfelshop_api::format::FileSource;
use surfelshop_api::prelude::{Error, Result};

/// Most bytes of JSON that are read.
const MAX_JSON: u64 = 1 << 30;

/// Bytes before the first chunk, and before the contents of each.
const HEADER: u64 = 12;
const CHUNK_HEADER: u64 = 8;

/// What a file consists of.
pub(crate) struct Container {
    pub root: Root,
    pub names: AllNames,
    /// The binary chunk, in bytes of the file.
    pub binary: Option<Range<u64>>,
    pub is_glb: bool,
}

/// Finds the parts of a file.
///
/// # Errors
/// Where it is none of glTF 2, or cut short.
pub(crate) fn open(file: &FileSource) -> Result<Container> {
    let mut magic = [0; 4];
    let is_glb = file.read_at(0, &mut magic)? == 4 && magic == *b"glTF";
    let (json, binary) = if is_glb { chunks(file)? } else { (0..file.length(), None) };
    let len = json.end - json.start;
    if len > MAX_JSON {
        return Err(Error::new(format!("expected at most {MAX_JSON} bytes of JSON, found {len}")));
    }
    let text = file.bytes_at(json.start, len)?;
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let root: Root = gltf::json::deserialize::from_slice(text)
        .map_err(|error| Error::new(format!("expected glTF 2 as JSON: {error}")))?;
    let version = &root.asset.version;
    if !version.starts_with("2.") && version != "2" {
        let version: String = version.chars().take(20).collect();
        return Err(Error::new(format!(
            "expected glTF 2, found version {}",
            version.escape_debug()
        )));
    }
    let names = AllNames::of(text, extensions::SPLATS)?;
    Ok(Container { root, names, binary, is_glb })
}

fn words(file: &FileSource, place: u64) -> Result<[u32; 2]> {
    let mut bytes = [0; 8];
    file.read_exact_at(place, &mut bytes)?;
    let [a, b, c, d, e, f, g, h] = bytes;
    Ok([u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])])
}

/// Where the JSON and the binary chunk of a .glb lie.
fn chunks(file: &FileSource) -> Result<(Range<u64>, Option<Range<u64>>)> {
    let [version, length] = words(file, 4)?;
    if version != 2 {
        return Err(Error::new(format!("expected binary glTF 2, found version {version}")));
    }
    let end = u64::from(length);
    if end > file.length() {
        let found = file.length();
        return Err(Error::new(format!(
            "expected {end} bytes, found {found}: the file is cut short"
        )));
    }
    let (mut place, mut json, mut binary) = (HEADER, None, None);
    while place + CHUNK_HEADER <= end {
        let [length, kind] = words(file, place)?;
        let contents = place + CHUNK_HEADER..place + CHUNK_HEADER + u64::from(length);
        if contents.end > end {
            let left = end - contents.start;
            return Err(Error::new(format!(
                "expected a chunk of {length} bytes, found {left}: the file is cut short"
            )));
        }
        // Chunks are padded to whole words.
        place = contents.end.next_multiple_of(4);
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(contents),
            b"BIN\0" if binary.is_none() => binary = Some(contents),
            _ => {}
        }
    }
    let json = json.ok_or_else(|| Error::new("expected a chunk of JSON, found none"))?;
    Ok((json, binary))
}
