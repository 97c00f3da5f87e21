//! Turns each connected part of a cloud to face outwards.

use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, each, part};
use glam::{DVec3, Vec3};

const NOBODY: u32 = u32::MAX;

/// Directions in which extremal points vote: axes, face diagonals and space diagonals of a cube.
/// Thirteen, each both ways, outvote an outlier or a fold at one end.
const DIRECTIONS: [DVec3; 13] = [
    DVec3::X,
    DVec3::Y,
    DVec3::Z,
    DVec3::new(1.0, 1.0, 0.0),
    DVec3::new(1.0, -1.0, 0.0),
    DVec3::new(1.0, 0.0, 1.0),
    DVec3::new(1.0, 0.0, -1.0),
    DVec3::new(0.0, 1.0, 1.0),
    DVec3::new(0.0, 1.0, -1.0),
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
];

/// The logarithm of how far the links of a point reach, units of the search: in eighths of an octave, 2^-16 to 2^16.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring(u8);

impl Ring {
    /// Codes to an octave.
    const FINE: u32 = 8;

    pub(super) fn reaching(distance: f64) -> Self {
        // The exponent and the upper three bits of what follows grow with the logarithm.
        let code = |distance: f32| distance.to_bits() >> 20;
        let above = code(distance as f32).saturating_sub(code(1.0) - 16 * Self::FINE);
        Self(above.min(255) as u8)
    }
}

/// Octaves by which the ring of a stray is larger than the mean of its part. Where points lie at random rings differ by
/// less than one; those of a stray, or of a few together, span the gap to the others.
const STRAY: u32 = 2;

/// Share of the points of a part from which on those with such rings are no strays: it is sampled unevenly.
const FEW: f64 = 0.05;

/// What parts are turned by.
pub(super) struct Cloud<'a> {
    pub(super) neighbours: &'a Neighbours,
    /// By place.
    pub(super) rings: &'a [Ring],
    pub(super) n_parts: usize,
    /// The part of a place.
    pub(super) part_of: &'a dyn Fn(usize) -> u32,
}

/// The rings of the points of a part.
#[derive(Clone, Copy, Default)]
struct Rings {
    count: u32,
    sum: u64,
    /// Points whose rings are larger than those of others by far.
    n_wide: u32,
}

impl Rings {
    fn is_wide(&self, ring: Ring) -> bool {
        let above = u64::from(Ring::FINE * STRAY);
        u64::from(ring.0) * u64::from(self.count) > self.sum + above * u64::from(self.count)
    }

    /// Whether a point of this ring says nothing of the part.
    fn is_stray(&self, ring: Ring) -> bool {
        f64::from(self.n_wide) < FEW * f64::from(self.count) && self.is_wide(ring)
    }
}

/// What is known of a connected part.
#[derive(Clone)]
struct Part {
    /// The farthest points along and against each direction.
    ends: [[(f64, u32); 2]; DIRECTIONS.len()],
    normal_sum: DVec3,
}

/// Share of the votes by which one side must lead. The two ends of an open sheet vote against each
/// other and differ by noise only; a closed surface reaches 1.
const LEAD: f64 = 0.1;

impl Cloud<'_> {
    /// The rings of each part.
    fn rings(&self, progress: Progress<'_>) -> Result<Vec<Rings>, Cancelled> {
        let mut all = vec![Rings::default(); self.n_parts];
        each(self.rings.len(), &part(progress, 0.0..0.5), |place| {
            let rings = &mut all[(self.part_of)(place) as usize];
            rings.count += 1;
            rings.sum += u64::from(self.rings[place].0);
        })?;
        each(self.rings.len(), &part(progress, 0.5..1.0), |place| {
            let rings = &mut all[(self.part_of)(place) as usize];
            rings.n_wide += u32::from(rings.is_wide(self.rings[place]));
        })?;
        Ok(all)
    }
}

/// Turns each part so that its extremal points, strays left out, face away from it.
pub(super) fn turn(
    cloud: &Cloud<'_>,
    normals: &mut [Vec3],
    progress: Progress<'_>,
) -> Result<(), Cancelled> {
    let part_of = cloud.part_of;
    let rings = cloud.rings(&part(progress, 0.0..0.3))?;
    let nothing = Part {
        ends: [[(f64::NEG_INFINITY, NOBODY); 2]; DIRECTIONS.len()],
        normal_sum: DVec3::ZERO,
    };
    let mut parts = vec![nothing; cloud.n_parts];
    each(normals.len(), &part(progress, 0.3..0.8), |place| {
        let index = part_of(place) as usize;
        if rings[index].is_stray(cloud.rings[place]) {
            return;
        }
        let part = &mut parts[index];
        let point = cloud.neighbours.point(place);
        part.normal_sum += normals[place].as_dvec3();
        for (direction, ends) in DIRECTIONS.iter().zip(&mut part.ends) {
            let along = point.dot(*direction);
            for (end, distance) in ends.iter_mut().zip([along, -along]) {
                if distance > end.0 {
                    *end = (distance, place as u32);
                }
            }
        }
    })?;
    let inwards: Vec<bool> = parts.iter().map(|part| faces_inwards(part, normals)).collect();
    each(normals.len(), &part(progress, 0.8..1.0), |place| {
        if inwards[part_of(place) as usize] {
            normals[place] = -normals[place];
        }
    })
}

/// Whether the votes of a part's extremal points say that it must be flipped.
fn faces_inwards(part: &Part, normals: &[Vec3]) -> bool {
    let (mut sum, mut total) = (0.0, 0.0);
    for (direction, ends) in DIRECTIONS.iter().zip(&part.ends) {
        let direction = direction.normalize_or_zero();
        for (end, outwards) in ends.iter().zip([direction, -direction]) {
            let vote =
                normals.get(end.1 as usize).map_or(0.0, |normal| normal.as_dvec3().dot(outwards));
            sum += vote;
            total += vote.abs();
        }
    }
    if sum.abs() > LEAD * total {
        return sum < 0.0;
    }
    let mean = part.normal_sum.to_array();
    mean.into_iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most }) < 0.0
}
