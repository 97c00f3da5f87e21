//! Surfels that look in the same directions.

use crate::beams::{Beams, Rays, WIDTH};
use crate::form_factor::Reach;
use crate::rays::{START, concentric, scramble, sobol};
use crate::surfels::Surfels;
use fearless_simd::{Level, Simd, dispatch};
use surfelshop_api::glam::{Vec2, Vec3};

/// Surfels of a node that are divided into bundles together.
const TOGETHER: usize = 512;

/// Length that a change of the normal by 1 counts as, as a share of the size of what is divided.
const TURN: f32 = 1.0;

/// Change of a normal's component above which surfels are divided by it, and not into equal parts.
const SIDES: f32 = 1.2;

/// Gap within a bundle, over the radius of its largest disc, at which it is divided: what strays shares
/// nothing with what is near. Lines of a scan that are twenty steps apart lie six radii apart.
const APART: f32 = 16.0;

/// At most sixteen surfels side by side that face about the same way.
pub(crate) struct Bundle {
    pub(crate) places: [u32; WIDTH],
    pub(crate) n: usize,
}

impl Bundle {
    pub(crate) fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.places[..self.n].iter().map(|&place| place as usize)
    }
}

/// Divides places, in the order of the tree, into bundles.
pub(crate) fn bundles(surfels: &Surfels, radii: &[f32], asked: &[usize]) -> Vec<Bundle> {
    let mut bundles = Vec::with_capacity(asked.len() / WIDTH * 5 / 4 + 1);
    let nodes = surfels.tree.nodes();
    let mut open: Vec<u32> = if nodes.is_empty() { Vec::new() } else { vec![0] };
    let mut rest = asked;
    while let Some(next) = open.pop() {
        let node = &nodes[next as usize];
        if !node.children.is_empty() && node.surfels.len() > TOGETHER {
            // Taken from the end, so that places stay in order.
            open.extend(node.children.clone().rev());
            continue;
        }
        let n = rest.partition_point(|&place| place < node.surfels.end as usize);
        let (own, others) = rest.split_at(n);
        rest = others;
        for some in own.chunks(TOGETHER) {
            let mut some: Vec<u32> = some.iter().map(|&place| place as u32).collect();
            divide(surfels, radii, &mut some, &mut bundles);
        }
    }
    bundles
}

/// Halves surfels by what they differ by most, place or direction, into whole bundles.
fn divide(surfels: &Surfels, radii: &[f32], places: &mut [u32], bundles: &mut Vec<Bundle>) {
    let normal = |place: u32| surfels.normals[place as usize];
    let at = |place: u32| surfels.positions[place as usize];
    let extent = |places: &[u32], of: &dyn Fn(u32) -> Vec3| {
        let low = places.iter().map(|&place| of(place)).fold(Vec3::INFINITY, Vec3::min);
        let high = places.iter().map(|&place| of(place)).fold(Vec3::NEG_INFINITY, Vec3::max);
        (low, high - low)
    };
    let (low, turn) = extent(places, &normal);
    let sides = if turn.max_element() > SIDES {
        let axis = turn.max_position();
        let middle = low[axis] + 0.5 * turn[axis];
        part(places, |place| normal(place)[axis] < middle)
    } else if places.len() <= WIDTH {
        gap(surfels, radii, places)
            .map_or(0, |(axis, middle)| part(places, |place| at(place)[axis] < middle))
    } else {
        0
    };
    if sides > 0 && sides < places.len() {
        let (first, second) = places.split_at_mut(sides);
        divide(surfels, radii, first, bundles);
        divide(surfels, radii, second, bundles);
        return;
    }
    if places.len() <= WIDTH {
        let mut bundle = Bundle { places: [0; WIDTH], n: places.len() };
        bundle.places[..places.len()].copy_from_slice(places);
        bundle.places[..places.len()].sort_unstable();
        bundles.push(bundle);
        return;
    }
    let (_, size) = extent(places, &at);
    let by_turn = turn.max_element() * TURN * size.max_element() > size.max_element();
    let axis = if by_turn { turn.max_position() } else { size.max_position() };
    let key = |place: u32| if by_turn { normal(place)[axis] } else { at(place)[axis] };
    let half = places.len().div_ceil(2 * WIDTH) * WIDTH;
    let order = |a: &u32, b: &u32| key(*a).total_cmp(&key(*b)).then(a.cmp(b));
    places.select_nth_unstable_by(half, order);
    let (first, second) = places.split_at_mut(half);
    divide(surfels, radii, first, bundles);
    divide(surfels, radii, second, bundles);
}

