//! Colours as FLIP compares them.

use glam::{DMat3, DVec3};

/// Chromaticities of Rec. 709: of red, green, blue, and white (D65).
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
const WHITE: [f64; 2] = [0.3127, 0.3290];

/// Exponent on perceived differences, and where the scale of differences bends: up to a share of the
/// largest they are spread over most of it, since larger ones all look large.
const COLOR_EXPONENT: f64 = 0.7;
const BEND_AT: f64 = 0.4;
const BEND_TO: f64 = 0.95;

/// Where the CIE's lightness turns from a line to a root.
const LINE_UP_TO: f64 = 6.0 / 29.0;

/// Ways between colours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    /// From linear Rec. 709 to X, Y and Z relative to white.
    relative_from_linear: DMat3,
    linear_from_relative: DMat3,
    /// The largest difference of two colours of a screen, green and blue, with the exponent.
    largest: f64,
}

impl Space {
    pub(super) fn new() -> Self {
        let xyz = |[x, y]: [f64; 2]| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let white = xyz(WHITE);
        let primaries =
            DMat3::from_cols_array_2d(&PRIMARIES.map(|primary| xyz(primary).to_array()));
        let shares = primaries.inverse() * white;
        let xyz_from_linear = primaries * DMat3::from_diagonal(shares);
        let relative_from_linear = DMat3::from_diagonal(white.recip()) * xyz_from_linear;
        let linear_from_relative = relative_from_linear.inverse();
        let mut space = Self { relative_from_linear, linear_from_relative, largest: 1.0 };
        let [green, blue] =
            [DVec3::Y, DVec3::Z].map(|linear| adjusted(relative_from_linear * linear));
        space.largest = distance(green, blue).powf(COLOR_EXPONENT);
        space
    }

    /// The opponent colours Y Cx Cz of an sRGB-encoded one.
    pub(super) fn opponent(&self, encoded: [f32; 3]) -> [f64; 3] {
        let linear = encoded.map(|value| decoded(f64::from(value)));
        let [x, y, z] = (self.relative_from_linear * DVec3::from_array(linear)).to_array();
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// What a colour that has been blurred looks like, cut to what a screen can show: CIE lightness,
    /// and two chromas that grow with it.
    pub(super) fn perceived(&self, opponent: [f64; 3]) -> [f64; 3] {
        let y = (opponent[0] + 16.0) / 116.0;
        let relative = DVec3::new(y + opponent[1] / 500.0, y, y - opponent[2] / 200.0);
        let linear = (self.linear_from_relative * relative).clamp(DVec3::ZERO, DVec3::ONE);
        adjusted(self.relative_from_linear * linear)
    }

    /// How different two perceived colours are, 0 to 1.
    pub(super) fn difference(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        let difference = distance(a, b).powf(COLOR_EXPONENT);
        let bend = BEND_AT * self.largest;
        if difference < bend {
            difference * (BEND_TO / bend)
        } else {
            BEND_TO + (difference - bend) / (self.largest - bend) * (1.0 - BEND_TO)
        }
    }
}

/// Linear light of an sRGB-encoded value.
fn decoded(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// L*a*b* of X, Y and Z relative to white, with chroma scaled by lightness: the Hunt effect.
fn adjusted(relative: DVec3) -> [f64; 3] {
    let [x, y, z] = relative.to_array().map(|value| {
        if value > LINE_UP_TO.powi(3) {
            value.cbrt()
        } else {
            value / (3.0 * LINE_UP_TO * LINE_UP_TO) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// The distance `HyAB`: of lightness, plus that in the plane of chroma.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}
