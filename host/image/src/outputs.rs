//! Outputs of a renderer as they are seen: depth as brightness, normals as colours, colour through the
//! display transform.

use crate::Image;
use crate::display_transform::{Background, DisplayTransform, develop, develop_to_8_bit};
use surfelshop_api::graph::Output;

/// Brightness of the farthest depth, so that it differs from black.
const DARKEST_DEPTH: f32 = 0.1;

/// The output as it is seen: values in [0, 1] as they stand in a PNG, straight alpha.
///
/// `color` and `debug.*` are exposed and tone-mapped; `albedo` is only sRGB-encoded; `depth`,
/// `normal` and `ao` are data and are not encoded. The background stands where nothing is.
pub fn visible(output: &Output, image: &Image, how: &DisplayTransform) -> Image {
    let rgba = four_components(output, image);
    let plain = DisplayTransform { background: how.background, ..DisplayTransform::default() };
    match output {
        Output::Color | Output::Debug(_) => develop(&rgba, how),
        Output::Albedo => develop(&rgba, &plain),
        Output::Depth => over_background(&depth_as_brightness(rgba), how.background),
        Output::Normal => over_background(&map_colors(rgba, |n| n * 0.5 + 0.5), how.background),
        Output::Ao => over_background(&rgba, how.background),
    }
}

/// A picture of radiance as 8-bit levels, four a pixel: those that its PNG holds.
pub fn levels(color: &Image, how: &DisplayTransform) -> Vec<u8> {
    if color.components == 4 {
        return develop_to_8_bit(color, how);
    }
    develop_to_8_bit(&four_components(&Output::Color, color), how)
}

/// The picture with four components: single values become grey, and coverage is told from what
/// the output says of empty pixels.
pub fn four_components(output: &Output, image: &Image) -> Image {
    let n = image.components as usize;
    if n == 0 {
        return Image { components: 4, ..Image::default() };
    }
    let single = matches!(output, Output::Depth | Output::Ao);
    let mut data = Vec::with_capacity(image.data.len() / n * 4);
    for pixel in image.data.chunks_exact(n) {
        let rgb = match pixel {
            [value, ..] if single || n == 1 => [*value; 3],
            [x, y] => [*x, *y, 0.0],
            [x, y, z, ..] => [*x, *y, *z],
            _ => [0.0; 3],
        };
        let covered = match output {
            Output::Depth => rgb[0] > 0.0,
            Output::Normal => rgb.iter().any(|value| *value != 0.0),
            _ => true,
        };
        let alpha = if covered { pixel.get(3).copied().unwrap_or(1.0) } else { 0.0 };
        data.extend(rgb);
        data.push(alpha);
    }
    Image { components: 4, data, ..*image }
}

/// Near is white and far is dark, linear in distance over the range that is covered.
fn depth_as_brightness(rgba: Image) -> Image {
    let covered = rgba.data.chunks_exact(4).filter(|p| p[3] > 0.0 && p[0].is_finite());
    let (nearest, farthest) =
        covered.fold((f32::INFINITY, 0.0f32), |(near, far), p| (near.min(p[0]), far.max(p[0])));
    let range = (farthest - nearest).max(f32::MIN_POSITIVE);
    map_colors(rgba, |depth| 1.0 - (1.0 - DARKEST_DEPTH) * (depth - nearest) / range)
}

/// Maps the three colour components; what is not finite becomes 0.
fn map_colors(mut image: Image, map: impl Fn(f32) -> f32) -> Image {
    for pixel in image.data.chunks_exact_mut(4) {
        for value in &mut pixel[..3] {
            *value = Some(map(*value)).filter(|mapped| mapped.is_finite()).unwrap_or(0.0);
        }
    }
    image
}

/// Puts data over a background without encoding it.
fn over_background(rgba: &Image, background: Background) -> Image {
    let mut image = map_colors(rgba.clone(), |value| value.clamp(0.0, 1.0));
    let (width, height) = ((image.width as usize).max(1), image.height);
    for (i, pixel) in image.data.chunks_exact_mut(4).enumerate() {
        let alpha = if pixel[3].is_finite() { pixel[3].clamp(0.0, 1.0) } else { 0.0 };
        match background.behind([i % width, i / width], height) {
            None if alpha > 0.0 => pixel[3] = alpha,
            None => pixel.fill(0.0),
            Some(behind) => {
                for (value, behind) in pixel.iter_mut().zip(behind) {
                    *value = *value * alpha + behind * (1.0 - alpha);
                }
                pixel[3] = 1.0;
            }
        }
    }
    image
}

/// Pixels with a value that is not finite.
pub fn not_finite(image: &Image) -> usize {
    let n = (image.components as usize).max(1);
    image.data.chunks_exact(n).filter(|pixel| pixel.iter().any(|v| !v.is_finite())).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display_transform::to_8_bit;

    fn image(components: u32, data: &[f32]) -> Image {
        let width = data.len() as u32 / components;
        Image { width, height: 1, components, data: data.to_vec() }
    }

    #[test]
    fn depth_runs_from_white_to_dark_over_the_covered_range() {
        let depth = image(1, &[0.0, 2.0, 3.0, 4.0]);
        let shown = visible(&Output::Depth, &depth, &DisplayTransform::default());
        assert_eq!(shown.pixel(0, 0), [0.0; 4]);
        assert_eq!(shown.pixel(1, 0), [1.0; 4]);
        // Two roundings of values below 1.
        assert!((shown.pixel(2, 0)[0] - 0.55).abs() < 1e-6);
        assert!((shown.pixel(3, 0)[0] - DARKEST_DEPTH).abs() < 1e-6);
    }

    #[test]
    fn single_depth_is_white() {
        let shown = visible(&Output::Depth, &image(1, &[7.0]), &DisplayTransform::default());
        assert_eq!(shown.pixel(0, 0), [1.0; 4]);
    }

    #[test]
    fn normals_are_moved_into_the_visible_range_and_empty_pixels_show_the_background() {
        let normals = image(4, &[0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let background = Background::Color([0.2, 0.4, 0.6]);
        let how = DisplayTransform { background, ..DisplayTransform::default() };
        let shown = visible(&Output::Normal, &normals, &how);
        assert_eq!(shown.pixel(0, 0), [0.5, 0.5, 0.0, 1.0]);
        assert_eq!(shown.pixel(1, 0), [0.2, 0.4, 0.6, 1.0]);
    }

    #[test]
    fn albedo_is_neither_exposed_nor_tone_mapped() {
        let how = DisplayTransform { exposure_stops: 3.0, ..DisplayTransform::default() };
        let shown = visible(&Output::Albedo, &image(4, &[1.0, 0.0, 1.0, 1.0]), &how);
        assert_eq!(to_8_bit(&shown), [255, 0, 255, 255]);
        let shown = visible(&Output::Albedo, &image(4, &[0.214, 0.0, 0.0, 1.0]), &how);
        assert!((shown.pixel(0, 0)[0] - 0.5).abs() < 1e-3);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_not_shown() {
        let odd = image(4, &[f32::NAN, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 1.0]);
        assert_eq!(not_finite(&odd), 1);
        for output in [Output::Color, Output::Normal, Output::Depth, Output::Ao] {
            let shown = visible(&output, &odd, &DisplayTransform::default());
            assert!(shown.data.iter().all(|value| (0.0..=1.0).contains(value)), "{output:?}");
        }
    }
}
