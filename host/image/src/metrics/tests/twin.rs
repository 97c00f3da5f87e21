//! The displayed metrics once more, plainly: sums over square windows pixel by pixel in f64, with
//! the published decimal matrices, sharing nothing with the metrics but the papers.

use crate::Image;

/// Opponent colours of a picture; beyond the ends the last ones go on.
fn opponents(image: &Image) -> impl Fn(i64, i64) -> [f64; 3] {
    let (width, height) = (i64::from(image.width), i64::from(image.height));
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let all: Vec<[f64; 3]> = places.map(|(x, y)| y_cx_cz(at(image, x, y))).collect();
    move |x, y| all[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize]
}

/// Three sRGB-encoded values of a pixel.
fn at(image: &Image, x: i64, y: i64) -> [f64; 3] {
    let pixel = image.pixel(x as u32, y as u32);
    [f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2])]
}

pub(super) fn psnr(test: &Image, reference: &Image) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..i64::from(test.height) {
        for x in 0..i64::from(test.width) {
            let (t, r) = (at(test, x, y), at(reference, x, y));
            for channel in 0..3 {
                sum += (t[channel] - r[channel]).powi(2);
                count += 1.0;
            }
        }
    }
    10.0 * (count / sum).log10()
}

/// Similarity by centred moments of each window of 11 x 11.
pub(super) fn ssim(test: &Image, reference: &Image) -> f64 {
    let luma = |image: &Image, x: i64, y: i64| {
        let [r, g, b] = at(image, x, y);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 5..i64::from(test.height) - 5 {
        for x in 5..i64::from(test.width) - 5 {
            let mut window = Vec::new();
            for (dx, dy) in (-5..=5).flat_map(|dy| (-5..=5).map(move |dx| (dx, dy))) {
                let weight = (-((dx * dx + dy * dy) as f64) / (2.0 * 1.5 * 1.5)).exp();
                window.push((weight, luma(test, x + dx, y + dy), luma(reference, x + dx, y + dy)));
            }
            let total: f64 = window.iter().map(|(w, ..)| w).sum();
            let mean = |of: &dyn Fn(f64, f64) -> f64| {
                window.iter().map(|(w, t, r)| w / total * of(*t, *r)).sum::<f64>()
            };
            let (a, b) = (mean(&|t, _| t), mean(&|_, r| r));
            let (var_a, var_b) = (mean(&|t, _| (t - a).powi(2)), mean(&|_, r| (r - b).powi(2)));
            let covariance = mean(&|t, r| (t - a) * (r - b));
            let (c1, c2) = (1e-4, 9e-4);
            let luminance = (2.0 * a * b + c1) / (a * a + b * b + c1);
            let structure = (2.0 * covariance + c2) / (var_a + var_b + c2);
            sum += luminance * structure;
            count += 1.0;
        }
    }
    sum / count
}

const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412_390_799_3, 0.357_584_339_4, 0.180_480_788_4],
    [0.212_639_005_9, 0.715_168_678_8, 0.072_192_315_4],
    [0.019_330_818_7, 0.119_194_779_8, 0.950_532_152_2],
];
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_969_941_9, -1.537_383_177_6, -0.498_610_760_3],
    [-0.969_243_636_3, 1.875_967_501_5, 0.041_555_057_4],
    [0.055_630_079_7, -0.203_976_958_9, 1.056_971_514_2],
];
const WHITE: [f64; 3] = [0.950_455_927_1, 1.0, 1.089_057_750_8];

fn times(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|row: usize| (0..3).map(|column| matrix[row][column] * v[column]).sum())
}

fn y_cx_cz(encoded: [f64; 3]) -> [f64; 3] {
    let linear =
        encoded.map(|v| if v > 0.04045 { ((v + 0.055) / 1.055).powf(2.4) } else { v / 12.92 });
    let xyz = times(&XYZ_FROM_RGB, linear);
    let [x, y, z] = [0, 1, 2].map(|c| xyz[c] / WHITE[c]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = times(&XYZ_FROM_RGB, rgb);
    let f = [0, 1, 2].map(|c| {
        let t = xyz[c] / WHITE[c];
        if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
    });
    let l = 116.0 * f[1] - 16.0;
    [l, 0.01 * l * 500.0 * (f[0] - f[1]), 0.01 * l * 200.0 * (f[1] - f[2])]
}

fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// A place from the middle of a window, and how much it counts.
type Weight = (i64, i64, f64);

/// A square window of weights by distance from the middle.
fn window(radius: i64, weight: impl Fn(f64, f64) -> f64) -> Vec<Weight> {
    let places = (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy)));
    places.map(|(dx, dy)| (dx, dy, weight(dx as f64, dy as f64))).collect()
}

