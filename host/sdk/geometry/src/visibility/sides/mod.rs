//! Which side of a scan's surface faces free space.

mod couplings;
mod evidence;
mod frame;
mod labels;
mod rays;
mod regions;
mod sets;
mod signs;
mod spread;
mod surfels;
mod verdict;
mod viewpoints;

use crate::progress::{Cancelled, Progress, part, report};
use glam::Vec3;
use surfels::{Choice, Surfels};

/// What is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// up
    pub up: Option<Vec3>,
    /// metres
    pub metres: Option<f32>,
    /// device
    pub device: Option<Vec3>,
    /// interior
    pub interior: Option<bool>,
}

/// result
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sides {
    /// turned
    pub turned: usize,
    /// decided
    pub decided: usize,
    /// uncertain
    pub uncertain: usize,
    /// interior
    pub interior: bool,
    /// certainty
    pub certainty: f32,
    /// confidence
    pub confidence: Vec<f32>,
    /// log
    pub log: String,
}

/// by visibility
pub fn by_visibility(
    positions: &[Vec3],
    normals: &mut [Vec3],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<Sides, Cancelled> {
    let count = 100_000.max(positions.len() / 8);
    let level = |count: usize, refit: bool, progress: Progress<'_>| {
        let surfels = Surfels::choose(positions, normals, Choice { count, refit }, &part(progress, 0.0..0.3))?;
        labels::find(surfels, hints, &part(progress, 0.3..1.0))
    };
    let mut labels = level(count, false, &part(progress, 0.0..0.6))?;
    let mut log = format!("{} {:.3} {:.3?}", labels.surfels.all.len(), labels.verdict.score, labels.evidence);
    if labels.evidence.consistency < 0.4 && labels.surfels.all.len() > 2_000 {
        let coarse = level(labels.surfels.all.len() / 5, true, &part(progress, 0.6..0.9))?;
        log += &format!(" coarse {} {:.3} {:.3?}", coarse.surfels.all.len(), coarse.verdict.score, coarse.evidence);
        if coarse.evidence.consistency > labels.evidence.consistency + 0.2 {
            labels = coarse;
            log += " taken";
        }
    }
    let found = spread::to_all(&labels, positions, normals, &part(progress, 0.9..1.0))?;
    let mut sides = Sides { interior: labels.verdict.interior, certainty: labels.verdict.certainty, log, ..Sides::default() };
    for (normal, found) in normals.iter_mut().zip(&found) {
        let Some(found) = found else { continue };
        if found.turn {
            *normal = -*normal;
            sides.turned += 1;
        }
        if found.confidence > 0.25 { sides.decided += 1 } else { sides.uncertain += 1 }
    }
    sides.confidence = found.iter().map(|f| f.map_or(0.0, |f| f.confidence)).collect();
    report(progress, 1.0)?;
    Ok(sides)
}
