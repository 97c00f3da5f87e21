use super::*;
use std::cell::RefCell;
use std::ops::ControlFlow;

fn sphere_file() -> Vec<u8> {
    let rows: Vec<Vec<f64>> = (0..20_000)
        .map(|i| {
            let (a, b) = (f64::from(i) * 0.61, f64::from(i) * 0.000_157);
            vec![a.cos() * b.sin(), a.sin() * b.sin(), b.cos()]
        })
        .collect();
    Ply::new("binary_little_endian").element("vertex", &XYZ, &rows).bytes()
}

#[test]
fn progress_rises_from_zero_to_one() {
    let (_folder, path) = file(&sphere_file());
    let told = RefCell::new(Vec::new());
    let progress = |fraction: f64| {
        told.borrow_mut().push(fraction);
        ControlFlow::Continue(())
    };
    read(path, &ReadOptions { progress: &progress, ..Default::default() }).unwrap();
    let told = told.into_inner();
    assert!(told.windows(2).all(|pair| pair[0] <= pair[1]), "{told:?}");
    assert!(told.len() > 5 && told[0] < 0.05 && told.last().is_some_and(|&last| last > 0.99));
}

#[test]
fn reading_stops_when_asked_at_any_point() {
    let (_folder, path) = file(&sphere_file());
    for limit in [0.0, 0.2, 0.5, 0.7, 0.9] {
        let progress = |fraction: f64| {
            if fraction >= limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let options = ReadOptions { progress: &progress, ..Default::default() };
        let error = read(&path, &options).unwrap_err().to_string();
        assert!(error.ends_with("reading was cancelled"), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn devices_are_refused() {
    let error = read("/dev/zero", &ReadOptions::default()).unwrap_err().to_string();
    assert_eq!(error, "/dev/zero: expected a file, found a pipe or device; name the file itself");
}
