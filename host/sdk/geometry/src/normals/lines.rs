//! Points in lines, as a scanner's, that lie closer along them than they are apart.
//!
//! The nearest of a point are then all of its own line, and where that bends, as over an edge, they lie in a plane as
//! exactly as can be: that of the scanner's sweep, which says nothing of the surface.

use super::plane::{Plane, outer};
use crate::eigen;
use crate::neighbours::Close;
use glam::{DMat3, DVec3};

/// Directions in a plane that are told apart.
const SECTORS: u32 = 16;

/// Sectors without a point that make a gap: about a right angle.
const GAP: u32 = 4;

/// Dimension of a neighbourhood below which it is that of a line: a surface has 2, a line has 1.
const LINE: f64 = 1.4;

/// The same below which it may be that of a line that bends, or has noise.
const BENT: f64 = 1.8;

/// A point counts where no one that counts is nearer to it than this share of its distance: of the own line a few,
/// one for each direction of others.
const BESIDE: f64 = 0.9;

/// Points that count, at least: two of the own line, and one beside it.
const FEWEST: usize = 3;

/// Place, by distance, of the point from whose distance on directions count in full: nearer ones may be noise.
const TRUSTED: usize = 3;

/// The second largest spread of unit directions, from which on they are not all of one line; of two perpendicular ones
/// it is 1 for each of a line's points.
const SPREAD: f64 = 0.3;

/// Angle up to which planes are one, radians: 20 degrees.
const TURNED: f64 = 0.35;

/// The same in uncertainties of the plane of several lines, where that is more.
const UNSURE: f64 = 4.0;

/// Whether the points near to one, sorted, may be of one line through it alone; `around` are where they are.
pub(super) fn are_line(normal: DVec3, here: DVec3, around: &[DVec3], near: &[Close]) -> bool {
    let Some((farthest, nearer)) = near.split_last() else {
        return false;
    };
    let all = nearer.len() as i32;
    let share = 1.0 / f64::from(farthest.squared());
    let shorter: f64 = nearer.iter().map(|close| f64::from(close.squared()) * share).product();
    if shorter >= of_dimension(all, BENT) {
        return false;
    }
    let least = if shorter < of_dimension(all, LINE) { 1 } else { 2 };
    n_gaps(seen(normal, here, around)) >= least
}

/// The product of the squares of so many distances, in shares of the farthest, in a neighbourhood of this dimension: on a
/// line there are as many points within a distance as it is long, on a surface as its square.
///
/// Source: Levina and Bickel, Maximum likelihood estimation of intrinsic dimension, NIPS 2004, equation 8.
fn of_dimension(count: i32, dimension: f64) -> f64 {
    (-2.0 * f64::from(count) / dimension).exp()
}

/// The sectors of a plane that points around one lie in. Around a point on a surface they lie on all sides, at its
/// border they leave out one part; those of a line leave out two, however it bends.
fn seen(normal: DVec3, here: DVec3, around: &[DVec3]) -> u32 {
    let (u, v) = normal.any_orthonormal_pair();
    around.iter().fold(0, |seen, point| {
        let offset = *point - here;
        let (x, y) = (offset.dot(u), offset.dot(v));
        let size = x.abs() + y.abs();
        if size <= 0.0 {
            return seen;
        }
        // Grows with the angle, from 0 to 4.
        let turn = if y >= 0.0 { 1.0 - x / size } else { 3.0 + x / size };
        seen | 1 << ((turn * f64::from(SECTORS / 4)) as u32 % SECTORS)
    })
}

/// Runs of sectors without a point that are long enough to be gaps, round the circle.
fn n_gaps(seen: u32) -> u32 {
    let all = (1 << SECTORS) - 1;
    let empty = !seen & all;
    let turned = |by: u32| (empty >> by | empty << (SECTORS - by)) & all;
    // Where so many follow each other, and the sector before has a point.
    let runs = (1..GAP).fold(empty, |runs, by| runs & turned(by));
    (runs & !turned(SECTORS - 1)).count_ones()
}

/// The plane of a point through its own line and those beside it, and how far others may be turned from it.
pub(super) struct Across {
    pub(super) plane: Plane,
    /// Cosine of the angle from which on another plane is not that of the surface.
    least: f64,
}

