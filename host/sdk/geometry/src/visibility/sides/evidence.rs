//! What tells whether the front is really in front: the signs of a scan are found up to turning all of
//! them round.

use super::rays::{Ray, Sky};

/// Numbers about a choice of signs; with all signs turned, those in [-1, 1] change theirs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// Share of the surfels that see fronts on both sides, less that of those that see backs: a sheet
    /// within a room sees it on both sides; nothing lies within a solid body.
    pub(super) clutter: f64,
    /// How much more of the front looks up than down into the sky, and of the back down than up.
    pub(super) upward: f64,
    /// How much more of the front than of the back looks into the sky.
    pub(super) outward: f64,
    /// Share of the rays into the sky on that side where there are fewer.
    pub(super) openness: f64,
    /// How steeply these lead up: -1 for straight down, 0 for level or all directions.
    pub(super) rise: f64,
    /// Mean length of the other rays on that side, in units of the box.
    pub(super) free_path: f64,
    /// Share of the surfels whose front sees fronts and whose back sees backs, of those that see any
    /// on both sides.
    pub(super) consistency: f64,
    /// Share of the surfels whose backs lie in small regions, less that whose fronts do: things have
    /// an inside that nobody sees.
    pub(super) enclosed: f64,
    /// How much more the best place sees of the fronts than the best place for backs sees of backs.
    pub(super) viewed: f64,
    /// How much the place of a device sees of the fronts, less of the backs; 0 where none is known.
    pub(super) device: f64,
    /// The component of the mean normal with the largest absolute value.
    pub(super) positive: f64,
}

/// Weights of what a side of a surfel sees.
#[derive(Clone, Copy, Default)]
struct Outlook {
    /// Fronts less backs.
    net: f32,
    total: f32,
}

impl Outlook {
    fn add(&mut self, front: bool, weight: f32) {
        self.net += if front { weight } else { -weight };
        self.total += weight;
    }

    /// In [-1, 1]; `None` for a side that sees nothing.
    fn mean(self) -> Option<f32> {
        (self.total > 0.0).then(|| self.net / self.total)
    }
}

/// Sums over the rays that leave one side.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    escaped: f64,
    upward: f64,
    steepness: f64,
    met: f64,
    length: f64,
}

/// Judges signs of surfels and of parts of the sky by the rays between them, whose lengths are
/// `length` where they end at a surfel.
pub(super) fn judge(
    n_surfels: usize,
    rays: &[Ray],
    signs: &[bool],
    length: impl Fn(&Ray) -> f64,
) -> Evidence {
    let mut outlooks = vec![[Outlook::default(); 2]; n_surfels];
    let mut sides = [Side::default(); 2];
    for ray in rays.iter().filter(|ray| (ray.to as usize) < n_surfels + Sky::PARTS) {
        let (from, to) = (ray.from as usize, ray.to as usize);
        let leaves = ray.leaves_front == signs[from];
        let arrives = ray.arrives_front == signs[to];
        let weight = f32::from(ray.weight);
        outlooks[from][usize::from(leaves)].add(arrives, weight);
        let side = &mut sides[usize::from(leaves)];
        if to < n_surfels {
            outlooks[to][usize::from(arrives)].add(leaves, weight);
            side.met += 1.0;
            side.length += length(ray);
        } else {
            let height = Sky::height(to - n_surfels);
            side.escaped += 1.0;
            side.upward += height;
            side.steepness += height.abs();
        }
    }
    let [back, front] = sides;
    let share = |side: Side| side.escaped / (side.escaped + side.met).max(1.0);
    let closed = if share(front) < share(back) { front } else { back };
    let ratio = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 0.0 };
    let (consistency, clutter) = agreement(&outlooks);
    Evidence {
        clutter,
        upward: ratio(front.upward - back.upward, front.steepness + back.steepness),
        outward: ratio(front.escaped - back.escaped, front.escaped + back.escaped),
        openness: share(closed),
        rise: ratio(closed.upward, closed.steepness),
        free_path: ratio(closed.length, closed.met),
        consistency,
        ..Evidence::default()
    }
}

/// The shares of surfels that see what they should on both sides, and of clutter.
fn agreement(outlooks: &[[Outlook; 2]]) -> (f64, f64) {
    /// Mean outlooks beyond which a side is clear.
    const CLEAR: f32 = 0.3;
    const VERY_CLEAR: f32 = 0.5;
    let (mut consistent, mut fronts, mut backs, mut known) = (0.0, 0.0, 0.0, 0.0);
    for outlook in outlooks {
        let (Some(back), Some(front)) = (outlook[0].mean(), outlook[1].mean()) else { continue };
        known += 1.0;
        consistent += f64::from(u8::from(front > CLEAR && back < -CLEAR));
        fronts += f64::from(u8::from(front.min(back) > VERY_CLEAR));
        backs += f64::from(u8::from(front.max(back) < -VERY_CLEAR));
    }
    let n = outlooks.len().max(1) as f64;
    (consistent / f64::max(known, 1.0), (fronts - backs) / n)
}
