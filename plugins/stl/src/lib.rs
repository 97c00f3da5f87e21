//! # `stl`: triangles of solids
//!
//! Reads binary and text files. The corners of triangles that have the same coordinates, bit by bit, become one
//! point; triangles keep their order and orientation. Normals of facets are not read, since every reader computes
//! them from the corners, nor the two bytes behind each binary triangle, in which some programs hide colours. All
//! solids of a text become one mesh.
//!
//! Text files begin with `solid`, but so do the titles of some binary ones. A file is binary where its length is
//! that of the triangles it announces; else it is text where it begins with `solid` and has no zero bytes near
//! its beginning.
//!
//! Positions are f32 of binary files and f64 of texts, in whatever unit the file was made: STL does not say, nor
//! which axis is up.
//!
//! Limits: at most 2^32 - 1 different corners. Corners that differ in their last digit are not put together.
//!
//! Source: 3D Systems 1988, "Stereolithography Interface Specification".

mod binary;
mod mesh;
#[cfg(test)]
mod tests;
mod text;

use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, FileSource, FileTypes};
use surfelshop_api::prelude::{HostInfo, Job, Result, UnitInfo, export_plugin};

/// Bytes of a file's beginning that tell a text.
const HEAD: u64 = 1024;

/// The format.
struct Stl;

impl Format for Stl {
    const INFO: UnitInfo = UnitInfo::new("stl", "STL", "Reads triangles of solids (.stl).");
    // Binary files begin with any title.
    const FILES: FileTypes = FileTypes::new().ending("stl");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        (): &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let head = file.bytes_at(0, file.length().min(HEAD))?;
        if is_text(&head) && !binary::has_its_length(file)? {
            text::read(file, &head, clouds, job)
        } else {
            binary::read(file, clouds, job)
        }
    }
}

/// Whether a file that begins like this can be a text.
fn is_text(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    let word = head.get(..5).unwrap_or_default();
    word.eq_ignore_ascii_case(b"solid") && !head.contains(&0)
}

export_plugin! {
    id: "org.surfelshop.stl",
    formats: [Stl],
}
