//! Merging neighbours into one surfel that has their means and their covariance.

use super::block::Bounds;
use half::f16;
use std::ops::Range;

/// Cosine of the largest angle between a merged surfel's normal and those that it stands for.
const MIN_COSINE: f32 = 0.5;
/// Merged surfels stand for those within so many of their radii.
const MAX_APART: f32 = 1.5;
/// Merged surfels are at most so many times as coarse as those of their block usually are: a few large
/// ones would else keep all from being drawn.
pub(super) const COARSEST: f32 = 2.0;
/// Blocks in a larger one, and surfels that one stands for.
pub(super) const BRANCH: usize = 4;

/// A surfel on its way to be merged.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Scene units.
    pub position: [f32; 3],
    /// A unit vector.
    pub normal: [f32; 3],
    /// Scene units, above 0.
    pub radius: f32,
    /// It faces the eye.
    pub is_round: bool,
    /// Linear Rec. 709.
    pub albedo: [f32; 3],
    /// Accessibility.
    pub ao: f32,
    /// Index of the material.
    pub material: u32,
    /// The number of the surfel, of merged ones that of the largest that it stands for; decides between those at
    /// one place.
    pub stands_for: u32,
    /// How far from it those lie at most, scene units; 0 of a surfel that stands for itself.
    pub apart: f32,
}

impl Sample {
    /// How coarse it is beside what it stands for, scene units.
    pub(super) fn grain(&self) -> f32 {
        if self.apart > 0.0 { self.apart.max(self.radius) } else { 0.0 }
    }

    /// sRGB codes of the albedo: red, green and blue in the lower three bytes.
    #[must_use]
    pub fn code(&self) -> u32 {
        // IEC 61966-2-1.
        let [r, g, b] = self.albedo.map(|linear| {
            let c = linear.clamp(0.0, 1.0);
            let encoded =
                if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
            (encoded * 255.0 + 0.5) as u32
        });
        r | g << 8 | b << 16
    }

    /// Half-precision albedo.
    pub(crate) fn halves(&self) -> [f16; 4] {
        let [r, g, b] = self.albedo.map(f16::from_f32);
        [r, g, b, f16::ONE]
    }
}

/// Puts samples into an order in which each four are neighbours: halves of halves across the longest
/// side, as the order along the curve has leaps.
pub(super) fn gather(samples: &mut [Sample]) {
    // A sample has three times as many bytes as what it is sorted by.
    let place = |(at, sample): (usize, &Sample)| Place {
        position: sample.position,
        stands_for: sample.stands_for,
        at: at as u32,
    };
    let mut places: Vec<Place> = samples.iter().enumerate().map(place).collect();
    halve(&mut places);
    let gathered: Vec<Sample> = places.iter().map(|place| samples[place.at as usize]).collect();
    samples.copy_from_slice(&gathered);
}

/// Where a sample is, in space and among all.
#[derive(Clone, Copy)]
struct Place {
    position: [f32; 3],
    stands_for: u32,
    at: u32,
}

fn halve(places: &mut [Place]) {
    let n_groups = places.len().div_ceil(BRANCH);
    if n_groups < 2 {
        return;
    }
    let bounds = places
        .iter()
        .fold(Bounds::none(), |bounds, place| bounds.and(place.position, place.position));
    let side = [0, 1, 2].map(|axis| bounds.high[axis] - bounds.low[axis]);
    let longer = |a: usize, b: usize| if side[b] > side[a] { b } else { a };
    let axis = longer(longer(0, 1), 2);
    let half = BRANCH * (n_groups / 2);
    let by_place = |a: &Place, b: &Place| {
        let (x, y) = (a.position[axis], b.position[axis]);
        x.total_cmp(&y).then(a.stands_for.cmp(&b.stands_for))
    };
    places.select_nth_unstable_by(half, by_place);
    let (near, far) = places.split_at_mut(half);
    halve(near);
    halve(far);
}

