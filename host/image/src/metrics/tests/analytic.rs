//! Pictures of which every number is known.

use super::pictures::{PAIRS, picture, radiance, scene};
use crate::Image;
use crate::display_transform::{Background, DisplayTransform, ToneMap};
use crate::metrics::{Settings, compare, compare_levels, compare_with_maps, in_color, psnr};
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};

fn even(rgba: [f32; 4]) -> Image {
    picture(16, 12, |_, _| rgba)
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, not {expected}");
}

#[test]
fn equal_pictures_have_no_errors() {
    let image = radiance(PAIRS[0].1);
    let (comparison, maps) = compare_with_maps(&image, &image, &Settings::default()).unwrap();
    let errors = comparison.errors.unwrap();
    let (rmse, rel_mse) = (errors.rmse, errors.rel_mse);
    assert_eq!((rmse, rel_mse, errors.max_absolute, errors.psnr), (0.0, 0.0, 0.0, None));
    assert_eq!((errors.flip.mean, errors.flip.max, errors.coverage_difference), (0.0, 0.0, 0.0));
    // Rounding of f64.
    near(errors.ssim.unwrap(), 1.0, 1e-12);
    assert!(maps.relative_squared.data.iter().all(|value| *value == 0.0));
}

#[test]
fn errors_of_a_constant_offset_are_exact() {
    // Halves and quarters, which f32 and f64 hold exactly.
    let (test, reference) = (even([0.75, 0.5, 0.25, 1.0]), even([0.5, 0.25, 0.0, 1.0]));
    let settings = Settings { epsilon: 0.0625, ..Settings::default() };
    let errors = compare(&test, &reference, &settings).unwrap().errors.unwrap();
    assert_eq!(errors.rmse, 0.25);
    assert_eq!(errors.max_absolute, 0.25);
    let relative = [0.25, 0.0625, 0.0].map(|squared| 0.0625 / (squared + 0.0625));
    // Sums of 192 pixels in f64.
    near(errors.rel_mse, relative.iter().sum::<f64>() / 3.0, 1e-13);
    let shown = |linear: f32| f64::from(linear_to_srgb(linear));
    let offsets = [(0.75, 0.5), (0.5, 0.25), (0.25, 0.0)].map(|(t, r)| shown(t) - shown(r));
    let mean = offsets.iter().map(|v| v * v).sum::<f64>() / 3.0;
    near(errors.psnr.unwrap(), -10.0 * mean.log10(), 1e-12);
}

#[test]
fn psnr_of_black_and_white_is_none_at_all() {
    let (test, reference) = (even([1.0; 4]), even([0.0, 0.0, 0.0, 1.0]));
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    // The encoding of 1 is 1 but for rounding of f32.
    near(errors.psnr.unwrap(), 0.0, 1e-5);
    // Lightness alone is 100 apart, of 204 between green and blue; no feature of an even picture.
    assert!(errors.flip.mean > 0.9 && errors.flip.mean == errors.flip.max);
}

#[test]
fn ssim_of_a_constant_shift_is_the_formula() {
    let (dark, bright) = (0.3, 0.7);
    let [test, reference] = [dark, bright].map(|encoded| {
        let linear = srgb_to_linear(encoded);
        even([linear, linear, linear, 1.0])
    });
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    let (a, b) = (f64::from(dark), f64::from(bright));
    let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
    // To radiance and back in f32.
    near(errors.ssim.unwrap(), expected, 1e-6);
}

#[test]
fn windows_that_do_not_fit_give_no_ssim() {
    let settings = Settings::default();
    for (width, height, fits) in [(10, 30, false), (30, 10, false), (11, 11, true), (1, 1, false)] {
        let image = picture(width, height, |x, _| [x as f32 * 0.01, 0.2, 0.1, 1.0]);
        let errors = compare(&image, &image, &settings).unwrap().errors.unwrap();
        assert_eq!(errors.ssim.is_some(), fits, "{width} x {height}");
    }
}

