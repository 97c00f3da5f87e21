//! Binary files: a title of 80 bytes, the number of triangles, and 50 bytes for each.

use crate::mesh::Mesh;
use surfelshop_api::format::{BATCH, CloudSink, FileSource};
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes before the triangles.
const START: u64 = 84;

/// Bytes of a triangle: a normal and three corners of floats, and two more.
const TRIANGLE: usize = 50;

fn announced(file: &FileSource) -> Result<u32> {
    let mut count = [0; 4];
    file.read_exact_at(80, &mut count)?;
    Ok(u32::from_le_bytes(count))
}

fn expected_length(n: u32) -> u64 {
    START + TRIANGLE as u64 * u64::from(n)
}

/// Whether the file is as long as the triangles that it announces.
pub(crate) fn has_its_length(file: &FileSource) -> Result<bool> {
    Ok(file.length() >= START && file.length() == expected_length(announced(file)?))
}

/// Reads a file.
pub(crate) fn read(file: &FileSource, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
    let length = file.length();
    if length < START {
        return Err(Error::new(format!(
            "expected a text that begins with `solid`, or {START} bytes before the triangles, found {length} bytes"
        )));
    }
    let n = announced(file)?;
    let expected = expected_length(n);
    if length < expected {
        return Err(Error::new(format!(
            "expected a text that begins with `solid`, or {expected} bytes of {n} triangles, found {length} bytes: the file is cut short"
        )));
    }
    let title = file.bytes_at(0, 80)?;
    let Some(mut mesh) = Mesh::<f32>::begin(clouds, "binary", String::new(), comments(&title))?
    else {
        return Ok(());
    };
    if length > expected {
        mesh.warn(&format!("{} bytes behind the triangles were left out", length - expected));
    }
    let (mut bytes, mut done) = (Vec::new(), 0u64);
    while done < u64::from(n) {
        job.check()?;
        // At most a batch.
        let count = (u64::from(n) - done).min(BATCH as u64) as usize;
        bytes.try_reserve(count * TRIANGLE)?;
        bytes.resize(count * TRIANGLE, 0);
        file.read_exact_at(START + done * TRIANGLE as u64, &mut bytes)?;
        for triangle in bytes.as_chunks::<TRIANGLE>().0 {
            mesh.push(&corners(triangle))?;
        }
        done += count as u64;
        job.progress(done as f64 / f64::from(n), "");
    }
    mesh.flush()
}

fn corners(triangle: &[u8; TRIANGLE]) -> [[f32; 3]; 3] {
    let mut numbers =
        triangle[12..48].as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    // There are nine.
    std::array::from_fn(|_| std::array::from_fn(|_| numbers.next().unwrap_or(f32::NAN)))
}

/// The title, where it is one.
fn comments(title: &[u8]) -> Vec<String> {
    let end = title.iter().position(|&byte| byte == 0).unwrap_or(title.len());
    let title = title[..end].trim_ascii();
    let printable = title.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    let text = String::from_utf8_lossy(title).into_owned();
    if printable && !title.is_empty() { vec![text] } else { Vec::new() }
}