impl Across {
    /// That among the points near to one, given as offsets, nearest first; `None` where there is no other line.
    ///
    /// From each direction one or two points count, at whatever distance, and it is their directions that
    /// the plane is laid through: so many points of the own line weigh no more than the few beside it.
    pub(super) fn of(offsets: &[DVec3]) -> Option<Self> {
        let mut beside: Vec<DVec3> = Vec::new();
        for offset in offsets {
            let least = BESIDE * BESIDE * offset.length_squared();
            if beside.iter().all(|other| other.distance_squared(*offset) > least) {
                beside.push(*offset);
            }
        }
        let trusted = offsets.get(TRUSTED)?.length_squared();
        if beside.len() < FEWEST || trusted <= 0.0 {
            return None;
        }
        let directions = beside.iter().map(|offset| {
            let squared = offset.length_squared();
            outer(*offset) * ((squared / trusted).min(1.0) / squared)
        });
        let spread = eigen::symmetric(directions.sum::<DMat3>());
        (spread.values[1] > SPREAD).then(|| Self::through(&beside, spread.vectors))
    }

    /// The plane across the first of three axes.
    fn through(beside: &[DVec3], [normal, u, v]: [DVec3; 3]) -> Self {
        let count = beside.len() as f64;
        let deviation = |axis: DVec3| {
            let squares = beside.iter().map(|offset| offset.dot(axis).powi(2));
            (squares.sum::<f64>() / count).sqrt()
        };
        let (a, b) = (deviation(u), deviation(v));
        // The median, since at an edge a few are of another face.
        let mut sines: Vec<f64> =
            beside.iter().map(|offset| offset.dot(normal).abs() / offset.length()).collect();
        sines.sort_by(f64::total_cmp);
        let (side, roughness) = (a.min(b), sines[sines.len() / 2].min(1.0));
        let plane = Plane {
            normal,
            degenerate: false,
            error: roughness * side,
            roughness,
            side,
            width: side / a.max(b),
            count,
        };
        let most = (UNSURE * plane.uncertainty()).clamp(TURNED, std::f64::consts::FRAC_PI_2);
        Self { plane, least: most.cos() }
    }

    /// Whether another plane may be that of the surface, too.
    pub(super) fn agrees_with(&self, plane: &Plane) -> bool {
        plane.normal.dot(self.plane.normal).abs() >= self.least
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_counted_round_the_circle() {
        assert_eq!(n_gaps(0xffff), 0);
        assert_eq!(n_gaps(0x0101), 2);
        assert_eq!(n_gaps(0x0001), 1);
        // Three are no gap; one run goes on from the last sector to the first.
        assert_eq!(n_gaps(0b0001_1111_1111_0001), 0);
        assert_eq!(n_gaps(0b0011_1111_1111_1100), 1);
        assert_eq!(n_gaps(0b0011_1100_0011_1100), 2);
    }

    /// Lines over the edge of a box, 10 apart, points 1 apart: the plane of a point 2 from it is nearly that of its face.
    #[test]
    fn the_plane_across_lines_is_that_of_the_face() {
        let over_edge = |along: f64, line: f64| match along > 2.0 {
            true => DVec3::new(2.0, line, 2.0 - along),
            false => DVec3::new(along, line, 0.0),
        };
        let points = (-40..=40).flat_map(|along| {
            [-1.0, 0.0, 1.0].map(|line| over_edge(f64::from(along), 10.0 * line + 0.2 * line))
        });
        let mut offsets: Vec<DVec3> = points.filter(|point| *point != DVec3::ZERO).collect();
        offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
        let own = &offsets[..16];
        assert!(own.iter().all(|offset| offset.y == 0.0));
        assert!(n_gaps(seen(DVec3::Y, DVec3::ZERO, own)) >= 2);
        let across = Across::of(&offsets[..64]).unwrap();
        assert!(across.plane.normal.z.abs() > 0.9, "{}", across.plane.normal);
        let of_line = Plane { normal: DVec3::Y, ..across.plane };
        assert!(!across.agrees_with(&of_line));
    }
}
