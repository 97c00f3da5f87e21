//! Measures whether discs cover a figure: rays from outside that meet the figure must meet a disc
//! there too.

use glam::DVec3;
use rayon::prelude::*;

use crate::figure::Figure;
use crate::grid::Grid;
use crate::noise::Random;

/// A ray is counted that gets this deep into the figure. Less is an outline that lies a third of a
/// pixel further in, in a picture of 640 pixels that shows the whole sample.
const DEPTH: f64 = 1e-3;

/// A disc counts that is met no farther behind the figure than this, about two spacings: the far
/// side of a blade may stand in for its near side, the ground behind a hole may not.
const BEHIND: f64 = 0.02;

/// Share of the field by which a ray advances. Fields are somewhat steeper than distances where
/// they are bent, and a longer step would skip thin parts.
const STRIDE: f64 = 0.6;

/// Places along a ray that discs are looked for around, about 4 hundredths apart.
const STEPS_BACK: u32 = 8;

/// Side of the cells that discs are found by.
const CELL: f64 = 0.02;

/// A surfel as it is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Middle.
    pub center: DVec3,
    /// Unit length.
    pub normal: DVec3,
    /// Greater than zero.
    pub radius: f64,
}

/// A ray that passed the discs and met the figure.
#[derive(Clone, Copy, Debug)]
pub struct Miss {
    /// Where the ray starts.
    pub start: DVec3,
    /// Where it met the figure.
    pub point: DVec3,
}

/// What rays met.
#[derive(Clone, Debug)]
pub struct Coverage {
    /// Rays that met the figure.
    pub n_met: usize,
    /// Those of them that met no disc there.
    pub missed: Vec<Miss>,
}

/// Sends rays from all around through random places of the figure's box.
#[must_use]
pub fn measure(figure: &Figure, discs: &[Disc], n_rays: u64, seed: u64) -> Coverage {
    let (low, high) = figure.bounds();
    let around = (high - low).length();
    let mut grid = Grid::new(CELL);
    for (index, disc) in discs.iter().enumerate() {
        grid.insert(disc.center, index);
    }
    let widest = discs.iter().map(|disc| disc.radius).fold(0.0, f64::max);
    let cast = |number: u64| {
        let mut random = Random::new(seed.wrapping_add(number.wrapping_mul(0xd134_2543_de82_ef95)));
        let place = (random.in_cube() + DVec3::ONE) / 2.0;
        let direction = on_sphere(&mut random);
        let start = low + (high - low) * place - direction * around;
        let end = enters(figure, start, direction, 2.0 * around)?;
        let covered = is_covered(discs, &grid, widest, start, direction, end);
        Some((Miss { start, point: start + direction * end }, covered))
    };
    let met: Vec<_> = (0..n_rays).into_par_iter().filter_map(cast).collect();
    let missed = met.iter().filter(|(_, covered)| !covered).map(|(ray, _)| *ray).collect();
    Coverage { n_met: met.len(), missed }
}

/// A direction, all being as likely.
fn on_sphere(random: &mut Random) -> DVec3 {
    loop {
        let point = random.in_cube();
        let squared = point.length_squared();
        if squared <= 1.0 && squared > 1e-4 {
            return point / squared.sqrt();
        }
    }
}

/// Distance at which a ray gets below the figure's surface.
fn enters(figure: &Figure, start: DVec3, direction: DVec3, farthest: f64) -> Option<f64> {
    let mut along = 0.0;
    while along < farthest {
        let distance = figure.distance(start + direction * along) + DEPTH;
        if distance < DEPTH / 10.0 {
            return Some(along);
        }
        along += distance * STRIDE;
    }
    None
}

/// Whether a disc is met near the end of a ray or some lengths of a disc before it.
fn is_covered(
    discs: &[Disc],
    grid: &Grid,
    widest: f64,
    start: DVec3,
    direction: DVec3,
    end: f64,
) -> bool {
    let meets = |disc: &Disc| {
        let along = disc.normal.dot(disc.center - start) / disc.normal.dot(direction);
        let point = start + direction * along;
        along <= end + BEHIND && point.distance_squared(disc.center) <= disc.radius * disc.radius
    };
    // Most rays meet a disc at their end. Some are stopped a little before, by discs that stand out
    // of a part which they pass closely.
    let step = BEHIND + widest;
    (0..STEPS_BACK).any(|back| {
        let middle = start + direction * (end - f64::from(back) * step);
        grid.near(middle, step + widest).any(|index| meets(&discs[index]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Pebble;
    use crate::sample::sample;

    #[test]
    fn missing_discs_are_found() {
        let pebble = Pebble::new(DVec3::ZERO, 0.1, &mut Random::new(3));
        let figure = Figure::new(vec![Box::new(pebble)]);
        let mut discs: Vec<_> = sample(&figure)
            .iter()
            .map(|(sample, radius)| Disc {
                center: sample.position,
                normal: sample.normal,
                radius: *radius,
            })
            .collect();
        let whole = measure(&figure, &discs, 20_000, 1);
        assert!(whole.n_met > 5_000 && whole.missed.is_empty(), "{whole:?}");
        let hole = discs[0].center;
        discs.retain(|disc| disc.center.distance(hole) > 0.02);
        let missed = measure(&figure, &discs, 20_000, 1).missed;
        assert!(!missed.is_empty());
        assert!(missed.iter().all(|miss| miss.point.distance(hole) < 0.03));
    }
}
