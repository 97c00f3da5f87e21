//! Where rays meet, of a device that moves along a line.

use super::pulses::Pulse;
use glam::{DMat3, DVec3};

/// Fewest pulses of a piece: six numbers are fitted, and outliers told from the rest.
const FEWEST: usize = 32;
/// Rounds of weighing outliers down.
const ROUNDS: usize = 10;
/// Deviation that a place may have, as a share of the distance to the points: a tenth is 6 degrees, by which no
/// normal's side is wrong but of those that stand on edge.
const MOST_UNSURE: f64 = 0.1;
/// Typical distance that rays may pass the place at, as a share of its distance from the points: what rounding to
/// centimetres and a beam's width leave of rays 5 m long from 1000 m is a quarter of it.
const MOST_MISSED: f64 = 0.01;

/// A straight piece of a path.
pub(super) struct Fitted {
    /// Time of `place`.
    pub(super) middle: f64,
    pub(super) place: DVec3,
    pub(super) velocity: DVec3,
    /// Median distance to the points.
    pub(super) distance: f64,
    /// Median distance that rays pass it at.
    pub(super) miss: f64,
}

/// The normal equations of rays that meet at `place + velocity * time`: blocks of a symmetric matrix, and the
/// right side.
struct Equations {
    blocks: [DMat3; 3],
    right: [DVec3; 2],
}

/// What solves them, with the inverses that say how sure both are.
struct Solution {
    place: DVec3,
    velocity: DVec3,
    of_place: DMat3,
    of_velocity: DMat3,
}

impl Equations {
    fn add(&mut self, pulse: &Pulse, time: f64, weight: f64) {
        let ray = pulse.back / pulse.back.length();
        let outer = DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
        let across = (DMat3::IDENTITY - outer) * weight;
        let seen = across * pulse.first;
        for (block, factor) in self.blocks.iter_mut().zip([1.0, time, time * time]) {
            *block += across * factor;
        }
        self.right[0] += seen;
        self.right[1] += seen * time;
    }

    /// By blocks; `None` where the rays do not say.
    fn solved(&self) -> Option<Solution> {
        let [places, both, velocities] = self.blocks;
        let [of_places, of_velocities] = [inverse(places)?, inverse(velocities)?];
        let of_velocity = inverse(velocities - both * of_places * both)?;
        let of_place = inverse(places - both * of_velocities * both)?;
        let velocity = of_velocity * (self.right[1] - both * of_places * self.right[0]);
        let place = of_places * (self.right[0] - both * velocity);
        Some(Solution { place, velocity, of_place, of_velocity })
    }
}

fn inverse(matrix: DMat3) -> Option<DMat3> {
    let determinant = matrix.determinant();
    (determinant.is_finite() && determinant > 0.0)
        .then(|| matrix.inverse())
        .filter(DMat3::is_finite)
}

/// Where the rays of a piece meet; `None` where they do not, or do not say where.
pub(super) fn fitted(pulses: &[Pulse]) -> Option<Fitted> {
    if pulses.len() < FEWEST {
        return None;
    }
    let n = pulses.len() as f64;
    let middle = pulses.iter().map(|pulse| pulse.time / n).sum::<f64>();
    let half = pulses.iter().map(|pulse| (pulse.time - middle).abs()).fold(0.0, f64::max);
    // A ray is as sure as the returns that span it lie apart.
    let spans: Vec<f64> = pulses.iter().map(|pulse| pulse.back.length()).collect();
    let mut robust = vec![1.0; pulses.len()];
    let mut found = None;
    for _ in 0..ROUNDS {
        let mut equations = Equations { blocks: [DMat3::ZERO; 3], right: [DVec3::ZERO; 2] };
        for ((pulse, span), robust) in pulses.iter().zip(&spans).zip(&robust) {
            equations.add(pulse, pulse.time - middle, robust * span * span);
        }
        let solution = equations.solved()?;
        let seen = |pulse| Ray::seen(pulse, &solution, middle);
        let rays: Vec<Ray> = pulses.iter().map(seen).collect();
        weigh(&rays, &spans, &mut robust)?;
        found = Some((solution, rays));
    }
    let (solution, rays) = found?;
    let errors = rays.iter().zip(&spans).zip(&robust);
    let squares: f64 = errors.map(|((ray, span), robust)| robust * (ray.miss * span).powi(2)).sum();
    let variance = squares / robust.iter().sum::<f64>().max(1.0);
    let spread = solution.of_place + solution.of_velocity * (half * half);
    let unsure = (variance * (0..3).map(|axis| spread.col(axis)[axis]).sum::<f64>()).sqrt();
    let distance = median(rays.iter().map(|ray| ray.distance).collect())?;
    let miss = median(rays.iter().map(|ray| ray.miss).collect())?;
    // A device stands where rays come from.
    let is_known =
        distance > 0.0 && unsure <= MOST_UNSURE * distance && miss <= MOST_MISSED * distance;
    is_known.then_some(Fitted {
        middle,
        place: solution.place,
        velocity: solution.velocity,
        distance,
        miss,
    })
}

/// Weighs rays by Cauchy's function of their errors, at twice the median of these; `None` where one has none.
fn weigh(rays: &[Ray], spans: &[f64], robust: &mut [f64]) -> Option<()> {
    // That of a return across the ray, of which that at the device is a multiple.
    let error = |(ray, span): (&Ray, &f64)| ray.miss * span / ray.distance.abs();
    let errors: Vec<f64> = rays.iter().zip(spans).map(error).collect();
    // Rays without an error are all of equal weight.
    let exact = 1e-9 * spans.iter().copied().fold(0.0, f64::max);
    let typical = median(errors.clone())?.max(exact);
    for (robust, error) in robust.iter_mut().zip(&errors) {
        *robust = 1.0 / (1.0 + (error / (2.0 * typical)).powi(2));
    }
    Some(())
}

/// How a ray passes the place of its device.
struct Ray {
    /// From its first return, along it.
    distance: f64,
    /// Across it.
    miss: f64,
}

impl Ray {
    fn seen(pulse: &Pulse, solution: &Solution, middle: f64) -> Self {
        let place = solution.place + solution.velocity * (pulse.time - middle);
        let (to_device, ray) = (place - pulse.first, pulse.back / pulse.back.length());
        let distance = to_device.dot(ray);
        Self { distance, miss: (to_device - ray * distance).length() }
    }
}

/// `None` of none, and where one is not a number.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() || values.iter().any(|value| value.is_nan()) {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