/// Sorts those first that are `low`, both sides in the order they had; returns how many are.
fn part(places: &mut [u32], low: impl Fn(u32) -> bool) -> usize {
    let (mut sorted, high): (Vec<u32>, Vec<u32>) = places.iter().partition(|&&place| low(place));
    let n = sorted.len();
    sorted.extend(high);
    places.copy_from_slice(&sorted);
    n
}

/// The widest gap between at most sixteen surfels, if it tells those that stray from the others: its axis
/// and middle.
fn gap(surfels: &Surfels, radii: &[f32], places: &[u32]) -> Option<(usize, f32)> {
    let radius = places.iter().map(|&place| radii[place as usize]).fold(0.0, f32::max);
    let mut sorted = [0.0; WIDTH];
    let sorted = &mut sorted[..places.len()];
    let mut widest = (APART * radius, None);
    for axis in 0..3 {
        for (value, &place) in sorted.iter_mut().zip(places) {
            *value = surfels.positions[place as usize][axis];
        }
        sorted.sort_unstable_by(f32::total_cmp);
        for pair in sorted.windows(2) {
            if pair[1] - pair[0] > widest.0 {
                widest = (pair[1] - pair[0], Some((axis, 0.5 * (pair[0] + pair[1]))));
            }
        }
    }
    widest.1
}

/// What tracing a bundle found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) occlusion: [f32; WIDTH],
    /// Variance of the noise of each, about.
    pub(crate) variance: f32,
    /// Directions that were looked in.
    pub(crate) n: u32,
    /// Rays traced: directions above the horizon, of all surfels.
    pub(crate) n_rays: u32,
    /// Sums of the weights of all directions and of those where something was met.
    sums: [[f32; WIDTH]; 2],
}

impl Found {
    /// Nothing yet.
    pub(crate) const NOTHING: Self = Self {
        occlusion: [0.0; WIDTH],
        variance: f32::INFINITY,
        n: 0,
        n_rays: 0,
        sums: [[0.0; WIDTH]; 2],
    };
}

/// Square of the difference between what two halves of the directions found, over the variance of
/// what both found: 4 where the halves have nothing to do with each other. Measured on four scans.
const OF_HALVES: f32 = 0.155;

/// What rays of bundles are traced with.
pub(crate) struct Tracer<'a> {
    pub(crate) surfels: &'a Surfels,
    /// Radii of the discs.
    pub(crate) radii: Vec<f32>,
    pub(crate) beams: Beams,
    pub(crate) reach: Reach,
    pub(crate) seed: u32,
}

impl Tracer<'_> {
    /// Traces a bundle on until it looked in this many directions, more than before: the variance follows
    /// from the new ones.
    pub(crate) fn trace(&self, bundle: &Bundle, found: &Found, until: u32) -> Found {
        dispatch!(Level::new(), simd => self.trace_on(simd, bundle, found, until))
    }

    #[inline(always)]
    fn trace_on<S: Simd>(&self, simd: S, bundle: &Bundle, found: &Found, until: u32) -> Found {
        let look = Outlook::of(self, bundle);
        let rays = Rays::new(simd, &look.origins);
        let scramble = scramble(self.surfels.order[bundle.places[0] as usize], self.seed);
        let mut open = Vec::with_capacity(64);
        let mut found = found.clone();
        let mut halves = found.sums;
        let (start, half) = (found.n, found.n.max(until / 2));
        for i in start..until {
            if i == half {
                halves = found.sums;
            }
            let point = sobol(i, scramble);
            let (direction, density) = look.direction(point);
            let (asked, weights) = look.weights(bundle, direction, density, self.reach);
            let reach = self.reach.distance;
            let hits = match asked {
                0 => 0,
                _ => self.beams.hits(simd, &rays, direction, asked, reach, &mut open),
            };
            found.n_rays += asked.count_ones();
            for (lane, &weight) in weights.iter().enumerate().take(bundle.n) {
                found.sums[0][lane] += weight;
                found.sums[1][lane] += if hits & 1 << lane != 0 { weight } else { 0.0 };
            }
        }
        found.n = until.max(found.n);
        found.sum_up(bundle.n, &halves);
        found
    }
}

impl Found {
    /// The occlusion, and its variance by the difference from that of the directions before.
    fn sum_up(&mut self, n: usize, halves: &[[f32; WIDTH]; 2]) {
        let ratio = |all: f32, met: f32| if all > 0.0 { met / all } else { 0.0 };
        let mut squares = 0.0;
        for lane in 0..n {
            let [all, met] = self.sums.map(|sums| sums[lane]);
            let [all_before, met_before] = halves.map(|sums| sums[lane]);
            self.occlusion[lane] = ratio(all, met);
            let before = ratio(all_before, met_before);
            let after = ratio(all - all_before, met - met_before);
            squares += (before - after) * (before - after);
        }
        // Where all rays agree there still is an error, of a ray or so.
        let least = 0.1 / (self.n.max(1) as f32).powi(2);
        self.variance = (OF_HALVES * squares / n as f32).max(least);
    }
}