/// The three windows that opponent colours are blurred by.
fn sensitivities(ppd: f64) -> [Vec<Weight>; 3] {
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * ppd).ceil() as i64;
    let table = [(1.0, 0.0047, 0.0, 1e-5), (1.0, 0.0053, 0.0, 1e-5), (34.1, 0.04, 13.5, 0.025)];
    table.map(|(a1, b1, a2, b2)| {
        let mut all = window(radius, |dx, dy| {
            let squared = (dx * dx + dy * dy) / (ppd * ppd);
            let bell = |a: f64, b: f64| a * (pi / b).sqrt() * (-(pi * pi) * squared / b).exp();
            bell(a1, b1) + bell(a2, b2)
        });
        let sum: f64 = all.iter().map(|(.., w)| w).sum();
        all.iter_mut().for_each(|(.., w)| *w /= sum);
        all
    })
}

/// The windows of edges (`order` 1) or points (2) along x; along y they are those turned over.
fn feature(ppd: f64, order: u32) -> Vec<Weight> {
    let sigma = 0.5 * 0.082 * ppd;
    let mut all = window((3.0 * sigma).ceil() as i64, |dx, dy| {
        let bell = (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp();
        if order == 1 { -dx * bell } else { (dx * dx / (sigma * sigma) - 1.0) * bell }
    });
    let above: f64 = all.iter().map(|(.., w)| w.max(0.0)).sum();
    let below: f64 = all.iter().map(|(.., w)| -w.min(0.0)).sum();
    all.iter_mut().for_each(|(.., w)| *w /= if *w > 0.0 { above } else { below });
    all
}

/// FLIP of every pixel, row by row.
pub(super) fn flip(test: &Image, reference: &Image, ppd: f64) -> Vec<f64> {
    let blurs = sensitivities(ppd);
    let (edge, point) = (feature(ppd, 1), feature(ppd, 2));
    let color = |of: &dyn Fn(i64, i64) -> [f64; 3], x: i64, y: i64| {
        let blurred = [0, 1, 2]
            .map(|c| blurs[c].iter().map(|(dx, dy, w)| w * of(x + dx, y + dy)[c]).sum::<f64>());
        let yy = (blurred[0] + 16.0) / 116.0;
        let xyz = [yy + blurred[1] / 500.0, yy, yy - blurred[2] / 200.0];
        let rgb = times(&RGB_FROM_XYZ, [0, 1, 2].map(|c| xyz[c] * WHITE[c]));
        hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
    };
    let strength = |of: &dyn Fn(i64, i64) -> [f64; 3], x: i64, y: i64, window: &[Weight]| {
        let gray = |x, y| (of(x, y)[0] + 16.0) / 116.0;
        let gx: f64 = window.iter().map(|(dx, dy, w)| w * gray(x + dx, y + dy)).sum();
        let gy: f64 = window.iter().map(|(dx, dy, w)| w * gray(x + dy, y + dx)).sum();
        gx.hypot(gy)
    };
    let (t, r) = (opponents(test), opponents(reference));
    let largest = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(0.7);
    let mut all = Vec::new();
    for (x, y) in
        (0..i64::from(test.height)).flat_map(|y| (0..i64::from(test.width)).map(move |x| (x, y)))
    {
        let apart = hyab(color(&t, x, y), color(&r, x, y)).powf(0.7);
        let apart = if apart < 0.4 * largest {
            0.95 * apart / (0.4 * largest)
        } else {
            0.95 + 0.05 * (apart - 0.4 * largest) / (0.6 * largest)
        };
        let features = [&edge, &point]
            .map(|window| (strength(&t, x, y, window) - strength(&r, x, y, window)).abs());
        let features = (features[0].max(features[1]) / 2f64.sqrt()).sqrt();
        all.push(apart.powf(1.0 - features));
    }
    all
}
