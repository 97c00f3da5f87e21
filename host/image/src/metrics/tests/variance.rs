//! References that are averages of random samples.

use super::pictures::{hash, picture};
use crate::metrics::{Reference, Settings, Squared, compare};
use crate::{Image, TracedPicture};
use std::time::Duration;

const SIDE: i32 = 32;
const REFERENCES: u32 = 400;

/// The truth that references are noisy pictures of.
fn truth(x: i32, y: i32) -> [f32; 4] {
    [0.5 + 0.02 * x as f32, 0.6 + 0.01 * y as f32, 0.8, if x < 20 { 1.0 } else { 0.5 }]
}

/// Variance of radiance times coverage in each channel, largest at the lower right: at most 0.02 of the squared
/// radiance times coverage.
fn variance(x: i32, y: i32) -> [f32; 4] {
    let deviation = 0.03 + 0.03 * (x + y) as f32 / (2 * SIDE) as f32;
    [deviation * deviation, 0.001, 0.0, f32::NAN]
}

/// A sum of twelve even distributions less their mean: mean 0, variance 1.
fn normal(seed: u32) -> f32 {
    let even = |at| f64::from(hash(hash(seed) ^ at)) / f64::from(u32::MAX);
    ((0..12).map(even).sum::<f64>() - 6.0) as f32
}

/// The truth with noise of that variance.
fn noisy(number: u32) -> Image {
    picture(SIDE, SIDE, |x, y| {
        let (mut pixel, variance) = (truth(x, y), variance(x, y));
        for channel in 0..3 {
            let seed = ((number * 1024 + (y * SIDE + x) as u32) << 2) + channel as u32;
            pixel[channel] += normal(seed) * variance[channel].sqrt() / pixel[3];
        }
        pixel
    })
}

/// Means and their standard errors over many references, of the estimates with and without the
/// variance taken off.
fn measured(test: &Image, with_variance: bool) -> [(f64, f64); 2] {
    let variance = picture(SIDE, SIDE, variance);
    let variance = with_variance.then_some(&variance);
    let estimates: Vec<Squared> = (0..REFERENCES)
        .map(|number| {
            let reference = Reference { picture: &noisy(number), variance };
            compare(test, reference, &Settings::default()).unwrap().errors.unwrap().estimate
        })
        .collect();
    let n = f64::from(REFERENCES);
    [|e: &Squared| e.mse, |e: &Squared| e.rel_mse].map(|of| {
        let mean = estimates.iter().map(of).sum::<f64>() / n;
        let spread = estimates.iter().map(|e| (of(e) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (spread / n).sqrt())
    })
}

/// Invariant: errors against a noisy reference of known variance are right on average
#[test]
fn errors_against_noisy_references_are_right_on_average() {
    let exact = picture(SIDE, SIDE, truth);
    let test = picture(SIDE, SIDE, |x, y| {
        let [r, g, b, coverage] = truth(x, y);
        [r + 0.05, g - 0.03, b, coverage]
    });
    let expected = compare(&test, &exact, &Settings::default()).unwrap().errors.unwrap();
    let [(mse, deviation), (rel_mse, _)] = measured(&test, true);
    // Four standard errors of the mean of all references: by chance once in 16 000 such tests, and
    // the noise is always the same.
    let apart = (mse - expected.estimate.mse).abs();
    assert!(apart < 4.0 * deviation, "{mse}, not {}; {deviation}", expected.estimate.mse);
    // Without it, the error is too large by the variance, far more than this tells apart.
    let [(raw, _), (raw_relative, _)] = measured(&test, false);
    assert!(raw - expected.estimate.mse > 100.0 * deviation, "{raw}");
    // Relative errors keep what is of second order: several times 0.02 of what they had too much.
    let left = (rel_mse - expected.rel_mse).abs() / (raw_relative - expected.rel_mse);
    assert!(left < 0.1, "{left}");
}

#[test]
fn a_perfect_test_has_an_estimate_around_zero_and_an_error_of_none_below() {
    let test = picture(SIDE, SIDE, truth);
    let [(mse, deviation), _] = measured(&test, true);
    assert!(mse.abs() < 4.0 * deviation, "{mse}, {deviation}");
    let variance = picture(SIDE, SIDE, variance);
    let mut n_negative = 0;
    for number in 0..20 {
        let reference = Reference { picture: &noisy(number), variance: Some(&variance) };
        let errors = compare(&test, reference, &Settings::default()).unwrap().errors.unwrap();
        n_negative += u32::from(errors.estimate.mse < 0.0);
        assert_eq!(errors.rmse, errors.estimate.mse.max(0.0).sqrt());
        assert!(errors.rel_mse >= 0.0 && errors.rel_mse_without_outliers >= 0.0);
        // What was measured is what it is without a variance.
        let plain = compare(&test, reference.picture, &Settings::default()).unwrap();
        assert_eq!(errors.measured, plain.errors.unwrap().estimate);
    }
    assert!((1..20).contains(&n_negative), "{n_negative}");
}

#[test]
fn the_noise_is_the_mean_of_the_variance() {
    let reference = picture(SIDE, SIDE, |_, _| [0.3, 0.3, 0.3, 1.0]);
    let variance = picture(SIDE, SIDE, |_, _| [0.25, 0.5, 0.75, 0.0]);
    let noisy = Reference { picture: &reference, variance: Some(&variance) };
    let errors = compare(&reference, noisy, &Settings::default()).unwrap().errors.unwrap();
    assert_eq!((errors.reference_noise.mse, errors.estimate.mse, errors.rmse), (0.5, -0.5, 0.0));
    // 0.3 is not exact in f32.
    assert!((errors.reference_noise.rel_mse - 0.5 / 0.1).abs() < 1e-6);
    assert!((errors.reference_noise.rel_mse_without_outliers - 0.5 / 0.1).abs() < 1e-6);
}

#[test]
fn traced_pictures_bring_their_variance() {
    let traced = |samples| TracedPicture {
        color: picture(SIDE, SIDE, truth),
        variance: picture(SIDE, SIDE, |_, _| [0.25; 4]),
        halves: [picture(SIDE, SIDE, truth), picture(SIDE, SIDE, truth)],
        samples,
        took: Duration::ZERO,
    };
    for (samples, noise) in [(1, 0.0), (2, 0.25)] {
        let traced = traced(samples);
        let compared = compare(&traced.color, &traced, &Settings::default()).unwrap();
        assert_eq!(compared.errors.unwrap().reference_noise.mse, noise);
    }
}
