//! Triangles: which way they face, and the normals and radii that follow from them.

use crate::summary::Summary;
use crate::table::Table;
use glam::Vec3;
use surfelshop_geometry::mesh;

/// Turns the triangles of a closed mesh that is inside out.
pub(super) fn turn_outwards(table: &mut Table, positions: &[Vec3], summary: &mut Summary) {
    if mesh::is_inside_out(positions, &table.faces) {
        table.faces.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        summary.warnings.push(
            "the mesh is inside out; its triangles were turned to face outwards, normals of the \
             file were not"
                .to_owned(),
        );
    }
}

/// Normals from triangles, zero at points without one; `None` where there are no triangles.
pub(super) fn normals(table: &Table, positions: &[Vec3]) -> Option<Vec<Vec3>> {
    if table.faces.is_empty() {
        return None;
    }
    let normals = mesh::vertex_normals(positions, &table.faces);
    normals.iter().any(|&normal| normal != Vec3::ZERO).then_some(normals)
}

/// Radii that cover the triangles, 0 at points without one; `None` where there are no triangles.
/// Where `normals` are not known yet, those of the triangles count.
pub(super) fn radii(
    table: &Table,
    positions: &[Vec3],
    normals: Option<&[Vec3]>,
) -> Option<Vec<f32>> {
    if table.faces.is_empty() {
        return None;
    }
    let radii = mesh::vertex_radii(positions, normals.unwrap_or_default(), &table.faces);
    radii.iter().any(|&radius| radius > 0.0).then_some(radii)
}
