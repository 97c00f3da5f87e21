//! Ellipses that stand for Gaussian splats where surfels are drawn.

use super::{BLOCK, Gaussians};
use crate::assemble::position::Positions;
use crate::assemble::shape::{Shape, UNIT_TOLERANCE, take_tangents, tangent_columns};
use crate::assemble::vectors::{take_vectors, whole_vectors};
use crate::summary::Summary;
use crate::table::{NORMALS, RADII, Table};
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use surfelshop_geometry::normals;

/// The shortest half axis of an ellipse, in diagonals of the cloud, or in scene units where it has none.
const SHORTEST: f64 = 1e-7;

/// The half axes of an ellipse are at least so many standard deviations of its Gaussian, however faint it is.
const FEWEST_DEVIATIONS: f32 = 0.5;

/// What is drawn of a splat as a surfel.
struct Ellipse {
    normal: Vec3,
    u: Vec3,
    v: Vec3,
    radius: f32,
}

/// The ellipse across the splat's two longest axes, within which the Gaussian covers at least a half of what is
/// behind it: up to r = sqrt(2 ln(2 α)) standard deviations where it has the opacity α at its centre, and up to half
/// of one where it covers half nowhere or nearly so. The normal is the shortest axis, of a flat splat the third.
fn ellipse(gaussians: &Gaussians, splat: usize, shortest: f32) -> Ellipse {
    let axes = Mat3::from_quat(gaussians.rotation(splat));
    let n = gaussians.n_scales;
    let scale = |axis: usize| match axis < n {
        true => gaussians.scales.get(splat * n + axis).copied().unwrap_or_default(),
        // Below all others.
        false => -1.0,
    };
    let mut order = [0, 1, 2];
    // The longest first; of equal ones the first, so that a ball has the third as its normal.
    for [i, j] in [[0, 1], [1, 2], [0, 1]] {
        if scale(order[i]).total_cmp(&scale(order[j])).is_lt() {
            order.swap(i, j);
        }
    }
    let opacity = gaussians.opacity.get(splat).copied().unwrap_or_default();
    // Where the logarithm is below 0 or of 0, the larger of both is the least.
    let squared = 2.0 * (2.0 * opacity).ln();
    let r = squared.max(FEWEST_DEVIATIONS * FEWEST_DEVIATIONS).sqrt();
    let [a, b, c] = order;
    let half_axis = |axis: usize| axes.col(axis) * (scale(axis) * r).max(shortest);
    let normal = upright(axes.col(c));
    let (u, v) = (half_axis(a), half_axis(b));
    let v = if u.cross(v).dot(normal) < 0.0 { -v } else { v };
    Ellipse { normal, u, v, radius: (scale(a) * r).max(shortest) }
}

/// Of a direction and its opposite that whose largest component is above 0, the same for both.
fn upright(direction: Vec3) -> Vec3 {
    let direction = direction.normalize_or(Vec3::Z);
    let size = direction.abs();
    let largest = if size.x >= size.y && size.x >= size.z {
        direction.x
    } else if size.y >= size.z {
        direction.y
    } else {
        direction.z
    };
    if largest < 0.0 { -direction } else { direction }
}

/// What a file says of the ellipses, where it was written with them.
struct InFile {
    normals: Option<Vec<Vec3>>,
    tangents: [Vec<Vec3>; 2],
    radii: Option<Vec<f32>>,
}

impl InFile {
    /// Takes it out of the table. Without tangents, normals and radii say nothing: trainers write zeros.
    fn take(table: &mut Table) -> Option<Self> {
        let tangents = take_tangents(table);
        let normals = NORMALS.iter().find_map(|names| take_vectors(table, *names));
        let radii = table.take_any(&RADII).map(|[radius]| radius.into_f32());
        Some(Self { normals, tangents: tangents?, radii })
    }

    /// Puts it in the place of what was derived, where it can be drawn; whether normal and radius are of the file.
    fn overwrite(&self, splat: usize, ellipse: &mut Ellipse) -> (Normal, bool) {
        let [u, v] = [0, 1].map(|i| self.tangents[i].get(splat).copied().unwrap_or_default());
        if !(normals::is_valid(u) && normals::is_valid(v)) {
            return (Normal::Derived, false);
        }
        (ellipse.u, ellipse.v) = (u, v);
        let radius = self.radii.as_ref().and_then(|radii| radii.get(splat).copied());
        let radius = radius.filter(|radius| radius.is_finite() && *radius > 0.0);
        ellipse.radius = radius.unwrap_or(ellipse.radius);
        let normal = self.normals.as_ref().and_then(|normals| normals.get(splat).copied());
        let normal = match normal.filter(|normal| normals::is_valid(*normal)) {
            Some(normal) => {
                let is_unit = (normal.as_dvec3().length_squared() - 1.0).abs() <= UNIT_TOLERANCE;
                ellipse.normal = if is_unit { normal } else { normals::normalised(normal) };
                if is_unit { Normal::OfFile } else { Normal::Normalised }
            }
            None => Normal::Derived,
        };
        (normal, radius.is_some())
    }
}

/// Where a normal is from.
enum Normal {
    Derived,
    OfFile,
    Normalised,
}

/// Takes what the file has, and makes the rest of the splats.
pub(super) fn take(
    gaussians: &Gaussians,
    table: &mut Table,
    placed: &Positions,
    summary: &mut Summary,
) -> Shape {
    let n = placed.positions.len();
    let diagonal = placed.bounds.map_or(0.0, |bounds| bounds.diagonal());
    let shortest = if diagonal > 0.0 { SHORTEST * diagonal } else { SHORTEST };
    let shortest = shortest.clamp(f64::from(f32::MIN_POSITIVE), f64::from(super::MAX_SCALE)) as f32;
    let in_file = InFile::take(table);
    // Zeros of plain numbers come from the system, which does not write them.
    let zeros = || -> Vec<Vec3> { whole_vectors(vec![[0f32; 3]; n]) };
    let (mut normals, mut u, mut v, mut radii) = (zeros(), zeros(), zeros(), vec![0f32; n]);
    let places = (&mut normals, &mut u, &mut v, &mut radii).into_par_iter().enumerate();
    let counts = places.with_min_len(BLOCK).map(|(splat, (normal, u, v, radius))| {
        let mut made = ellipse(gaussians, splat, shortest);
        let (kind, has_radius) = match &in_file {
            Some(in_file) => in_file.overwrite(splat, &mut made),
            None => (Normal::Derived, false),
        };
        (*normal, *u, *v, *radius) = (made.normal, made.u, made.v, made.radius);
        let (of_file, normalised) = match kind {
            Normal::Derived => (0, 0),
            Normal::OfFile => (1, 0),
            Normal::Normalised => (0, 1),
        };
        [of_file, normalised, u64::from(has_radius)]
    });
    let sum = |a: [u64; 3], b: [u64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let [of_file, normalised, n_radii] = counts.reduce(|| [0; 3], sum);
    let n = n as u64;
    (summary.normals.given, summary.normals.normalised) = (of_file, normalised);
    summary.normals.of_splats = n - of_file - normalised;
    (summary.radii.given, summary.radii.of_splats) = (n_radii, n - n_radii);
    Shape { normals, radii, others: tangent_columns(u, v) }
}
