//! Which side of a scan's surface faces free space: what a normal means on a scan, where nothing but
//! the points is known.
//!
//! A fitted plane has two sides; [`by_visibility`] takes the one that can be seen.

mod couplings;
mod evidence;
mod hints;
mod labels;
mod rays;
mod regions;
mod spread;
mod verdict;
mod viewpoints;

use super::surfels::{self, Choice, Surfels};
use crate::progress::{Cancelled, Progress, part, report};
use glam::Vec3;
pub use hints::Hints;
use labels::Labels;

/// What [`by_visibility`] did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sides {
    /// Normals that were turned.
    pub turned: usize,
    /// Normals whose side most evidence is for.
    pub decided: usize,
    /// Normals whose side is little better than a guess, as those of strays far apart from the rest; those without a
    /// direction or a finite position are in neither count.
    pub uncertain: usize,
    /// Whether the surface is closed, or nearly, and faces what it encloses.
    pub interior: bool,
    /// How sure it is which way round the whole scan is, in [0, 1]: below about 0.2 a guess, however
    /// sure the sides are relative to each other.
    pub certainty: f32,
    /// For each position how much of the evidence is for its side, in [0, 1], given that the whole is the
    /// right way round; 0 where there is none.
    pub confidence: Vec<f32>,
}

/// Confidence from which on a side is decided.
const DECIDED: f32 = 0.25;

/// Up to so many points all find their sides themselves; of more a 64th does, but no fewer than
/// this, and the others follow those around them.
const DECIDING: usize = 100_000;

/// Consistency below which points lie in a layer thicker than their spacing, and fewer are tried.
const NOISY: f64 = 0.4;

/// How much more consistent fewer points must be.
const BETTER: f64 = 0.2;

/// Bytes that [`by_visibility`] takes at most for so many points, besides what it is given: 826 for each that decides,
/// measured with 60 000 points that lie at random in a cube, the worst case; 70 for each among which these are
/// chosen and 40 for each of those that follow at a time; and 4 for each point.
#[must_use]
pub fn memory(n: usize) -> u64 {
    let deciding = DECIDING.max(n / 64);
    let bytes = |n: usize, each: u64| (n as u64).saturating_mul(each);
    bytes(n.min(deciding), 900)
        .saturating_add(bytes(n.min(surfels::CANDIDATES * deciding), 70))
        .saturating_add(bytes(n.min(spread::BLOCK), 40))
        .saturating_add(bytes(n, 4))
}

/// Turns normals to the side that can be seen, whatever their signs were; lengths stay.
///
/// Rays between surfels say that two sides look into the same free space, neighbours that a surface
/// goes on, lines to good viewpoints and into the sky both for all that share them. The signs that
/// fulfil most of it are found up to turning all at once, which is decided by what is known and else
/// by what encloses what. Normals may have any sign and noise; they are unit planes through points that
/// lie in layers not much thicker than their spacing.
///
/// Normals without a direction, and those of positions that are not finite, are left alone. Points of
/// thin sheets that are free on both sides, such as leaves, may face either way. O(n log n) time:
/// measured 3.5 s of one processor for a million points beside other work, of which 2.5 s are for the first 100 000.
///
/// # Errors
/// Where `progress` asks to stop; `normals` are then unchanged.
pub fn by_visibility(
    positions: &[Vec3],
    normals: &mut [Vec3],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<Sides, Cancelled> {
    let labels = labelled(positions, normals, hints, &part(progress, 0.0..0.9))?;
    let found = spread::to_all(&labels, positions, normals, &part(progress, 0.9..1.0))?;
    report(progress, 1.0)?;
    let verdict = labels.verdict;
    let mut sides =
        Sides { interior: verdict.interior, certainty: verdict.certainty, ..Sides::default() };
    for (normal, found) in normals.iter_mut().zip(&found).filter(|(_, found)| found.is_known()) {
        if found.turn() {
            *normal = -*normal;
            sides.turned += 1;
        }
        let is_decided = found.confidence() >= DECIDED;
        *(if is_decided { &mut sides.decided } else { &mut sides.uncertain }) += 1;
    }
    // In the same memory.
    sides.confidence = found.into_iter().map(|found| found.confidence()).collect();
    Ok(sides)
}

/// The signs of the surfels that decide, of fewer where points are noisy.
fn labelled(
    positions: &[Vec3],
    normals: &[Vec3],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<Labels, Cancelled> {
    let up = hints.up.and_then(Vec3::try_normalize);
    let hints = Hints { up, ..*hints };
    let level = |count: usize, refit: bool, progress: Progress<'_>| {
        let choice = Choice { count, refit };
        let surfels = Surfels::choose(positions, normals, choice, &part(progress, 0.0..0.3))?;
        labels::find(surfels, &hints, &part(progress, 0.3..1.0))
    };
    let labels = level(DECIDING.max(positions.len() / 64), false, &part(progress, 0.0..0.9))?;
    let n = labels.surfels.all.len();
    // A fifth of the points is 2.2 times as far apart.
    if labels.evidence.consistency < NOISY && n > 2000 {
        let fewer = level(n / 5, true, &part(progress, 0.9..1.0))?;
        if fewer.evidence.consistency > labels.evidence.consistency + BETTER {
            return Ok(fewer);
        }
    }
    Ok(labels)
}

#[cfg(test)]
mod tests;
