//! Displayed metrics against twins, and against what other programs say of the same pictures.

use super::pictures::{PAIRS, displayed, radiance, scene};
use super::twin;
use crate::metrics::{self, Settings, compare_with_maps};

/// What other programs say of the pairs. FLIP: the authors' program 1.6 in C++, which computes in f32,
/// for 67 pixels per degree: mean, median, 99th percentile, largest; and the mean for 30. SSIM and
/// PSNR: scikit-image 0.26 in f64.
const OTHERS: [([f64; 5], f64, f64); 5] = [
    ([0.133_142, 0.126_329, 0.289_184, 0.430_974, 0.259_147], 0.442_153_946_1, 23.260_581_138_2),
    ([0.079_364, 0.017_356, 0.495_786, 0.635_974, 0.145_608], 0.812_593_257_0, 26.478_226_926_4),
    ([0.139_296, 0.086_620, 0.518_155, 0.708_350, 0.180_203], 0.777_116_462_3, 23.333_012_955_4),
    ([0.278_729, 0.166_706, 0.868_091, 0.971_383, 0.210_720], 0.444_669_698_1, 16.389_038_969_3),
    ([0.398_386, 0.391_264, 0.530_710, 0.604_535, 0.398_529], 0.999_121_227_8, 19.246_735_771_7),
];

/// Rounding of f32 in the authors' program, and six digits printed.
const FLIP_TOLERANCE: f64 = 2e-5;

/// Invariant: FLIP, SSIM and PSNR of five pairs of pictures are what FLIP's authors' program,
/// scikit-image and twins in f64 say, FLIP at every pixel
#[test]
fn flip_ssim_and_psnr_are_what_other_programs_say() {
    let reference = radiance(scene);
    for ((name, pixel), (flip, ssim, psnr)) in PAIRS.into_iter().zip(OTHERS) {
        let settings = Settings::default();
        let test = radiance(pixel);
        let compared = metrics::compare(&test, &reference, &settings).unwrap();
        let errors = compared.errors.unwrap();
        let coarse = Settings { pixels_per_degree: 30.0, ..settings };
        let coarse = metrics::compare(&test, &reference, &coarse).unwrap().errors.unwrap();
        let found = errors.flip;
        let found = [found.mean, found.p50, found.p99, found.max, coarse.flip.mean];
        for (found, expected) in found.into_iter().zip(flip) {
            assert!((found - expected).abs() < FLIP_TOLERANCE, "{name}: {found}, not {expected}");
        }
        // Levels went to radiance and back in f32: 1e-6 of a value, and SSIM divides by variances
        // down to 9e-4.
        let found = errors.ssim.unwrap();
        assert!((found - ssim).abs() < 1e-5, "{name}: SSIM {found}, not {ssim}");
        let found = errors.psnr.unwrap();
        assert!((found - psnr).abs() < 1e-4, "{name}: PSNR {found}, not {psnr}");
    }
}

#[test]
fn every_pixel_of_flip_is_the_twins() {
    let reference = displayed(scene);
    for (name, pixel) in PAIRS {
        let test = displayed(pixel);
        for ppd in [67.0, 20.0] {
            let found = metrics::flip::map(&test, &reference, ppd);
            let expected = twin::flip(&test, &reference, ppd);
            assert_eq!(found.data.len(), expected.len());
            for (at, (found, expected)) in found.data.iter().zip(&expected).enumerate() {
                // Both are f64 until the map is f32; the twin's matrices have ten digits, and where
                // pictures are equal a power of 0.7 makes 1e-8 of their rounding 1e-14.
                let apart = (f64::from(*found) - expected).abs();
                assert!(apart < 1e-6, "{name}, {ppd}, pixel {at}: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn ssim_and_psnr_are_the_twins() {
    let reference = displayed(scene);
    for (name, pixel) in PAIRS {
        let test = displayed(pixel);
        let found = metrics::ssim::mean(&test, &reference).unwrap();
        let expected = twin::ssim(&test, &reference);
        // Variances as differences of means lose 1e-16 of 9e-4 and more.
        assert!((found - expected).abs() < 1e-11, "{name}: {found}, not {expected}");
        let found = metrics::displayed::psnr(&test, &reference).unwrap();
        let expected = twin::psnr(&test, &reference);
        assert!((found - expected).abs() < 1e-10, "{name}: {found}, not {expected}");
    }
}

/// Invariant: results do not depend on the number of threads
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let (test, reference) = (radiance(PAIRS[0].1), radiance(scene));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| compare_with_maps(&test, &reference, &Settings::default()).unwrap())
    };
    let (one, two) = (on(1), on(5));
    assert_eq!(one.0, two.0);
    assert_eq!(one.1.flip.unwrap().data, two.1.flip.unwrap().data);
}