#[test]
fn outliers_are_left_out_and_no_more() {
    // 2000 pixels, of which two are far off and the others a little.
    let off = |x: i32, y: i32| match (x, y) {
        (3, 4) | (30, 20) => 100.0,
        _ => 0.5,
    };
    let test = picture(50, 40, |x, y| [1.0 + off(x, y), 1.0, 1.0, 1.0]);
    let reference = picture(50, 40, |_, _| [1.0; 4]);
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    assert_eq!(errors.n_outliers, 2);
    let scale = 1.0 / (3.0 * 1.01);
    near(errors.rel_mse_without_outliers, 0.25 * scale, 1e-12);
    near(errors.rel_mse, (1998.0 * 0.25 + 2.0 * 1e4) / 2000.0 * scale, 1e-9);
    // Where all are alike exactly as many are left out.
    let test = picture(50, 40, |_, _| [1.5, 1.0, 1.0, 1.0]);
    let settings = Settings { outlier_share: 0.25, ..Settings::default() };
    let errors = compare(&test, &reference, &settings).unwrap().errors.unwrap();
    assert_eq!(errors.n_outliers, 500);
    near(errors.rel_mse_without_outliers, 0.25 * scale, 1e-12);
}

#[test]
fn coverage_counts_as_development_counts_it() {
    // Straight radiance: half covered by 0.5 is as bright over black as covered by 0.25, in numbers
    // and on a screen.
    let (test, reference) = (even([0.5, 0.5, 0.5, 0.5]), even([0.25, 0.25, 0.25, 1.0]));
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    assert_eq!((errors.rmse, errors.psnr, errors.coverage_difference), (0.0, None, 0.0));
    // Over white they differ as displayed, and not in radiance.
    let development =
        DisplayTransform { background: Background::Color([1.0; 3]), ..DisplayTransform::default() };
    let settings = Settings { development, ..Settings::default() };
    let errors = compare(&test, &reference, &settings).unwrap().errors.unwrap();
    assert_eq!(errors.rmse, 0.0);
    let [over_white, dark] = [0.75, 0.25].map(|linear| f64::from(linear_to_srgb(linear)));
    near(errors.psnr.unwrap(), psnr(over_white - dark), 1e-5);
    // What lies under no coverage is not seen by anything.
    let (test, reference) = (even([9.0, 9.0, 9.0, 0.0]), even([0.0; 4]));
    let errors = compare(&test, &reference, &settings).unwrap().errors.unwrap();
    assert_eq!((errors.max_absolute, errors.psnr, errors.flip.max), (0.0, None, 0.0));
}

#[test]
fn coverage_in_one_picture_only_is_a_share() {
    let test = picture(20, 10, |x, _| [0.1, 0.1, 0.1, if x < 5 { 1.0 } else { 0.49 }]);
    let reference = picture(20, 10, |_, y| [0.1, 0.1, 0.1, if y < 2 { 0.5 } else { 0.0 }]);
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    // 5 of 20 columns against 2 of 10 rows: 0.25 * 0.8 + 0.75 * 0.2.
    near(errors.coverage_difference, 0.35, 1e-12);
}

#[test]
fn development_decides_displayed_metrics_only() {
    let (test, reference) = (radiance(PAIRS[4].1), radiance(scene));
    let development = DisplayTransform {
        exposure_stops: 2.0,
        tone_map: ToneMap::Neutral,
        ..DisplayTransform::default()
    };
    let settings = Settings { development, ..Settings::default() };
    let [plain, bright] = [Settings::default(), settings]
        .map(|settings| compare(&test, &reference, &settings).unwrap().errors.unwrap());
    assert_eq!((plain.rmse, plain.rel_mse), (bright.rmse, bright.rel_mse));
    assert!(plain.psnr != bright.psnr && plain.flip != bright.flip && plain.ssim != bright.ssim);
}

