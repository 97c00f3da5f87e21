//! Memory that making a cloud takes, estimated before it is begun.

use super::gaussians;
use crate::memory::{self, OutOfMemory};
use crate::options::ReadOptions;
use crate::table::{COLORS, Field, NORMALS, RADII};
use surfelshop_api::columns::Element;

/// Bytes a point for the search structure, its neighbours and what is fitted to them, where normals or radii are
/// missing; measured as the most memory of a load of two million bare points, 513 MB, less its columns. Points of
/// a mesh that no triangle has need it, too.
const ESTIMATES: u64 = 240;

/// Bytes a triangle, for normals and radii from faces.
const TRIANGLE: u64 = 32;

/// Bytes a point for what is small: masks, and room that vectors keep.
const SLACK: u64 = 8;

/// Bytes of all values of a point.
pub(crate) fn row_bytes(fields: &[Field]) -> u64 {
    fields.iter().map(|field| (field.names.len() * field.values.element().size()) as u64).sum()
}

/// Whether normals or radii are missing, so that they are estimated on all threads.
pub(crate) fn estimates(fields: &[Field], options: &ReadOptions<'_>) -> bool {
    let has = |name: &str| {
        fields.iter().flat_map(|field| &field.names).any(|own| own.eq_ignore_ascii_case(name))
    };
    let normals = NORMALS.iter().any(|spelling| spelling.iter().all(|name| has(name)));
    let radii = options.radius.is_some() || RADII.iter().any(|[name]| has(name));
    !(may_be_splats(fields) || normals && radii)
}

fn may_be_splats(fields: &[Field]) -> bool {
    gaussians::may_be_splats(fields.iter().flat_map(|field| &field.names).map(String::as_str))
}

/// Asks for the memory that making a cloud takes, and for so many bytes besides.
///
/// # Errors
/// Where there is not as much.
pub(crate) fn ask(
    fields: &[Field],
    n_rows: u64,
    n_triangles: u64,
    options: &ReadOptions<'_>,
    besides: u64,
) -> Result<(), OutOfMemory> {
    let needed = besides.saturating_add(bytes(fields, n_rows, n_triangles, options));
    match estimates(fields, options) {
        true => memory::ask_for_threads(needed),
        false => memory::ask(needed),
    }
}

/// Bytes that making a cloud of so many points with these columns takes besides the columns themselves.
fn bytes(fields: &[Field], n_rows: u64, n_triangles: u64, options: &ReadOptions<'_>) -> u64 {
    let shape = if estimates(fields, options) { ESTIMATES } else { 0 };
    let derived = if may_be_splats(fields) { gaussians::DERIVED } else { 0 };
    let row = fields.iter().map(copies).sum::<u64>() + shape + derived + SLACK;
    n_rows.saturating_mul(row).saturating_add(n_triangles.saturating_mul(TRIANGLE))
}

/// Bytes a point that the copies of a column take on its way into the cloud.
fn copies(field: &Field) -> u64 {
    let names: Vec<&str> = field.names.iter().map(String::as_str).collect();
    let same = |other: &[&str]| {
        names.len() == other.len()
            && names.iter().zip(other).all(|(own, name)| own.eq_ignore_ascii_case(name))
    };
    let size = field.values.element().size() as u64;
    let in_place = field.values.element() == Element::F32
        && (same(&["x", "y", "z"])
            || NORMALS.iter().any(|normal| same(normal))
            || RADII.iter().any(|radius| same(radius)));
    if in_place {
        0
    } else if same(&["x", "y", "z"]) || ["x", "y", "z"].iter().any(|axis| same(&[axis])) {
        // In double precision, and as offsets.
        names.len() as u64 * (8 + 4)
    } else if COLORS.iter().any(|color| same(color) || same(&color[..3])) {
        names.len() as u64 * (size + 1)
    } else {
        // Taken apart, and put together again.
        names.len() as u64 * 2 * size
    }
}
