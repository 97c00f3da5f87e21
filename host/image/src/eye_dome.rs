//! Eye-dome lighting: what lies behind something near it on the screen is darker, so that shapes show where normals
//! do not tell them.
//!
//! It works on distances alone, hence for whatever a renderer draws, and multiplies radiance before exposure and tone
//! mapping: darkening is then the same share of light whatever the tone mapping does to it, and the mean of several
//! pictures, as antialiasing takes it, is that of pictures each darkened by its own distances.
//!
//! For each pixel: eight others around it, at a radius in pixels. One that is nearer by a step s adds s, others add
//! nothing, and none adds more than 0.01; radiance is multiplied by exp(-200 strength mean(s)). A step is the
//! difference of distances over the height of what is seen at that distance: of logarithms of distances in central
//! projection, of distances in parallel projection. So it does not depend on the unit of lengths, and both projections
//! of the same view look alike. Coverage stays as it is, and pixels that show nothing neither darken nor are darkened.
//!
//! The most that a step adds is what a surface adds that is seen at ten degrees in a picture 800 pixels high, at 35
//! degrees in one 200 pixels high: rims before what lies far behind are lines of half to a seventh of the light, and not
//! of none. Leaves and other clouds of single points are rims everywhere, and would look drawn in ink.
//!
//! Source: Boucheny and Ribes 2011, "Eye-Dome Lighting: a non-photorealistic shading technique", Kitware Source 17, one
//! scale of it; differences of logarithms as Potree takes them. Deviations: steps are shares of the height that is seen
//! and have a largest one, and what lies behind no surfel is left alone.

use crate::Image;
use rayon::prelude::*;
use surfelshop_api::{Projection, View};

/// Strength and radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeDome {
    /// Factor on the darkening, at least 0; 0 is none, 1 the usual.
    pub strength: f32,
    /// How far the neighbours of a pixel are from it, pixels, above 0.
    pub radius: f32,
}

/// Darkening by a step of the height of the picture on all sides, as an exponent, where the strength is 1.
const DARKENING: f32 = 200.0;

/// The most that a step adds, in heights of the picture.
const LARGEST_STEP: f32 = 0.01;

/// Neighbours of a pixel.
const N_NEIGHBOURS: usize = 8;

/// No neighbour is farther than this, pixels.
const LARGEST_OFFSET: f32 = 64.0;

impl EyeDome {
    /// The same in a picture of which a pixel is as wide as `coarseness` pixels of the whole one.
    #[must_use]
    pub fn in_pixels_of(self, coarseness: u32) -> Self {
        Self { radius: self.radius / coarseness.max(1) as f32, ..self }
    }

    /// Where the neighbours are, whole pixels.
    fn offsets(self) -> [[i32; 2]; N_NEIGHBOURS] {
        let radius = if self.radius.is_finite() { self.radius } else { 1.0 };
        let radius = radius.clamp(1.0, LARGEST_OFFSET);
        let across = radius.round() as i32;
        let diagonal = (radius * std::f32::consts::FRAC_1_SQRT_2).round() as i32;
        let (a, d) = (across, diagonal);
        [[a, 0], [d, d], [0, a], [-d, d], [-a, 0], [-d, -d], [0, -a], [d, -d]]
    }

    /// The factor on the sum of steps to the neighbours, and the largest step. Slopes give steps as large as the
    /// neighbours are far, which whole pixels are not by just the radius: that is made up for.
    fn exponent(self, offsets: &[[i32; 2]; N_NEIGHBOURS]) -> (f32, f32) {
        let length = |[x, y]: &[i32; 2]| ((x * x + y * y) as f32).sqrt();
        let mean = offsets.iter().map(length).sum::<f32>() / N_NEIGHBOURS as f32;
        let made_up = self.radius / mean;
        let exponent = -DARKENING * self.strength * made_up / N_NEIGHBOURS as f32;
        (exponent, LARGEST_STEP / made_up)
    }