/// What the surfels of a bundle look from and where to.
struct Outlook {
    origins: [[f32; WIDTH]; 3],
    normals: [Vec3; WIDTH],
    /// The mean normal and two vectors across.
    axes: [Vec3; 3],
    /// Sine of the largest angle between a normal and the mean.
    raise: f32,
}

impl Outlook {
    fn of(tracer: &Tracer<'_>, bundle: &Bundle) -> Self {
        let surfels = tracer.surfels;
        // The last stands in for what is missing.
        let place = |i: usize| bundle.places[i.min(bundle.n.saturating_sub(1))] as usize;
        let normals: [Vec3; WIDTH] = std::array::from_fn(|i| surfels.normals[place(i)]);
        let starts: [Vec3; WIDTH] = std::array::from_fn(|i| {
            surfels.positions[place(i)] + START * tracer.radii[place(i)] * normals[i]
        });
        let mean = normals[..bundle.n].iter().copied().sum::<Vec3>().normalize_or(normals[0]);
        let least = normals.iter().map(|normal| normal.dot(mean)).fold(1.0, f32::min);
        let (u, v) = mean.any_orthonormal_pair();
        Self {
            origins: std::array::from_fn(|axis| starts.map(|start| start[axis])),
            normals,
            axes: [mean, u, v],
            raise: if least > 0.0 { (1.0 - least * least).max(0.0).sqrt() } else { 1.0 },
        }
    }

    /// A direction for a point of the unit square, and its density: the cosine to the mean normal,
    /// raised so that the skies of all are in it.
    #[inline(always)]
    fn direction(&self, point: Vec2) -> (Vec3, f32) {
        let across = concentric(point);
        let square = across.length_squared().min(1.0);
        let density = (1.0 + self.raise) * (1.0 - square).sqrt();
        let height = density - self.raise;
        let stretch = ((1.0 - height * height).max(0.0) / square.max(1e-12)).sqrt();
        let [mean, u, v] = self.axes;
        (stretch * (across.x * u + across.y * v) + height * mean, density)
    }

    /// Which surfels have a direction in their sky, and its weights for them.
    #[inline(always)]
    fn weights(
        &self,
        bundle: &Bundle,
        direction: Vec3,
        density: f32,
        reach: Reach,
    ) -> (u64, [f32; WIDTH]) {
        let inverse = 1.0 / density.max(1e-6);
        let mut asked = 0;
        let mut weights = [0.0; WIDTH];
        let lanes = weights.iter_mut().zip(&self.normals).take(bundle.n).enumerate();
        for (lane, (weight, normal)) in lanes {
            let cosine = normal.dot(direction);
            if cosine > 0.0 {
                *weight = cosine * inverse;
                asked |= u64::from(reach.has(cosine)) << lane;
            }
        }
        (asked, weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_geometry::octree::Octree;
    use surfelshop_geometry::silent;

    #[test]
    fn strays_share_no_bundle_with_what_is_near() {
        let row = |i: u16| Vec3::X * 0.01 * f32::from(i);
        let strays = [Vec3::new(0.1, 3.0, 0.0), Vec3::new(0.1, 3.0, -2.0)];
        let positions: Vec<Vec3> = (0..37).map(row).chain(strays).collect();
        let n = positions.len();
        let surfels = Surfels {
            order: (0..n as u32).collect(),
            normals: vec![Vec3::Z; n],
            areas: vec![1e-4; n],
            context: Vec::new(),
            // One leaf, in the order of the positions.
            tree: Octree::build(&vec![Vec3::ZERO; n], n, &silent).unwrap(),
            unit: 1.0,
            n_refused: 0,
            n_strays: 0,
            positions,
        };
        let asked: Vec<usize> = (0..n).collect();
        let bundles = bundles(&surfels, &vec![0.007; n], &asked);
        let mut all: Vec<usize> = bundles.iter().flat_map(Bundle::places).collect();
        all.sort_unstable();
        assert_eq!(all, asked);
        for stray in [n - 2, n - 1] {
            let bundle = bundles.iter().find(|bundle| bundle.places().any(|place| place == stray));
            assert_eq!(bundle.map(|bundle| bundle.n), Some(1), "{stray}");
        }
        // The others are in whole bundles, but for the last.
        assert_eq!(bundles.len(), 5);
    }
}
