//! Errors of several pictures against those of one that holds them all.

use crate::Image;
use crate::metrics::{Errors, Settings, compare};

/// A picture of grey pixels.
fn grey(values: &[f32]) -> Image {
    let data = values.iter().flat_map(|v| [*v, *v, *v, 1.0]).collect();
    Image { width: values.len() as u32, height: 1, components: 4, data }
}

fn errors(test: &[f32], reference: &[f32]) -> Errors {
    compare(&grey(test), &grey(reference), &Settings::default()).unwrap().errors.unwrap()
}

#[test]
fn pooled_squares_are_those_of_all_pixels() {
    let (tests, references) = ([[0.5, 0.25], [1.0, 0.75]], [[0.25, 0.25], [0.5, 0.5]]);
    let parts = [errors(&tests[0], &references[0]), errors(&tests[1], &references[1])];
    let pooled = Errors::pooled(&[&parts[0], &parts[1]]).unwrap();
    let whole = errors(&tests.concat(), &references.concat());
    for (found, expected) in [
        (pooled.rmse, whole.rmse),
        (pooled.rel_mse, whole.rel_mse),
        (pooled.max_absolute, whole.max_absolute),
        (pooled.psnr.unwrap(), whole.psnr.unwrap()),
        (pooled.coverage_difference, whole.coverage_difference),
    ] {
        // Sums of a few numbers in another order; of `psnr` a logarithm of f32 levels.
        assert!((found - expected).abs() <= 1e-6 * expected.abs(), "{found} {expected}");
    }
    assert_eq!(pooled.ssim, None, "smaller than its window");
}

#[test]
fn one_picture_pools_to_itself_and_none_to_nothing() {
    let one = errors(&[0.5, 0.25], &[0.25, 0.25]);
    assert_eq!(Errors::pooled(&[&one]), Some(one));
    assert_eq!(Errors::pooled(&[]), None);
}

#[test]
fn equal_pictures_beside_others_count_as_without_error() {
    let (equal, other) = (errors(&[0.5], &[0.5]), errors(&[0.5], &[0.25]));
    let pooled = Errors::pooled(&[&equal, &other]).unwrap();
    // Half the squared error: 10 log10(2) decibels more.
    let gained = pooled.psnr.unwrap() - other.psnr.unwrap();
    assert!((gained - 10.0 * 2f64.log10()).abs() < 1e-9, "{gained}");
    assert_eq!(Errors::pooled(&[&equal, &equal]).unwrap().psnr, None);
}
