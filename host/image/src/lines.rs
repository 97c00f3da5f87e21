//! Lines over a picture.

use crate::Image;
use crate::text::over;

/// Draws a line with round ends over a picture of straight alpha; a dot where both ends are one place. Coordinates are
/// pixels from the upper left corner, and so is the width. What is outside of the picture, or no number, is left out.
pub fn line(image: &mut Image, ends: [[f64; 2]; 2], width: f64, color: [f32; 3], alpha: f32) {
    let half = 0.5 * width;
    // Half a pixel more is covered in part.
    let reach = half + 0.5;
    let size = [f64::from(image.width), f64::from(image.height)];
    let Some([a, b]) = clipped(ends, size.map(|side| side + reach), -reach) else { return };
    let way = [b[0] - a[0], b[1] - a[1]];
    let squared = way[0] * way[0] + way[1] * way[1];
    let rows = |low: f64, high: f64, most: f64| {
        (low - reach).max(0.0).floor() as i64..(high + reach).min(most).ceil() as i64
    };
    for y in rows(a[1].min(b[1]), a[1].max(b[1]), size[1]) {
        let middle = y as f64 + 0.5;
        // The part of the line that is near this row.
        let near = |edge: f64| match way[1] == 0.0 {
            true => [0.0, 1.0],
            false => [(edge - reach - a[1]) / way[1], (edge + reach - a[1]) / way[1]],
        };
        let shares = near(middle).map(|share| share.clamp(0.0, 1.0));
        let [from, to] = shares.map(|share| a[0] + share * way[0]);
        for x in rows(from.min(to), from.max(to), size[0]) {
            let at = [x as f64 + 0.5 - a[0], middle - a[1]];
            let share = (at[0] * way[0] + at[1] * way[1]) / squared;
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            let distance = (at[0] - share * way[0]).hypot(at[1] - share * way[1]);
            let covered = (reach - distance).clamp(0.0, 1.0) as f32;
            over(image, [x, y], color, alpha * covered);
        }
    }
}

/// The part of a line from `low` to `high` on both axes. Source: Liang and Barsky 1984.
fn clipped(ends: [[f64; 2]; 2], high: [f64; 2], low: f64) -> Option<[[f64; 2]; 2]> {
    if ends.iter().flatten().any(|number| !number.is_finite()) {
        return None;
    }
    let [a, b] = ends;
    let (mut first, mut last) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let way = b[axis] - a[axis];
        let bounds = [low, high[axis]];
        if way == 0.0 {
            if a[axis] < bounds[0] || a[axis] > bounds[1] {
                return None;
            }
            continue;
        }
        let shares = bounds.map(|bound| (bound - a[axis]) / way);
        first = first.max(shares[0].min(shares[1]));
        last = last.min(shares[0].max(shares[1]));
    }
    let at = |share: f64| [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
    (first <= last).then(|| [at(first), at(last)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Image {
        Image { width: 60, height: 40, components: 4, data: [0.0, 0.0, 0.0, 1.0].repeat(60 * 40) }
    }

    fn painted(image: &Image) -> f64 {
        image.data.chunks(4).map(|pixel| f64::from(pixel[0])).sum()
    }

    /// Invariant: a line covers its length times its width, and its round ends, in every direction
    #[test]
    fn lines_cover_their_length_times_their_width() {
        for ends in [
            [[10.0, 20.0], [50.0, 20.0]],
            [[30.0, 5.0], [30.0, 35.0]],
            [[12.3, 8.1], [47.7, 31.9]],
            [[47.7, 8.1], [12.3, 31.9]],
            [[20.25, 20.5], [20.25, 20.5]],
        ] {
            let mut image = picture();
            line(&mut image, ends, 3.0, [1.0; 3], 1.0);
            let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
            let expected = 3.0 * length + std::f64::consts::PI * 1.5 * 1.5;
            let found = painted(&image);
            assert!((found - expected).abs() < 0.03 * expected + 0.5, "{found} for {expected}");
        }
    }

    #[test]
    fn what_is_outside_is_left_out() {
        for ends in [
            [[-50.0, -50.0], [-10.0, 90.0]],
            [[f64::NAN, 3.0], [5.0, 5.0]],
            [[1e300, 3.0], [1e300, 5.0]],
        ] {
            let mut image = picture();
            line(&mut image, ends, 3.0, [1.0; 3], 1.0);
            assert_eq!(painted(&image), 0.0);
        }
        // From far outside through the middle.
        let mut image = picture();
        line(&mut image, [[-1e12, 20.0], [1e12, 20.0]], 2.0, [1.0; 3], 0.5);
        assert!((painted(&image) - 60.0).abs() < 0.5, "{}", painted(&image));
        line(
            &mut Image { width: 0, height: 0, components: 4, data: Vec::new() },
            [[0.0; 2]; 2],
            1.0,
            [1.0; 3],
            1.0,
        );
    }
}
