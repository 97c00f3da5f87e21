//! Antialiased pictures: the mean of further frames, each seen at another place of every pixel.
//!
//! The places are a low-discrepancy sequence whose first is the middle of the pixel. Each frame begins anew, as one of
//! another view does, and goes on until its picture stays, so that what a renderer keeps from frame to frame never
//! mixes two places. Radiance is averaged before exposure and tone mapping.

use crate::session::{ConvergedFrame, LoadedRenderer, RenderSession};
use anyhow::Context as _;
use glam::Vec2;
use surfelshop_api::graph::Output;
use surfelshop_image::{Image, PictureMean};
use surfelshop_render::{RenderError, RenderRequest, Rendered, RendererView};

/// A number of steps whose multiples visit all of so many places, one far from the one before.
fn stride(count: u32) -> u32 {
    let common = |mut a: u32, mut b: u32| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (f64::from(count) * GOLDEN).round() as u32;
    (golden..count).find(|stride| common(*stride, count) == 1).unwrap_or(1)
}

/// The golden section: of all numbers the one whose multiples stay farthest apart.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Where frame `index` of `count` is seen in each pixel, pixels from its centre, y downwards, each from -0.5 up to 0.5.
///
/// The first is seen at the centre. All together have a stratum of their own across, and lie as far apart along the
/// other axis and the diagonals, so that edges of every direction converge; the first few of them do nearly so. Sobol's
/// sequence leaves half of a diagonal empty.
///
/// Source: Zaremba 1966, "Good lattice points, discrepancy, and numerical integration", section 3: lattices of
/// Fibonacci's numbers, whose quotients are the golden section here, for any number of points.
#[must_use]
pub fn shift_px(index: u32, count: u32) -> Vec2 {
    if index == 0 || count < 2 {
        return Vec2::ZERO;
    }
    let n = u64::from(index) * u64::from(stride(count)) % u64::from(count);
    // In the middle of its stratum, as all but the first.
    let across = (n as f64 + 0.5) / f64::from(count);
    let down = n as f64 * GOLDEN;
    let around_centre = |at: f64| ((at + 0.5).fract() - 0.5) as f32;
    Vec2::new(around_centre(across), around_centre(down))
}

/// The colour of a frame, where it has one.
fn color_of(rendered: &Rendered) -> Option<&Image> {
    rendered.image(&Output::Color)
}

/// Puts a picture in place of the colour.
pub fn replace_color(rendered: &mut Rendered, color: Image) {
    let of_color = rendered.images.iter_mut().find(|(output, _)| *output == Output::Color);
    if let Some((_, image)) = of_color {
        *image = color;
    }
}

/// Adds a frame's colour to those before.
///
/// # Errors
/// Where the renderer gave none, or one of another shape.
pub fn add_color(mean: &mut PictureMean, rendered: &Rendered) -> Result<(), RenderError> {
    let missing = || RenderError::Graph("a further frame has no colour".to_owned());
    let color = color_of(rendered).ok_or_else(missing)?;
    mean.add(color).map_err(|unlike| RenderError::Graph(unlike.to_string()))
}

impl RenderSession {
    /// Renders the mean of `n_samples` settled pictures of a view, at least 1. Outputs other than the colour are those
    /// of the first, and without the colour that is all there is to draw. Times and numbers of frames are of all.
    ///
    /// # Errors
    /// As [`RenderSession::settle`].
    pub fn settle_antialiased(
        &mut self,
        chosen: &mut LoadedRenderer,
        request: &RenderRequest<'_>,
        n_samples: u32,
    ) -> anyhow::Result<ConvergedFrame> {
        let settled = self.settle_view_antialiased(&mut chosen.view, request, n_samples);
        settled.with_context(|| chosen.reference.to_string())
    }

