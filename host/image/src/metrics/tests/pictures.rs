//! Five pairs of generated pictures, in whole numbers throughout, so that other programs can make the
//! very same ones.

use crate::Image;
use surfelshop_api::params::srgb_to_linear;

pub(super) const WIDTH: i32 = 96;
pub(super) const HEIGHT: i32 = 72;

/// Levels, 0 to 255, of a pixel inside the picture.
type Pixel = fn(i32, i32) -> [i32; 3];

/// What each pair is called, and its test; the reference of all is [`scene`].
pub(super) const PAIRS: [(&str, Pixel); 5] =
    [("noise", noisy), ("blur", blurred), ("shift", shifted), ("edges", edges), ("color", colored)];

/// Ramps of colour, a disc and a checkerboard.
pub(super) fn scene(x: i32, y: i32) -> [i32; 3] {
    let mut color = [
        40 + 160 * x / (WIDTH - 1),
        60 + 120 * y / (HEIGHT - 1),
        200 - 130 * (x + y) / (WIDTH + HEIGHT - 2),
    ];
    if (x - 30) * (x - 30) + (y - 34) * (y - 34) < 18 * 18 {
        color = [color[0] + 50, color[1] - 45, color[2] / 2];
    }
    if x >= 58 && y >= 40 && (x / 3 + y / 3) % 2 == 0 {
        color = [230 - color[0] / 2, 235, 20 + color[2] / 2];
    }
    color
}

fn noisy(x: i32, y: i32) -> [i32; 3] {
    let color = scene(x, y);
    [0, 1, 2].map(|channel| {
        let noise = hash((x * 1973 + y * 9277 + channel * 26699 + 1) as u32) % 61;
        (color[channel as usize] + noise as i32 - 30).clamp(0, 255)
    })
}

fn blurred(x: i32, y: i32) -> [i32; 3] {
    let mut sum = [0; 3];
    for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
        let near = scene((x + dx).clamp(0, WIDTH - 1), (y + dy).clamp(0, HEIGHT - 1));
        sum = [sum[0] + near[0], sum[1] + near[1], sum[2] + near[2]];
    }
    sum.map(|sum| (sum + 12) / 25)
}

fn shifted(x: i32, y: i32) -> [i32; 3] {
    scene((x + 1).min(WIDTH - 1), (y + 1).min(HEIGHT - 1))
}

fn edges(x: i32, y: i32) -> [i32; 3] {
    if x % 16 == 5 || y == 20 || x - y == 11 { [250, 245, 240] } else { scene(x, y) }
}

fn colored(x: i32, y: i32) -> [i32; 3] {
    let [r, g, b] = scene(x, y);
    [r * 4 / 5, g, (b + 40).min(255)]
}

/// A permuted congruential generator's output for a state.
pub(super) fn hash(state: u32) -> u32 {
    let state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A pair's picture as a screen shows it: sRGB-encoded.
pub(super) fn displayed(pixel: Pixel) -> Image {
    picture(WIDTH, HEIGHT, |x, y| {
        let [r, g, b] = pixel(x, y).map(|level| level as f32 / 255.0);
        [r, g, b, 1.0]
    })
}

/// The radiance that is shown so.
pub(super) fn radiance(pixel: Pixel) -> Image {
    let mut image = displayed(pixel);
    for pixel in image.data.chunks_exact_mut(4) {
        for value in &mut pixel[..3] {
            *value = srgb_to_linear(*value);
        }
    }
    image
}

/// A picture by its pixels.
pub(super) fn picture(width: i32, height: i32, pixel: impl Fn(i32, i32) -> [f32; 4]) -> Image {
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let data = places.flat_map(|(x, y)| pixel(x, y)).collect();
    Image { width: width as u32, height: height as u32, components: 4, data }
}
