//! Where a place lies along a stroke and across it.

use surfelshop_api::glam::{DQuat, DVec2, DVec3};
use surfelshop_api::{Stroke, StrokeSample};

/// A stroke as a band of twice its radius, with a picture that repeats along it; of a single sample a square around that.
pub(super) struct Ribbon<'a> {
    stroke: &'a Stroke,
    /// Lengths along the line to each sample, scene units.
    lengths: Vec<f64>,
    /// Width over height of the picture.
    aspect: f64,
    /// How far a single picture is turned, clockwise, radians.
    turn: f64,
}

/// Where a place lies on a ribbon.
#[derive(Clone, Copy, Debug)]
pub(super) struct RibbonPlace {
    /// To the right and upwards from the lower left corner of the picture, in its heights.
    pub(super) picture: DVec2,
    /// What lies to the right of the picture and above, unit vectors.
    pub(super) axes: [DVec3; 2],
    /// From the nearest place on the line, scene units.
    pub(super) away: DVec3,
}

impl<'a> Ribbon<'a> {
    /// That of a stroke; none where it has no sample.
    pub(super) fn of(stroke: &'a Stroke, aspect: f64, turn: f64) -> Option<Self> {
        let mut lengths = vec![0.0];
        for ends in stroke.samples.windows(2) {
            let before = lengths.last().copied().unwrap_or_default();
            lengths.push(before + ends[0].place.distance(ends[1].place));
        }
        (!stroke.samples.is_empty()).then_some(Self { stroke, lengths, aspect, turn })
    }

    /// Whether there is a line, along which the picture repeats.
    pub(super) fn repeats(&self) -> bool {
        self.lengths.last().is_some_and(|length| *length > 0.0)
    }

    /// Height of the picture, scene units.
    pub(super) fn height(&self) -> f64 {
        match self.repeats() {
            // As wide as the band.
            true => 2.0 * self.stroke.radius / self.aspect,
            // All of it within the square.
            false => 2.0 * self.stroke.radius / self.aspect.max(1.0),
        }
    }

    /// Where a place lies, by the segment that is nearest.
    pub(super) fn at(&self, place: DVec3) -> Option<RibbonPlace> {
        let samples = &self.stroke.samples;
        let segments = samples.windows(2).enumerate().filter_map(|(i, ends)| {
            let along = ends[1].place - ends[0].place;
            let share = (place - ends[0].place).dot(along) / along.length_squared();
            share.is_finite().then(|| {
                let away = place - (ends[0].place + along * share.clamp(0.0, 1.0));
                (away.length_squared(), i, share, away)
            })
        });
        match segments.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, i, share, away)) => self.on_segment(i, share, away),
            None => samples.first().and_then(|only| self.on_stamp(only, place)),
        }
    }

    fn on_segment(&self, i: usize, share: f64, away: DVec3) -> Option<RibbonPlace> {
        let [from, to] = [&self.stroke.samples[i], &self.stroke.samples[i + 1]];
        let along = to.place - from.place;
        // Before the first sample and behind the last one the band goes on.
        let low = if i == 0 { f64::NEG_INFINITY } else { 0.0 };
        let high = if i + 2 == self.stroke.samples.len() { f64::INFINITY } else { 1.0 };
        let length = self.lengths[i] + share.clamp(low, high) * along.length();
        let up = along.try_normalize()?;
        let normal = from.normal.lerp(to.normal, share.clamp(0.0, 1.0) as f32).as_dvec3();
        let right = up.cross(normal).try_normalize()?;
        let across = away.dot(right) / (2.0 * self.stroke.radius) + 0.5;
        let upwards = (length / self.height()).rem_euclid(1.0);
        Some(RibbonPlace {
            picture: DVec2::new(across * self.aspect, upwards),
            axes: [right, up],
            away,
        })
    }

    /// Around a single sample. The picture's top lies towards y, and towards -z where the surface faces y; it is turned from
    /// there.
    fn on_stamp(&self, only: &StrokeSample, place: DVec3) -> Option<RibbonPlace> {
        let away = place - only.place;
        let normal = only.normal.as_dvec3().try_normalize()?;
        let upright = if normal.y.abs() < 0.9 { DVec3::Y } else { DVec3::NEG_Z };
        let up = upright.reject_from(normal).try_normalize()?;
        let up = DQuat::from_axis_angle(normal, -self.turn) * up;
        let right = up.cross(normal);
        let height = self.height();
        let middle = 0.5 * DVec2::new(self.aspect, 1.0);
        let picture = middle + DVec2::new(away.dot(right), away.dot(up)) / height;
        Some(RibbonPlace { picture, axes: [right, up], away })
    }
}