    /// The same for a renderer in a view.
    ///
    /// # Errors
    /// As [`RenderSession::settle_view`].
    pub fn settle_view_antialiased(
        &mut self,
        view: &mut RendererView,
        request: &RenderRequest<'_>,
        n_samples: u32,
    ) -> Result<ConvergedFrame, RenderError> {
        let mut settled = self.settle_view(view, request)?;
        let mut mean = match color_of(&settled.rendered) {
            Some(color) if n_samples > 1 => PictureMean::of(color),
            _ => return Ok(settled),
        };
        let request = RenderRequest { outputs: &[Output::Color], ..*request };
        for index in 1..n_samples {
            let further = self.settle_shifted(view, &request, shift_px(index, n_samples))?;
            add_color(&mut mean, &further.rendered)?;
            settled.n_frames = settled.n_frames.saturating_add(further.n_frames);
            settled.milliseconds += further.milliseconds;
            settled.own_passes_ms =
                settled.own_passes_ms.zip(further.own_passes_ms).map(|(a, b)| a + b);
        }
        settled.n_samples = mean.n_pictures();
        replace_color(&mut settled.rendered, mean.mean());
        Ok(settled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_begin_at_the_centre_and_lie_apart_in_all_directions() {
        for count in [2u32, 4, 8, 12, 16, 32, 100, 256] {
            let places: Vec<Vec2> = (0..count).map(|i| shift_px(i, count)).collect();
            assert_eq!(places[0], Vec2::ZERO);
            assert!(places.iter().all(|at| at.abs().max_element() <= 0.5), "{places:?}");
            let mut strata: Vec<u32> =
                places.iter().map(|at| ((at.x + 0.5) * count as f32).floor() as u32).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..count).collect::<Vec<_>>(), "{count}");
            for direction in [Vec2::X, Vec2::Y, Vec2::ONE, Vec2::new(1.0, -1.0)] {
                let mut along: Vec<f32> =
                    places.iter().map(|at| at.dot(direction).rem_euclid(1.0)).collect();
                along.sort_unstable_by(f32::total_cmp);
                let round = along[0] + 1.0;
                let next = along.iter().skip(1).chain([&round]);
                let gap = along.iter().zip(next).map(|(a, b)| b - a).fold(0.0, f32::max);
                // 1 is the least that there is.
                assert!(gap * (count as f32) < 4.5, "{count} along {direction}: {gap}");
            }
        }
    }

    #[test]
    fn the_first_places_of_many_lie_apart_as_well() {
        let first: Vec<Vec2> = (0..16).map(|i| shift_px(i, 1024)).collect();
        for (i, a) in first.iter().enumerate() {
            for b in &first[..i] {
                let apart = (*a - *b).abs();
                // Pixels stand beside each other.
                assert!(apart.min(1.0 - apart).length() > 0.1, "{a} {b}");
            }
        }
    }

    /// The area of a unit square, around 0, on one side of a line.
    fn covered(normal: Vec2, offset: f32) -> f32 {
        let n = 256;
        let at = |i: u32| (i as f32 + 0.5) / n as f32 - 0.5;
        let rows = (0..n).map(|row| {
            // Where the line crosses a row.
            let left = offset - normal.y * at(row);
            let end = match normal.x.abs() < 1e-6 {
                true => return if left > 0.0 { 1.0 } else { 0.0 },
                false => (left / normal.x).clamp(-0.5, 0.5) + 0.5,
            };
            if normal.x > 0.0 { end } else { 1.0 - end }
        });
        rows.sum::<f32>() / n as f32
    }

    #[test]
    fn edges_converge_faster_than_chance_would() {
        let mut lines = Vec::new();
        for i in 0..600u32 {
            let angle = std::f32::consts::TAU * (i as f32 * 0.618_034).fract();
            let offset = 1.4 * ((i as f32 * 0.754_877_7).fract() - 0.5);
            let normal = Vec2::from_angle(angle);
            let area = covered(normal, offset);
            if area > 0.0 && area < 1.0 {
                lines.push((normal, offset, area));
            }
        }
        let error = |count: u32| {
            let of = |(normal, offset, area): &(Vec2, f32, f32)| {
                let inside = (0..count).filter(|i| normal.dot(shift_px(*i, count)) < *offset);
                (inside.count() as f32 / count as f32 - area).powi(2)
            };
            (lines.iter().map(of).sum::<f32>() / lines.len() as f32).sqrt()
        };
        let errors = [1, 4, 16, 64].map(error);
        // The exponent of N over the whole range; that of chance is a half.
        let slope = (errors[0] / errors[3]).ln() / 64f32.ln();
        assert!((0.65..1.1).contains(&slope), "{errors:?}: {slope}");
        assert!(errors.windows(2).all(|pair| pair[1] < 0.6 * pair[0]), "{errors:?}");
    }
}
