//! Maps of errors as pictures.

use crate::Image;

/// Colour of values that are not finite, which no error has.
const NOT_FINITE: [f32; 3] = [0.0, 1.0, 1.0];

/// sRGB-encoded red, green and blue as polynomials of the value in [0, 1]: factors of its first to
/// fifth power. Made for this by least squares: black, indigo, plum, coral, amber and ivory were
/// asked for, more strongly a lightness (the L of Oklab) of 0.97 times the value, which the factors
/// below keep within 0.01.
const POLYNOMIALS: [[f32; 5]; 3] = [
    [-0.14, 2.78, 4.12, -11.06, 5.29],
    [-0.05, 0.62, -0.85, 3.39, -2.14],
    [-0.08, 12.05, -33.08, 29.69, -7.77],
];

/// A map of one value a pixel in colours from black (0 and below) over purple and orange to ivory
/// (`full` and above), equal steps being equally lighter; values that are not finite are cyan. The
/// picture is what [`develop`](crate::display_transform::develop) gives: sRGB-encoded values in [0, 1] and
/// coverage 1. All is black where `full` is not above 0.
#[must_use]
pub fn in_color(map: &Image, full: f32) -> Image {
    let data = map.data.iter().flat_map(|value| {
        let [r, g, b] = color(*value, full);
        [r, g, b, 1.0]
    });
    Image { width: map.width, height: map.height, components: 4, data: data.collect() }
}

fn color(value: f32, full: f32) -> [f32; 3] {
    if !value.is_finite() {
        return NOT_FINITE;
    }
    let share = if full > 0.0 { (value / full).clamp(0.0, 1.0) } else { 0.0 };
    POLYNOMIALS.map(|factors| {
        let sum = factors.iter().rev().fold(0.0, |sum, factor| (sum + factor) * share);
        sum.clamp(0.0, 1.0)
    })
}