    /// Darkens a picture of radiance (four components) by the distances along the viewing axis that belong to it, of
    /// which the first component counts; 0 is where nothing is. Pictures of unlike sizes are left alone.
    pub fn darken(self, radiance: &mut Image, distances: &Image, view: &View) {
        let (width, height) = (radiance.width as usize, radiance.height as usize);
        let n = distances.components as usize;
        let is_alike = [distances.width, distances.height] == [radiance.width, radiance.height]
            && radiance.components == 4
            && n > 0
            && width * height > 0;
        let is_usable = self.strength > 0.0 && self.strength.is_finite() && self.radius > 0.0;
        if !is_alike || !is_usable {
            return;
        }
        let offsets = self.offsets();
        let (exponent, largest) = self.exponent(&offsets);
        let margin = offsets.iter().map(|[x, _]| x.unsigned_abs() as usize).max().unwrap_or(0);
        let padded = width + 2 * margin;
        let mut heights = vec![f32::INFINITY; padded * height];
        let height_of = heights_of(view);
        let rows =
            heights.par_chunks_exact_mut(padded).zip(distances.data.par_chunks_exact(n * width));
        rows.for_each(|(row, distances)| {
            for (height, distance) in row[margin..].iter_mut().zip(distances.chunks_exact(n)) {
                *height = height_of(distance[0]);
            }
            let (first, last) = (row[margin], row[margin + width - 1]);
            row[..margin].fill(first);
            row[margin + width..].fill(last);
        });
        let row_of = |y: i32| {
            let y = y.clamp(0, height as i32 - 1) as usize;
            &heights[y * padded..(y + 1) * padded]
        };
        let rows = radiance.data.par_chunks_exact_mut(4 * width).enumerate();
        rows.for_each_init(
            || vec![0.0f32; width],
            |sums, (y, pixels)| {
                sums.fill(0.0);
                let own = &row_of(y as i32)[margin..margin + width];
                for [dx, dy] in offsets {
                    let from = (margin as i32 + dx) as usize;
                    let others = &row_of(y as i32 + dy)[from..from + width];
                    for ((sum, own), other) in sums.iter_mut().zip(own).zip(others) {
                        // Of no number where both are nothing, which the maximum passes over.
                        *sum += (own - other).max(0.0).min(largest);
                    }
                }
                let pixels = pixels.chunks_exact_mut(4).zip(sums.iter()).zip(own);
                for ((pixel, sum), _) in
                    pixels.filter(|((_, sum), own)| **sum > 0.0 && own.is_finite())
                {
                    let factor = (exponent * sum).exp();
                    pixel[..3].iter_mut().for_each(|value| *value *= factor);
                }
            },
        );
    }
}

