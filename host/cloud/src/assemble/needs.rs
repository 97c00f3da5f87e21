//! What making a cloud takes in memory, told before it is begun.

use crate::read::ReadOptions;
use crate::table::{COLORS, Field, NORMALS, RADII};
use surfelshop_api::columns::Element;

/// Bytes a point for the search structure, its neighbours and what is fitted to them; measured as the most
/// memory of a load of ten million bare points, 2.4 GB, less its columns.
const ESTIMATES: u64 = 160;

/// Bytes a point of a mesh, and bytes a triangle, for normals and radii from its faces.
const OF_MESH: u64 = 64;
const TRIANGLE: u64 = 32;

/// Bytes a point for what is small: masks, and room that vectors keep.
const SLACK: u64 = 8;

/// Bytes of all values of a point.
pub(crate) fn row_bytes(fields: &[Field]) -> u64 {
    fields.iter().map(|field| (field.names.len() * field.values.element().size()) as u64).sum()
}

/// Bytes that making a cloud of so many points with these columns takes besides the columns themselves.
pub(crate) fn bytes(
    fields: &[Field],
    n_rows: u64,
    n_triangles: Option<u64>,
    options: &ReadOptions<'_>,
) -> u64 {
    let has = |name: &str| {
        fields.iter().flat_map(|field| &field.names).any(|own| own.eq_ignore_ascii_case(name))
    };
    let normals = NORMALS.iter().any(|spelling| spelling.iter().all(|name| has(name)));
    let radii = options.radius.is_some() || RADII.iter().any(|[name]| has(name));
    let shape = match (normals && radii, n_triangles) {
        (true, _) => 0,
        (false, Some(_)) => OF_MESH,
        (false, None) => ESTIMATES,
    };
    let copies: u64 = fields.iter().map(copies).sum();
    let row = copies + shape + SLACK;
    let triangles = n_triangles.unwrap_or(0).saturating_mul(TRIANGLE);
    n_rows.saturating_mul(row).saturating_add(triangles)
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