/// The middle one of the radii; 0 where there are none.
pub(super) fn typical_radius(samples: &[Sample]) -> f32 {
    let mut radii: Vec<f32> = samples.iter().map(|sample| sample.radius).collect();
    let middle = radii.len() / 2;
    if radii.is_empty() {
        return 0.0;
    }
    *radii.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Merges neighbours, where that makes no surfel coarser than a radius.
pub(super) fn merged(all: &[Sample], coarsest: f32) -> Vec<Sample> {
    let mut found = Vec::with_capacity(all.len() / 2);
    let merge = |samples: &[Sample]| merge(samples).filter(|one| one.grain() <= coarsest);
    merge_each(all, merge, |one, _| found.push(one));
    found
}

/// Merges each four, else each two; gives for each that is left which of the samples it stands for.
fn merge_each(
    all: &[Sample],
    merge: impl Fn(&[Sample]) -> Option<Sample>,
    mut take: impl FnMut(Sample, Range<usize>),
) {
    for (i, four) in all.chunks(BRANCH).enumerate() {
        let first = BRANCH * i;
        if let Some(one) = merge(four) {
            take(one, first..first + four.len());
            continue;
        }
        for (i, two) in four.chunks(2).enumerate() {
            let first = first + 2 * i;
            if let Some(one) = merge(two) {
                take(one, first..first + two.len());
                continue;
            }
            for (i, one) in two.iter().enumerate() {
                take(*one, first + i..first + i + 1);
            }
        }
    }
}

/// Puts samples into an order in which neighbours are side by side, and merges up to four at a time where what they
/// become looks like them. Gives for each sample that is left which of those in the new order it stands for.
#[must_use]
pub fn merge_neighbours(samples: &mut [Sample]) -> Vec<(Sample, Range<usize>)> {
    gather(samples);
    let coarsest = COARSEST * typical_radius(samples);
    let mut found = Vec::with_capacity(samples.len() / 2);
    let merge = |samples: &[Sample]| merge(samples).filter(|one| one.grain() <= coarsest);
    merge_each(samples, merge, |one, range| found.push((one, range)));
    found
}

/// The same whatever they look like: round splats where no disc does, as seen from afar leaves and walls that meet do.
/// Where materials differ it has that of the largest. Round ones become at most so many times as coarse as the samples
/// usually are; infinitely many merge each four.
#[must_use]
pub fn merge_all(samples: &mut [Sample], coarsest_round: f32) -> Vec<(Sample, Range<usize>)> {
    gather(samples);
    let typical = typical_radius(samples);
    let (coarsest, coarsest_round) = (COARSEST * typical, coarsest_round * typical);
    let mut found = Vec::with_capacity(samples.len() / 2);
    let merge = |samples: &[Sample]| {
        let alike = merge(samples).filter(|one| one.grain() <= coarsest);
        let round = || merge_round(samples).filter(|one| one.grain() <= coarsest_round);
        alike.or_else(round)
    };
    merge_each(samples, merge, |one, range| found.push((one, range)));
    found
}

/// A round splat for several surfels; `None` of a single one, and where numbers end.
fn merge_round(samples: &[Sample]) -> Option<Sample> {
    if samples.len() < 2 {
        return None;
    }
    let largest = samples
        .iter()
        .copied()
        .reduce(|largest, other| if other.radius > largest.radius { other } else { largest })?;
    let round: Vec<Sample> = samples
        .iter()
        .map(|sample| Sample { is_round: true, material: largest.material, ..*sample })
        .collect();
    merge_within(&round, f32::INFINITY)
}

/// One surfel for several; `None` where there is none that looks like them.
fn merge(samples: &[Sample]) -> Option<Sample> {
    merge_within(samples, MAX_APART)
}

/// The same; places may lie so many of the joint radii apart.
fn merge_within(samples: &[Sample], max_apart: f32) -> Option<Sample> {
    let [first, rest @ ..] = samples else { return None };
    let is_round = first.is_round;
    let differs = |other: &Sample| other.material != first.material || other.is_round != is_round;
    if rest.is_empty() || rest.iter().any(differs) {
        return None;
    }
    // In units of the largest radius: no square overflows or vanishes.
    let unit = samples.iter().map(|sample| sample.radius).fold(0.0, f32::max);
    let weights = samples.iter().map(|sample| (sample.radius / unit).powi(2));
    let total: f32 = weights.clone().sum();
    let mean = |of: fn(&Sample) -> [f32; 3]| {
        let mut sum = [0.0; 3];
        for (sample, weight) in samples.iter().zip(weights.clone()) {
            let value = of(sample);
            for axis in 0..3 {
                sum[axis] += value[axis] * (weight / total);
            }
        }
        sum
    };
    // Relative to the first: differences of neighbours are small, coordinates need not be.
    let offset_of = |sample: &Sample, axis: usize| sample.position[axis] - first.position[axis];
    let position = [0, 1, 2].map(|axis| {
        let offsets = samples.iter().zip(weights.clone());
        let offset: f32 = offsets.map(|(one, w)| offset_of(one, axis) * (w / total)).sum();
        first.position[axis] + offset
    });
    let normal = match unit_vector(mean(|sample| sample.normal)) {
        Some(normal) => normal,
        // Normals of leaves have all directions.
        None if is_round => first.normal,
        None => return None,
    };
    // The covariance of Gaussians around several places is the mean of theirs and that of the places;
    // a disc's is an eighth of its squared radius along each of two axes. The places of discs lie in their plane;
    // those of round splats in space, so that the eye sees two thirds of their squared distances.
    let of_places = if is_round { 8.0 / 3.0 } else { 4.0 };
    let (mut squared, mut farthest) = (0.0, 0.0f32);
    for (sample, weight) in samples.iter().zip(weights.clone()) {
        let offset = [0, 1, 2].map(|axis| (sample.position[axis] - position[axis]) / unit);
        let apart2 = dot(offset, offset);
        squared += weight / total * ((sample.radius / unit).powi(2) + of_places * apart2);
        farthest = farthest.max(apart2.sqrt() * unit + sample.apart);
        let is_turned = !is_round && dot(sample.normal, normal) < MIN_COSINE;
        if is_turned || apart2 > max_apart * max_apart * total {
            return None;
        }
    }
    let radius = unit * squared.sqrt();
    let ao = samples.iter().zip(weights.clone()).map(|(sample, w)| sample.ao * (w / total)).sum();
    let largest = samples
        .iter()
        .fold(first, |largest, other| if other.radius > largest.radius { other } else { largest });
    let albedo = mean(|sample| sample.albedo);
    let is_finite = [position, normal, albedo].iter().flatten().all(|x| x.is_finite());
    let Sample { material, stands_for, .. } = *largest;
    // Surfels at one place are merged without a trace.
    let apart = farthest.max(f32::MIN_POSITIVE);
    let sample =
        Sample { position, normal, radius, is_round, albedo, ao, material, stands_for, apart };
    (is_finite && radius.is_finite()).then_some(sample)
}

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn unit_vector(v: [f32; 3]) -> Option<[f32; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-3).then(|| v.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(position: [f32; 3], normal: [f32; 3]) -> Sample {
        Sample {
            position,
            normal,
            radius: 1.0,
            is_round: false,
            albedo: [position[0].abs(), 0.5, 0.25],
            ao: 0.5,
            material: 0,
            stands_for: 7,
            apart: 0.0,
        }
    }

    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    fn square(side: f32) -> Vec<Sample> {
        let at = |x, z| sample([x, 3.0, z], UP);
        vec![at(0.0, 0.0), at(side, 0.0), at(0.0, side), at(side, side)]
    }

    #[test]
    fn one_for_four_has_their_means_and_their_covariance() {
        let one = merge(&square(0.5)).unwrap();
        assert_eq!((one.position, one.normal), ([0.25, 3.0, 0.25], UP));
        assert_eq!((one.albedo, one.ao), ([0.25, 0.5, 0.25], 0.5));
        // An eighth of the radius squared, and a sixteenth along each axis: 1 + 8 / 16.
        assert!((one.radius - 1.5f32.sqrt()).abs() < 1e-6, "{}", one.radius);
        assert!((one.apart - 0.125f32.sqrt()).abs() < 1e-6, "{}", one.apart);
        let large = sample([9.0, 3.0, 0.0], UP);
        let mut unequal = [sample([8.0, 3.0, 0.0], UP), Sample { radius: 2.0, ..large }];
        unequal[1].stands_for = 8;
        let one = merge(&unequal).unwrap();
        assert_eq!((one.position, one.stands_for), ([8.8, 3.0, 0.0], 8), "weighted by area");
    }

    #[test]
    fn those_that_do_not_look_alike_are_not_merged() {
        let with = |change: fn(&mut Sample)| {
            let mut samples = square(0.5);
            change(&mut samples[2]);
            merge(&samples)
        };
        assert!(with(|_| ()).is_some());
        assert!(with(|sample| sample.material = 1).is_none(), "another material");
        assert!(with(|sample| sample.normal = [0.0, -1.0, 0.0]).is_none(), "turned away");
        assert!(with(|sample| sample.position[0] = 9.0).is_none(), "far away");
        assert!(with(|sample| sample.normal = [f32::NAN; 3]).is_none(), "no normal");
        assert!(with(|sample| sample.position[1] = f32::INFINITY).is_none(), "nowhere");
        assert!(merge(&square(0.5)[..1]).is_none(), "nothing to merge");
    }

    #[test]
    fn round_splats_are_merged_whatever_their_normals_and_never_with_discs() {
        let mut round = square(0.5);
        round.iter_mut().for_each(|one| one.is_round = true);
        round[2].normal = [0.0, -1.0, 0.0];
        let one = merge(&round).unwrap();
        assert!(one.is_round);
        // A third of the squared distance along any axis: 1 + 8 / 3 / 8.
        assert!((one.radius - (4.0f32 / 3.0).sqrt()).abs() < 1e-6, "{}", one.radius);
        round[0].is_round = false;
        assert!(merge(&round).is_none());
    }

    #[test]
    fn extreme_sizes_are_merged_alike() {
        for scale in [1e-30, 1e-12, 1e12, 1e30] {
            let scaled = square(0.5).into_iter().map(|sample| Sample {
                position: sample.position.map(|x| x * scale),
                radius: scale,
                ..sample
            });
            let one = merge(&scaled.collect::<Vec<_>>()).unwrap();
            let relative = one.radius / scale - 1.5f32.sqrt();
            assert!(relative.abs() < 1e-5, "{scale}: {}", one.radius);
        }
    }

    #[test]
    fn a_large_surfel_among_small_ones_stays_as_it_is() {
        let mut samples: Vec<Sample> = (0..15).flat_map(|_| square(0.5)).collect();
        samples.extend(square(0.5).into_iter().map(|one| Sample { radius: 50.0, ..one }));
        let found = merged(&samples, COARSEST * typical_radius(&samples));
        assert_eq!(found.len(), 15 + 4);
        assert!(found.iter().all(|one| one.grain() <= 2.0), "all stay fine");
    }
}
