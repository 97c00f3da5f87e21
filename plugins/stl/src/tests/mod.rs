//! Tests through `Format`, with files in memory.

mod damage;
mod reading;

use crate::Stl;
use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, Collected, FileSource};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::{Error, HostInfo, Job, Result};
use surfelshop_api::tool::EditHeader;

/// A host whose loops run one after the other.
struct SerialHost;

impl JobHost for SerialHost {
    fn progress(&self, fraction: f64, _message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("formats stage nothing"))
    }
}

fn read(bytes: &[u8]) -> Result<Collected> {
    let mut found = Collected::default();
    Stl::new(&HostInfo::default())?.read(
        &FileSource::of_bytes(bytes.to_vec(), "a.stl"),
        &(),
        &mut CloudSink::new(&mut found, None),
        &Job::new(&SerialHost),
    )?;
    Ok(found)
}

/// The line that a file is refused with.
fn refusal(bytes: &[u8]) -> String {
    let line = read(bytes).map(|found| found.warnings.len()).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

/// The twelve triangles of a cube from 0 to 1, counterclockwise from outside.
fn cube() -> Vec<[[f32; 3]; 3]> {
    let corner = |i: u32| [0, 1, 2].map(|axis| (i >> axis & 1) as f32);
    let sides =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    sides.into_iter().flat_map(triangles).map(|triangle| triangle.map(corner)).collect()
}

/// A binary file of triangles.
fn binary(title: &str, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = title.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        // A normal that is wrong, and colours, which nobody reads.
        bytes.extend([0x77; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0xff, 0x7f]);
    }
    bytes
}

/// A text of triangles.
fn text(name: &str, triangles: &[[[f32; 3]; 3]]) -> String {
    let mut text = format!("solid {name}\n");
    for triangle in triangles {
        text.push_str("  facet normal 0 0 0\n    outer loop\n");
        triangle
            .iter()
            .for_each(|[x, y, z]| text.push_str(&format!("      vertex {x} {y:e} {z}\n")));
        text.push_str("    endloop\n  endfacet\n");
    }
    text + &format!("endsolid {name}\n")
}