/// Distances in heights of the picture up to a constant; infinite where nothing is.
fn heights_of(view: &View) -> impl Fn(f32) -> f32 + Sync {
    let height = 2.0 * view.half_extent()[1];
    let per_height = if height > 0.0 { (1.0 / height) as f32 } else { 0.0 };
    let is_parallel = matches!(view.camera.projection, Projection::Orthographic { .. });
    move |distance: f32| {
        if !(distance > 0.0 && distance.is_finite()) {
            return f32::INFINITY;
        }
        let at = if is_parallel { distance } else { distance.ln() };
        at * per_height
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::Camera;

    fn view(size_px: [u32; 2], projection: Projection) -> View {
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        View { camera, size_px, near: 1e-3, far: 1e9 }
    }

    fn perspective(size_px: [u32; 2]) -> View {
        view(size_px, Projection::Perspective { fov_y: 0.7 })
    }

    fn image(size: [u32; 2], components: u32, of: impl Fn(u32, u32) -> Vec<f32>) -> Image {
        let [width, height] = size;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let data = pixels.flat_map(|(x, y)| of(x, y)).collect();
        Image { width, height, components, data }
    }

    fn white(size: [u32; 2]) -> Image {
        image(size, 4, |_, _| vec![1.0, 0.5, 0.25, 1.0])
    }

    /// A scene of a slope, a ball before it and nothing in a corner.
    fn distances(size: [u32; 2], components: u32) -> Image {
        let [w, h] = size.map(|side| side as f32);
        image(size, components, |x, y| {
            let (x, y) = ((x as f32 + 0.5) / w - 0.5, (y as f32 + 0.5) / h - 0.5);
            let ball = 0.09 - x * x - y * y;
            let distance = match () {
                () if x > 0.35 && y > 0.2 => 0.0,
                () if ball > 0.0 => 4.0 - ball.sqrt(),
                () => 5.0 + x,
            };
            let mut pixel = vec![7.0; components as usize];
            pixel[0] = distance;
            pixel
        })
    }

    fn darkened(how: EyeDome, distances: &Image, view: &View) -> Image {
        let mut picture = white([distances.width, distances.height]);
        how.darken(&mut picture, distances, view);
        picture
    }

    /// The definition, pixel by pixel in double precision.
    fn reference(how: EyeDome, distances: &Image, view: &View) -> Vec<f64> {
        let offsets = how.offsets();
        let lengths = offsets.iter().map(|[x, y]| f64::from(x * x + y * y).sqrt());
        let made_up = f64::from(how.radius) / (lengths.sum::<f64>() / 8.0);
        let height = 2.0 * view.half_extent()[1];
        let (w, h) = (distances.width as i32, distances.height as i32);
        let at = |x: i32, y: i32| {
            let (x, y) = (x.clamp(0, w - 1) as u32, y.clamp(0, h - 1) as u32);
            let distance = f64::from(distances.pixel(x, y)[0]);
            let is_parallel = matches!(view.camera.projection, Projection::Orthographic { .. });
            let of = if is_parallel { distance } else { distance.ln() };
            (distance > 0.0).then_some(of / height)
        };
        let factor = |x: i32, y: i32| {
            let Some(own) = at(x, y) else { return 1.0 };
            let steps = offsets.iter().filter_map(|[dx, dy]| at(x + dx, y + dy));
            let sum: f64 = steps.map(|other| (own - other).clamp(0.0, 0.01 / made_up)).sum();
            (-200.0 * f64::from(how.strength) * made_up * sum / 8.0).exp()
        };
        (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| factor(x, y)).collect()
    }

    #[test]
    fn pixels_are_as_the_definition_says() {
        let size = [61, 37];
        let parallel = view(size, Projection::Orthographic { height: 3.0 });
        for view in [perspective(size), parallel] {
            for (strength, radius) in [(1.0, 1.0), (0.4, 1.4), (3.0, 2.7), (1.0, 9.0), (1.0, 0.4)] {
                let how = EyeDome { strength, radius };
                for components in [1, 4] {
                    let distances = distances(size, components);
                    let picture = darkened(how, &distances, &view);
                    let expected = reference(how, &distances, &view);
                    for (pixel, factor) in picture.data.chunks_exact(4).zip(&expected) {
                        for (value, white) in pixel.iter().zip([1.0, 0.5, 0.25]) {
                            // Steps are differences of logarithms around 3 in single precision, 2e-7, times up to 600.
                            assert!((f64::from(*value) - white * factor).abs() < 2e-4, "{how:?}");
                        }
                        assert_eq!(pixel[3].to_bits(), 1.0f32.to_bits());
                    }
                    assert!(expected.iter().any(|factor| *factor < 0.7), "{how:?}");
                }
            }
        }
    }

    #[test]
    fn a_plane_that_faces_the_eye_and_nothing_at_all_stay_as_they_are() {
        let size = [9, 7];
        for distance in [2.5, 0.0, f32::NAN, f32::INFINITY, -1.0] {
            let distances = image(size, 1, |_, _| vec![distance]);
            let how = EyeDome { strength: 5.0, radius: 3.0 };
            assert_eq!(darkened(how, &distances, &perspective(size)), white(size));
        }
    }

    #[test]
    fn without_strength_and_for_unlike_pictures_nothing_changes() {
        let (size, how) = ([16, 12], EyeDome { strength: 1.0, radius: 1.4 });
        let seen = distances(size, 1);
        for how in [
            EyeDome { strength: 0.0, ..how },
            EyeDome { strength: f32::NAN, ..how },
            EyeDome { radius: 0.0, ..how },
        ] {
            assert_eq!(darkened(how, &seen, &perspective(size)), white(size));
        }
        let mut picture = white([12, 16]);
        how.darken(&mut picture, &seen, &perspective(size));
        assert_eq!(picture, white([12, 16]));
    }

    #[test]
    fn lengths_have_no_unit() {
        let size = [61, 37];
        let how = EyeDome { strength: 1.0, radius: 1.4 };
        for (factor, height) in [(1.0, 3.0), (1e-6, 3e-6), (1e6, 3e6)] {
            let mut scaled = distances(size, 1);
            scaled.data.iter_mut().for_each(|distance| *distance *= factor);
            let parallel = view(size, Projection::Orthographic { height });
            let usual = view(size, Projection::Orthographic { height: 3.0 });
            for (scaled_view, view) in [(perspective(size), perspective(size)), (parallel, usual)] {
                let picture = darkened(how, &scaled, &scaled_view);
                let expected = darkened(how, &distances(size, 1), &view);
                let apart = picture.data.iter().zip(&expected.data).map(|(a, b)| (a - b).abs());
                // Logarithms up to 16 in single precision, 1e-6, times 200.
                assert!(apart.fold(0.0, f32::max) < 5e-4, "{factor}");
            }
        }
    }

    #[test]
    fn slopes_are_as_dark_in_coarse_pictures() {
        let how = EyeDome { strength: 1.0, radius: 1.4 };
        let mean = |size: [u32; 2], how: EyeDome| {
            let [w, _] = size.map(|side| side as f32);
            let slope = image(size, 1, |x, _| vec![4.0 + (x as f32 + 0.5) / w]);
            let picture = darkened(how, &slope, &perspective(size));
            picture.pixel(size[0] / 2, size[1] / 2)[0]
        };
        let whole = mean([320, 200], how);
        assert!(whole < 0.97, "{whole}");
        for coarseness in [2, 4] {
            let size = [320 / coarseness, 200 / coarseness];
            let coarse = mean(size, how.in_pixels_of(coarseness));
            assert!((coarse - whole).abs() < 0.01, "{coarse} instead of {whole}");
        }
    }
}
