//! The decision which of the two ways round the signs of a scan are.

use super::Hints;
use super::evidence::Evidence;

/// What was decided for a whole scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdict {
    /// Whether all signs are to be turned.
    pub(super) turn: bool,
    /// How sure that is, in [0, 1].
    pub(super) certainty: f32,
    /// Whether the scan is seen from within.
    pub(super) interior: bool,
    pub(super) log: [f64; 9],
}

/// Openness up to which a surface is closed, and from which on it is open.
const CLOSED: [f64; 2] = [0.1, 0.3];

/// Score that is sure.
const SURE: f64 = 0.5;

/// Mean lengths of free lines of sight within rooms and tunnels, metres.
const ROOM: std::ops::Range<f64> = 1.0..40.0;

/// Openness up to which a room's floor and ceiling are there; a statue or a house from outside has no
/// bottom.
const COMPLETE: f64 = 0.08;

/// Decides by the evidence for the signs as they are.
pub(super) fn decide(
    evidence: &Evidence,
    connected: f64,
    viewed: f64,
    device: f64,
    free_path: Option<f64>,
    hints: &Hints,
) -> Verdict {
    let open = ((evidence.openness - CLOSED[0]) / (CLOSED[1] - CLOSED[0])).clamp(0.0, 1.0);
    let limited = |value: f64| value.clamp(-1.0, 1.0);
    let mut score = 0.3 * evidence.outward;
    if hints.up.is_some() {
        score += 6.0 * evidence.upward;
    }
    // Within what is closed, regions and clutter tell rooms from bodies.
    score += (1.0 - open) * (limited(10.0 * connected) + limited(5.0 * evidence.clutter));
    score += open * viewed;
    score += 2.0 * device;
    let is_room = free_path.is_some_and(|path| ROOM.contains(&path));
    if is_room && evidence.openness < COMPLETE {
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
    // The front looks into the sky much less than the back.
    let interior = outward < -0.3 && open < 1.0;
    let log = [score, evidence.outward, evidence.upward, evidence.clutter, connected, viewed, evidence.openness, evidence.free_path, evidence.consistency];
    Verdict { turn, certainty, interior, log }
}
