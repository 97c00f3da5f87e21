//! Surfels that look in the same directions.

use crate::beams::{Beams, Rays, WIDTH};
use crate::form_factor::Reach;
use crate::rays::{START, concentric, scramble, sobol};
use crate::surfels::Surfels;
use fearless_simd::{Level, Simd, dispatch};
use surfelshop_api::glam::Vec3;

/// Surfels of a node that are divided into bundles together.
const TOGETHER: usize = 128;

/// Cosine of the largest angle between the normals of a bundle and that of its first surfel, where
/// there are enough.
const ALIKE: [f32; 3] = [0.9, 0.6, -1.0];

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
pub(crate) fn bundles(surfels: &Surfels, asked: &[usize]) -> Vec<Bundle> {
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
            divide(surfels, some, &mut bundles);
        }
    }
    bundles
}

fn divide(surfels: &Surfels, places: &[usize], bundles: &mut Vec<Bundle>) {
    let mut left: Vec<usize> = places.to_vec();
    for (round, least) in ALIKE.into_iter().enumerate() {
        let is_last = round + 1 == ALIKE.len();
        let mut others = Vec::new();
        while let Some(&first) = left.first() {
            let normal = surfels.normals[first];
            let mut bundle = Bundle { places: [0; WIDTH], n: 0 };
            let is_alike = |place: usize| surfels.normals[place].dot(normal) >= least;
            let found: Vec<usize> =
                left.iter().copied().filter(|&place| is_alike(place)).take(WIDTH).collect();
            if found.len() < WIDTH && !is_last {
                // Wait for the next round
                if found.len() < WIDTH * 3 / 4 {
                    others.push(first);
                    left.remove(0);
                    continue;
                }
            }
            for &place in &found {
                bundle.places[bundle.n] = place as u32;
                bundle.n += 1;
            }
            left.retain(|place| !found.contains(place));
            bundles.push(bundle);
        }
        left = others;
    }
}

/// What tracing a bundle found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) occlusion: [f32; WIDTH],
    /// Variance of the noise of each, about.
    pub(crate) variance: f32,
    /// Variance of the noise of their mean, about.
    pub(crate) shared: f32,
    /// Directions
    pub(crate) n_directions: u32,
    pub(crate) n_rays: u32,
}

/// How to trace.
pub(crate) struct Tracer<'a> {
    pub(crate) surfels: &'a Surfels,
    pub(crate) radii: &'a [f32],
    pub(crate) beams: Beams,
    pub(crate) reach: Reach,
    pub(crate) seed: u32,
    pub(crate) least: u32,
    pub(crate) most: u32,
    /// Standard error at which a bundle gets no more.
    pub(crate) error: f32,
}

impl Tracer<'_> {
    pub(crate) fn trace(&self, bundle: &Bundle) -> Found {
        dispatch!(Level::new(), simd => self.trace_on(simd, bundle))
    }

    #[inline(always)]
    fn trace_on<S: Simd>(&self, simd: S, bundle: &Bundle) -> Found {
        let place = |i: usize| bundle.places[i.min(bundle.n - 1)] as usize;
        let normals: [Vec3; WIDTH] = std::array::from_fn(|i| self.surfels.normals[place(i)]);
        let origins: [Vec3; WIDTH] = std::array::from_fn(|i| {
            self.surfels.positions[place(i)] + START * self.radii[place(i)] * normals[i]
        });
        let lanes: [[f32; WIDTH]; 3] =
            std::array::from_fn(|axis| std::array::from_fn(|i| origins[i][axis]));
        let rays = Rays::new(simd, &lanes);
        let mean = normals[..bundle.n].iter().copied().sum::<Vec3>().normalize_or(normals[0]);
        let least = normals.iter().map(|n| n.dot(mean)).fold(1.0, f32::min);
        // Directions follow the cosine to the mean normal, raised so that every surfel's sky is in.
        let raise = if least > 0.0 { (1.0 - least * least).max(0.0).sqrt() } else { 1.0 };
        let (u, v) = mean.any_orthonormal_pair();
        let scramble = scramble(self.surfels.order[place(0)], self.seed);
        let mut open = Vec::with_capacity(64);
        let mut sums = [[0.0f32; WIDTH]; 2];
        let mut halves;
        let (mut n, mut n_rays) = (0u32, 0u32);
        let (mut variance, mut shared) = (0.0, 0.0);
        while n < self.most {
            let until = if n == 0 { self.least.clamp(1, self.most) } else { (2 * n).min(self.most) };
            halves = sums;
            for i in n..until {
                if n == 0 && i == until / 2 {
                    halves = sums;
                }
                let across = concentric(sobol(i, scramble));
                let square = across.length_squared().min(1.0);
                let height = (1.0 + raise) * (1.0 - square).max(0.0).sqrt() - raise;
                let stretch = ((1.0 - height * height).max(0.0) / square.max(1e-12)).sqrt();
                let direction = stretch * (across.x * u + across.y * v) + height * mean;
                let density = height + raise;
                let mut asked = 0u64;
                let mut weights = [0.0f32; WIDTH];
                for lane in 0..bundle.n {
                    let cosine = normals[lane].dot(direction);
                    if cosine > 0.0 {
                        weights[lane] = cosine / density.max(1e-6);
                        if self.reach.has(cosine) {
                            asked |= 1 << lane;
                        }
                    }
                }
                n_rays += asked.count_ones();
                let hits = self.beams.hits(
                    simd,
                    &rays,
                    direction,
                    asked,
                    self.reach.distance,
                    &mut open,
                );
                for lane in 0..bundle.n {
                    sums[0][lane] += weights[lane];
                    if hits & (1 << lane) != 0 {
                        sums[1][lane] += weights[lane];
                    }
                }
            }
            n = until;
            let (mut total, mut sum) = (0.0, 0.0);
            for lane in 0..bundle.n {
                let ratio = |a: f32, b: f32| if b > 0.0 { a / b } else { 0.0 };
                let first = ratio(halves[1][lane], halves[0][lane]);
                let second =
                    ratio(sums[1][lane] - halves[1][lane], sums[0][lane] - halves[0][lane]);
                total += (first - second) * (first - second);
                sum += first - second;
            }
            variance = 0.14 * total / bundle.n as f32;
            shared = 0.14 * (sum / bundle.n as f32) * (sum / bundle.n as f32);
            if variance <= self.error * self.error {
                break;
            }
        }
        let ratio = |lane: usize| {
            if sums[0][lane] > 0.0 { sums[1][lane] / sums[0][lane] } else { 0.0 }
        };
        Found {
            occlusion: std::array::from_fn(ratio),
            variance,
            shared,
            n_directions: n,
            n_rays,
        }
    }
}
