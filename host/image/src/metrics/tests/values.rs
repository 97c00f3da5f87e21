//! Values of points of which every number is known.

use crate::metrics::{ValueErrors, compare_values};

#[test]
fn errors_of_values_are_those_computed_by_hand() {
    // 199 errors of a quarter, and one of -64: halves, which f64 holds exactly.
    let reference: Vec<f64> = (0..200).map(f64::from).collect();
    let mut values: Vec<f64> = reference.iter().map(|value| value + 0.25).collect();
    values[77] = reference[77] - 64.0;
    let found = compare_values(&values, &reference, 0.0).unwrap();
    let mean_square: f64 = (199.0 * 0.0625 + 4096.0) / 200.0;
    let expected = ValueErrors {
        n_values: 200,
        rmse: mean_square.sqrt(),
        rmse_without_worst: 0.25,
        bias: (199.0 * 0.25 - 64.0) / 200.0,
        p99: 0.25,
        max_absolute: 64.0,
        noise: 0.0,
    };
    assert_eq!(found, expected);
}

#[test]
fn the_reference_s_noise_is_taken_off_and_no_more() {
    let found = compare_values(&[1.0, 3.0], &[0.0, 0.0], 1.0).unwrap();
    assert_eq!((found.rmse, found.noise), (2.0, 1.0));
    let found = compare_values(&[1.0, 3.0], &[0.0, 0.0], 9.0).unwrap();
    assert_eq!((found.rmse, found.noise), (0.0, 3.0));
}

#[test]
fn values_that_cannot_be_compared_are_said_in_one_line() {
    let refused = |values: &[f64], reference: &[f64]| {
        compare_values(values, reference, 0.0).unwrap_err().to_string()
    };
    assert!(refused(&[1.0], &[1.0, 2.0]).contains("1 values and 2 of the reference"));
    assert!(refused(&[], &[]).contains("of 0 values"));
    assert!(refused(&[f64::NAN, 1.0], &[1.0, 1.0]).contains("of 2 values, 1 are not finite"));
    let reference = refused(&[1.0, 1.0], &[1.0, f64::INFINITY]);
    assert!(reference.contains("of 2 values of the reference, 1"), "{reference}");
}
