//! The version of the format, its bounds, and what it takes where a key is left out.

/// The version of the format, the value of the key `format`.
pub const FORMAT: i64 = 1;

/// The most bytes a scene may have. Scenes name clouds and do not contain them.
pub const LARGEST_FILE: u64 = 4 << 20;

/// The most clouds of a scene: each takes some 60 kB and a tenth of a millisecond a frame besides what it holds,
/// measured with 100,000.
pub const MOST_CLOUDS: usize = 4096;

/// The most views of a scene; the window shows fewer.
pub const MOST_VIEWS: usize = 64;

/// The most filters of a scene.
pub const MOST_FILTERS: usize = 64;

/// The most values of a filter: as many as there may be categories.
pub const MOST_FILTER_VALUES: usize = crate::display::MOST_CATEGORIES;

/// The most parameters of a view.
pub const MOST_VALUES: usize = 1000;

/// The most keys that are not known, in all of a scene: they are kept, and written again.
pub const MOST_UNKNOWN_KEYS: usize = 10_000;

/// Vertical field of view of a perspective camera that gives none, degrees: about that of a
/// portrait lens, so that objects look neither flat nor stretched.
pub const DEFAULT_FIELD_OF_VIEW_DEG: f64 = 35.0;

/// Between axis and edge of a spot that gives no angle, degrees: about that of a lampshade.
pub const DEFAULT_SPOT_DEG: f64 = 30.0;

/// Softness of a spot that gives none.
pub const DEFAULT_SPOT_SOFTNESS: f32 = 0.2;

/// A range of numbers, for scene files, the command line and sliders alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberRange {
    /// What the numbers are: `a number of radii`.
    what: &'static str,
    /// The least and the most, inclusive.
    ends: [f64; 2],
    /// Whether the least stands for 0, which is not allowed itself.
    is_above: bool,
}

impl NumberRange {
    const fn new(what: &'static str, low: f64, high: f64) -> Self {
        Self { what, ends: [low, high], is_above: false }
    }

    /// Whether a number lies in it; NaN does not.
    #[must_use]
    pub fn contains(&self, number: f64) -> bool {
        let [low, high] = self.ends;
        (low..=high).contains(&number) && !(self.is_above && number <= low)
    }

    /// What is expected, in words: `a number of radii from 0 to 16`.
    #[must_use]
    pub fn expected(&self) -> String {
        let ([low, high], what) = (self.ends, self.what);
        let high = if high < 1e9 { high.to_string() } else { format!("{high:e}") };
        match self.is_above {
            true => format!("{what} above 0, at most {high}"),
            false => format!("{what} from {low} to {high}"),
        }
    }

    /// Its ends for a slider.
    #[must_use]
    pub fn slider(&self) -> std::ops::RangeInclusive<f32> {
        self.ends[0] as f32..=self.ends[1] as f32
    }
}

/// Exposures. Beyond 60 stops either way, single precision shows black or white only.
pub const STOPS: NumberRange = NumberRange::new("a number of stops", -60.0, 60.0);

/// Factors on radii.
pub const RADIUS_SCALE: NumberRange =
    NumberRange { is_above: true, ..NumberRange::new("a factor", 1e-6, 1000.0) };

/// Depth tolerances, in radii.
pub const DEPTH_TOLERANCE: NumberRange = NumberRange::new("a number of radii", 0.0, 16.0);

/// Radii of the screen-space low-pass, in pixels.
pub const LOW_PASS: NumberRange = NumberRange::new("a number of pixels", 0.0, 4.0);

/// Frames that an antialiased picture is the mean of; 1 is none.
pub const ANTIALIAS: NumberRange = NumberRange::new("a whole number of frames", 1.0, 1024.0);

/// Strengths of eye-dome lighting.
pub const EYE_DOME_STRENGTH: NumberRange = NumberRange::new("a strength", 0.0, 100.0);

/// Radii of eye-dome lighting, in pixels.
pub const EYE_DOME_RADIUS: NumberRange =
    NumberRange { is_above: true, ..NumberRange::new("a number of pixels", 0.0, 32.0) };

/// Planarities.
pub const PLANARITIES: NumberRange = NumberRange::new("a planarity", 0.0, 1.0);

/// Largest radii, in scene units: less is 0 in single precision, and no surfel at all.
pub const LARGEST_RADIUS: NumberRange =
    NumberRange { is_above: true, ..NumberRange::new("a radius", 1e-37, 1e37) };

/// Radii of points, in scene units.
pub const POINT_RADIUS: NumberRange = NumberRange::new("a radius", 0.0, 1e37);

/// Vertical fields of view, in degrees.
pub const FIELD_OF_VIEW_DEG: NumberRange = NumberRange::new("an angle in degrees", 0.01, 179.0);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_say_what_they_take() {
        assert_eq!(DEPTH_TOLERANCE.expected(), "a number of radii from 0 to 16");
        assert_eq!(RADIUS_SCALE.expected(), "a factor above 0, at most 1000");
        assert!(DEPTH_TOLERANCE.contains(16.0) && !DEPTH_TOLERANCE.contains(16.1));
        assert!(RADIUS_SCALE.contains(1e-5) && !RADIUS_SCALE.contains(1e-6));
        assert!(!STOPS.contains(f64::NAN));
        assert_eq!(LOW_PASS.slider(), 0.0..=4.0);
    }
}
