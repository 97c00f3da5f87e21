//! The decision which of the two ways round the signs of a scan are.

use super::evidence::Evidence;
use super::hints::Hints;
use std::ops::Range;

/// What was decided for a whole scan.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Verdict {
    /// Whether all signs are to be turned.
    pub(super) turn: bool,
    /// How sure that is, in [0, 1].
    pub(super) certainty: f32,
    /// Whether the surface is closed, or nearly, and faces what it encloses.
    pub(super) interior: bool,
}

/// Openness up to which a surface is closed, and from which on it is open.
const CLOSED: Range<f64> = 0.1..0.3;

/// Score that is sure.
const SURE: f64 = 0.5;

/// Mean lengths of free lines of sight within rooms and tunnels, metres.
const ROOM: Range<f64> = 1.0..40.0;

/// Openness up to which a room's floor and ceiling are there whichever way is up.
const COMPLETE: f64 = 0.08;

/// How steeply the open directions lead down from within a statue or a house, which have no bottom.
/// Gaps of a room are in its walls, too.
const BOTTOMLESS: f64 = -0.85;

/// Decides by the evidence for the signs as they are, which counts in this order: what the caller
/// says, where a device was, which way is up, then what the surface tells. A closed one faces
/// outwards, unless it encloses things or clutter, or is as large as a room. An open one faces the
/// side from where more of it is seen and from where it is convex, and what is flat faces along the
/// axes. The weights are chosen such that the scans and shapes that were tried come out right.
pub(super) fn decide(evidence: &Evidence, hints: &Hints, scale: f64) -> Verdict {
    let open = (evidence.openness - CLOSED.start) / (CLOSED.end - CLOSED.start);
    let open = open.clamp(0.0, 1.0);
    let limited = |value: f64| value.clamp(-1.0, 1.0);
    // Noise looks like clutter.
    let clutter = evidence.clutter * evidence.consistency * evidence.consistency;
    let mut score = (1.0 - open) * (0.3 * evidence.outward + limited(30.0 * clutter))
        + (1.0 - open) * limited(10.0 * evidence.enclosed)
        + open * (0.4 * evidence.outward + 0.4 * evidence.viewed + evidence.clutter)
        + 0.02 * evidence.positive
        + 2.0 * evidence.device;
    if hints.up.is_some() {
        // What little is open of a closed surface may be what nobody saw.
        score += open * 6.0 * evidence.upward;
    }
    let metres = hints.metres.map(|metres| f64::from(metres) * scale * evidence.free_path);
    let has_gaps = hints.up.is_some() && open < 1.0 && evidence.rise > BOTTOMLESS;
    let is_complete = evidence.openness < COMPLETE || has_gaps;
    if metres.is_some_and(|path| ROOM.contains(&path)) && is_complete {
        score -= 0.6 * evidence.outward.signum();
    }
    match hints.interior {
        Some(true) => score -= 10.0 * evidence.outward,
        Some(false) => score += 10.0 * evidence.outward,
        None => {}
    }
    let turn = score < 0.0;
    let outward = if turn { -evidence.outward } else { evidence.outward };
    let certainty = (score.abs() / SURE).min(1.0) as f32;
    Verdict { turn, certainty, interior: outward < -0.3 && open < 1.0 }
}
