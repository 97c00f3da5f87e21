//! Pictures that cannot be compared, or are not averaged.

use super::pictures::{PAIRS, picture, radiance, scene};
use crate::Image;
use crate::display_transform::{Background, DisplayTransform};
use crate::metrics::{Comparison, MetricsError, Reference, Settings, compare, compare_with_maps};

fn gray(width: i32, height: i32) -> Image {
    picture(width, height, |_, _| [0.5; 4])
}

/// The line that a comparison is refused with.
fn refused(test: &Image, reference: Reference<'_>, settings: &Settings) -> String {
    let line = compare(test, reference, settings).unwrap_err().to_string();
    assert!(!line.contains('\n') && line.len() < 160, "{line}");
    line
}

#[test]
fn what_cannot_be_compared_is_said_in_one_line() {
    let (good, settings) = (gray(4, 3), Settings::default());
    let line = |test: &Image| refused(test, Reference::from(&good), &settings);
    assert_eq!(
        line(&gray(5, 3)),
        "the test has 5 x 3 pixels and the reference 4 x 3: only pictures of one size can be compared"
    );
    let mono = Image { width: 4, height: 3, components: 1, data: vec![0.0; 12] };
    assert!(line(&mono).starts_with("the test has 1 values a pixel"));
    let short = Image { data: vec![0.0; 44], ..gray(4, 3) };
    assert_eq!(line(&short), "the test has 44 values; 4 x 3 pixels have 48");
    for (width, height) in [(0, 0), (0, 3), (3, 0)] {
        let empty = gray(width, height);
        let line = refused(&empty, Reference::from(&empty), &settings);
        assert!(line.contains("there is nothing to compare"), "{line}");
    }
    let huge = Image { width: u32::MAX, height: u32::MAX, components: 4, data: Vec::new() };
    assert!(line(&huge).starts_with("the test has 0 values"));
}

#[test]
fn references_and_variances_must_be_ones() {
    let (good, settings) = (gray(4, 3), Settings::default());
    let mut broken = gray(4, 3);
    broken.data[7] = f32::NAN;
    broken.data[8] = f32::INFINITY;
    assert_eq!(
        refused(&good, Reference::from(&broken), &settings),
        "2 of 12 pixels of the reference are not finite: nothing can be measured against it"
    );
    let with = |variance: &Image| {
        refused(&good, Reference { picture: &good, variance: Some(variance) }, &settings)
    };
    assert!(with(&gray(3, 4)).starts_with("the variance of"));
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        let variance =
            picture(4, 3, |x, y| [0.1, if (x, y) == (1, 1) { bad } else { 0.0 }, 0.0, 0.0]);
        let line = with(&variance);
        assert!(line.starts_with("1 of 12 pixels of the reference's variance"), "{line}");
    }
}

#[test]
fn settings_out_of_range_are_named() {
    let good = gray(4, 3);
    let plain = Settings::default();
    let dark = DisplayTransform { exposure_stops: f32::NAN, ..DisplayTransform::default() };
    for (settings, expected) in [
        (Settings { epsilon: 0.0, ..plain }, "epsilon of relMSE is 0; it must be 1e-12 to 1e12"),
        (
            Settings { outlier_share: 1.0, ..plain },
            "the share of outliers is 1; it must be 0 to below 1",
        ),
        (
            Settings { pixels_per_degree: f64::NAN, ..plain },
            "pixels per degree is NaN; it must be 1 to 1000",
        ),
        (
            Settings { development: dark, ..plain },
            "the exposure in stops is NaN; it must be finite",
        ),
    ] {
        assert_eq!(refused(&good, Reference::from(&good), &settings), expected);
    }
}

/// Invariant: a picture with pixels that are not finite is counted and never averaged
#[test]
fn pixels_that_are_not_finite_are_counted_and_nothing_is_averaged() {
    let reference = radiance(scene);
    let mut test = radiance(PAIRS[0].1);
    test.data[0] = f32::NAN;
    test.data[2] = f32::NAN;
    test.data[4 * 100 + 3] = f32::INFINITY;
    test.data[4 * 200 + 1] = f32::NEG_INFINITY;
    let (comparison, maps) = compare_with_maps(&test, &reference, &Settings::default()).unwrap();
    assert_eq!((comparison.n_not_finite, comparison.errors), (3, None));
    assert!(maps.flip.is_none());
    let marked: Vec<usize> = maps
        .relative_squared
        .data
        .iter()
        .enumerate()
        .filter(|(_, v)| v.is_nan())
        .map(|(at, _)| at)
        .collect();
    assert_eq!(marked, [0, 100, 200]);
}

#[test]
fn numbers_of_extreme_pictures_are_finite() {
    let settings = Settings { epsilon: 1e-12, ..Settings::default() };
    let extremes = [f32::MAX, f32::MIN, f32::MIN_POSITIVE, 0.0, 1e-45];
    let test =
        picture(16, 16, |x, y| [extremes[(x % 5) as usize], extremes[(y % 5) as usize], 1.0, 7.0]);
    let reference = picture(16, 16, |x, y| [extremes[(y % 5) as usize], 0.0, 1e30, (x % 2) as f32]);
    for ppd in [1.0, 1000.0] {
        let settings = Settings { pixels_per_degree: ppd, ..settings };
        let (comparison, maps) = compare_with_maps(&test, &reference, &settings).unwrap();
        let named = comparison.errors.unwrap().named();
        assert!(named.iter().all(|(_, value)| value.is_finite()), "{named:?}");
        assert!(maps.flip.unwrap().data.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(maps.relative_squared.data.iter().all(|v| v.is_finite()));
    }
}

#[test]
fn comparisons_are_written_and_read_back() {
    let (test, reference) = (radiance(PAIRS[2].1), radiance(scene));
    let background = Background::Color([0.25, 0.5, 0.75]);
    let development = DisplayTransform { background, ..DisplayTransform::default() };
    let settings = Settings { development, ..Settings::default() };
    let mut broken = test.clone();
    broken.data[5] = f32::NAN;
    for (test, reference) in [(&test, &reference), (&test, &test), (&broken, &test)] {
        let comparison = compare(test, reference, &settings).unwrap();
        let text = serde_json::to_string(&comparison).unwrap();
        let back: Comparison = serde_json::from_str(&text).unwrap();
        assert_eq!((back.n_not_finite, back.settings), (comparison.n_not_finite, settings));
        assert_eq!(serde_json::to_string(&back).unwrap(), text);
    }
    let error = compare(&gray(1, 1), &gray(0, 1), &settings).unwrap_err();
    assert_eq!(error, MetricsError::Empty { width: 0, height: 1 });
}

#[test]
fn every_number_has_a_name_of_its_own() {
    let (test, reference) = (radiance(PAIRS[1].1), radiance(scene));
    let errors = compare(&test, &reference, &Settings::default()).unwrap().errors.unwrap();
    let named = errors.named();
    let mut names: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 12);
    let of = |name: &str| named.iter().find(|(known, _)| *known == name).unwrap().1;
    assert_eq!((of("rmse"), of("flip.p95")), (errors.rmse, errors.flip.p95));
    let same = compare(&test, &test, &Settings::default()).unwrap().errors.unwrap().named();
    assert!(same.contains(&("psnr", f64::INFINITY)));
}