#[test]
fn percentiles_are_values_that_so_many_pixels_do_not_exceed() {
    let data = (1..=200).rev().map(|at| at as f32).collect();
    let flip = crate::metrics::flip::summary(&Image { width: 20, height: 10, components: 1, data });
    let found = [flip.mean, flip.p50, flip.p95, flip.p99, flip.max];
    assert_eq!(found, [100.5, 100.0, 190.0, 198.0, 200.0]);
}

#[test]
fn levels_are_compared_as_they_are() {
    let (test, reference) = ([51, 0, 0, 255, 10, 10, 10, 0], [0, 0, 0, 0, 10, 10, 112, 255]);
    let errors = compare_levels(&test, &reference).unwrap();
    assert_eq!(errors.largest, [0.2, 0.4]);
    near(errors.rmse, ((51.0f64.powi(2) + 102.0f64.powi(2)) / 6.0).sqrt() / 255.0, 1e-15);
    assert_eq!(compare_levels(&test, &reference[..4]), None);
    assert_eq!(compare_levels(&[], &[]), None);
    assert_eq!(psnr(0.0), f64::INFINITY);
    near(psnr(0.1), 20.0, 1e-12);
}

#[test]
fn maps_show_where_the_errors_are() {
    let reference = picture(40, 40, |_, _| [0.2, 0.2, 0.2, 1.0]);
    let test = picture(40, 40, |x, y| {
        if (x, y) == (20, 12) { [0.8, 0.2, 0.2, 1.0] } else { [0.2, 0.2, 0.2, 1.0] }
    });
    let (_, maps) = compare_with_maps(&test, &reference, &Settings::default()).unwrap();
    let flip = maps.flip.unwrap();
    assert!(flip.pixel(20, 12)[0] > flip.pixel(24, 12)[0]);
    assert_eq!(flip.pixel(2, 38), [0.0]);
    let relative = &maps.relative_squared;
    near(f64::from(relative.pixel(20, 12)[0]), 0.36 / 0.05 / 3.0, 1e-6);
    assert_eq!(relative.data.iter().filter(|value| **value > 0.0).count(), 1);
    let colors = in_color(relative, 1.0);
    assert_eq!((colors.components, colors.pixel(0, 0)), (4, &[0.0, 0.0, 0.0, 1.0][..]));
    assert!(colors.pixel(20, 12)[1] > 0.9);
}

#[test]
fn colors_grow_evenly_lighter() {
    let n = 200;
    let data = (0..=n).map(|at| at as f32 / n as f32).collect();
    let ramp = Image { width: n + 1, height: 1, components: 1, data };
    let colors = in_color(&ramp, 1.0);
    for (at, pixel) in colors.data.chunks_exact(4).enumerate() {
        // What the polynomials were made for, see there.
        near(lightness(pixel), 0.97 * at as f64 / f64::from(n), 0.01);
    }
    let odd = Image {
        width: 4,
        height: 1,
        components: 1,
        data: vec![f32::NAN, -1.0, 7.0, f32::INFINITY],
    };
    let colors = in_color(&odd, 1.0);
    assert_eq!(colors.pixel(0, 0), [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(colors.pixel(3, 0), [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(colors.pixel(1, 0)[..3], [0.0; 3]);
    assert_eq!(colors.pixel(2, 0), in_color(&ramp, 1.0).pixel(n, 0));
}

/// L of Oklab, from 0 to 1.
///
/// Source: Ottosson 2020, "A perceptual color space for image processing".
fn lightness(pixel: &[f32]) -> f64 {
    let [r, g, b] = [0, 1, 2].map(|channel| f64::from(srgb_to_linear(pixel[channel])));
    let l = 0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b;
    let m = 0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b;
    let s = 0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b;
    0.210_454_255_3 * l.cbrt() + 0.793_617_785_0 * m.cbrt() - 0.004_072_046_8 * s.cbrt()
}
