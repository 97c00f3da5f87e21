use super::*;
use std::cell::{Cell, RefCell};
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
    let reported = RefCell::new(Vec::new());
    let progress = |fraction: f64| {
        reported.borrow_mut().push(fraction);
        ControlFlow::Continue(())
    };
    read(path, &ReadOptions { progress: &progress, ..Default::default() }).unwrap();
    let reported = reported.into_inner();
    assert!(reported.windows(2).all(|pair| pair[0] <= pair[1]), "{reported:?}");
    assert!(
        reported.len() > 5
            && reported[0] < 0.05
            && reported.last().is_some_and(|&last| last > 0.99)
    );
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

/// A file with normals and enough points that a block of them is less than a hundredth.
fn large_file(more: &[&str]) -> (TempDir, PathBuf) {
    let n = 450_000u32;
    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {n}\n").into_bytes();
    for name in ["x", "y", "z", "nx", "ny", "nz"].iter().chain(more) {
        bytes.extend(format!("property float {name}\n").bytes());
    }
    bytes.extend(b"end_header\n");
    for i in 0..n {
        let row = [(i % 700) as f32, 0.0, (i / 700) as f32, 0.0, 1.0, 0.0];
        bytes.extend(row.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(more.iter().flat_map(|_| 0.7f32.to_le_bytes()));
    }
    file(&bytes)
}

#[test]
fn every_hundredth_of_a_complete_file_is_told_of() {
    let (_folder, path) = large_file(&["radius"]);
    let reported = RefCell::new(vec![0.0]);
    let progress = |fraction: f64| {
        reported.borrow_mut().push(fraction);
        ControlFlow::Continue(())
    };
    let loaded = read(path, &ReadOptions { progress: &progress, ..Default::default() }).unwrap();
    assert_eq!(loaded.summary.radii.given, 450_000);
    let reported = reported.into_inner();
    let steps = reported.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(steps.clone().all(|step| step >= 0.0), "{reported:?}");
    let widest = steps.fold(0.0, f64::max);
    assert!(widest <= 0.01, "{widest}");
}

#[test]
fn nothing_is_done_after_a_wish_to_stop() {
    let (_folder, path) = large_file(&[]);
    for stop_at in [1, 2, 50, 100, 111, 112, 150] {
        let count = Cell::new(0);
        let progress = |_: f64| {
            count.set(count.get() + 1);
            if count.get() >= stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let options = ReadOptions { progress: &progress, ..Default::default() };
        let error = read(&path, &options).unwrap_err();
        assert!(matches!(error.fault, crate::ReadFault::Cancelled), "{error}");
        assert_eq!(count.get(), stop_at, "it asked again");
    }
}

/// Files that need work of every kind: bare points, points whose normals and radii are no good,
/// points that come after faces, and meshes, in text as well.
fn files_to_work_on() -> Vec<Vec<u8>> {
    let rows: Vec<Vec<f64>> = (0..200)
        .map(|i| {
            let (a, b) = (f64::from(i) * 2.4, f64::from(i) * 0.0157);
            vec![a.cos() * b.sin(), a.sin() * b.sin(), b.cos()]
        })
        .collect();
    let shaped = also(&XYZ, &["float nx", "float ny", "float nz", "float radius"]);
    let holes = with(rows.clone(), |i| {
        let size = f64::from(i % 3 == 0);
        let mut given: Vec<f64> = rows[i].iter().map(|c| c * size).collect();
        given.push(size * 0.1);
        given
    });
    let faces: Vec<Vec<f64>> = (0..50).map(|i| vec![f64::from(i); 3]).collect();
    let indices = ["int a", "int b", "int c"];
    let mut files = Vec::new();
    for encoding in ["ascii", "binary_little_endian"] {
        let ply = || Ply::new(encoding);
        files.push(ply().element("vertex", &XYZ, &rows).bytes());
        files.push(ply().element("vertex", &shaped, &holes).bytes());
        files.push(ply().element("face", &indices, &faces).element("vertex", &XYZ, &rows).bytes());
        let mut mesh = ply()
            .element("vertex", &XYZ, &rows)
            .line("element face 50")
            .line("property list uchar int vertex_indices");
        for i in 0..50 {
            mesh.value("uchar", 3.0);
            (i..i + 3).for_each(|corner| mesh.value("int", f64::from(corner)));
            mesh.end_row();
        }
        files.push(mesh.bytes());
    }
    let text = |row: &Vec<f64>| format!("v {} {} {}\n", row[0], row[1], row[2]);
    files.push(rows.iter().map(text).collect::<String>().into_bytes());
    files
}

/// Invariant: a load stops at whatever question it is asked to stop at, and no part of it is
/// silent
#[test]
fn a_load_stops_at_every_question_and_asks_no_other() {
    for bytes in files_to_work_on() {
        let (_folder, path) = file(&bytes);
        let mut stop_at = 0;
        loop {
            stop_at += 1;
            let count = Cell::new(0);
            let reported = Cell::new(0.0);
            let progress = |fraction: f64| {
                assert!(
                    (reported.get()..=1.0).contains(&fraction),
                    "{fraction} after {}",
                    reported.get()
                );
                reported.set(fraction);
                count.set(count.get() + 1);
                if count.get() < stop_at {
                    ControlFlow::Continue(())
                } else {
                    ControlFlow::Break(())
                }
            };
            let result = read(&path, &ReadOptions { progress: &progress, ..Default::default() });
            // The number of questions may differ by those asked while the tree of neighbours grows.
            if count.get() < stop_at {
                assert_eq!(reported.get(), 1.0);
                assert_eq!(result.unwrap().cloud.len(), 200);
                break;
            }
            assert_eq!(count.get(), stop_at, "it asked again");
            let fault = result.unwrap_err().fault;
            assert!(matches!(fault, crate::ReadFault::Cancelled), "{fault}");
        }
        assert!(stop_at > 30, "{stop_at}");
    }
}

#[test]
fn no_part_of_an_estimate_is_silent() {
    let (_folder, path) = file(&sphere_file());
    // One thread, for which blocks are smallest: their number is that of the points alone.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let widest = pool.install(|| {
        let (last, widest) = (Cell::new(0.0), Cell::new(0.0f64));
        let progress = |fraction: f64| {
            widest.set(widest.get().max(fraction - last.replace(fraction)));
            ControlFlow::Continue(())
        };
        read(path, &ReadOptions { progress: &progress, ..Default::default() }).unwrap();
        widest.get()
    });
    assert!(widest < 0.05, "{widest}");
}

#[cfg(unix)]
#[test]
fn devices_are_refused() {
    let error = read("/dev/zero", &ReadOptions::default()).unwrap_err().to_string();
    assert_eq!(error, "/dev/zero: expected a file, found a pipe or device; name the file itself");
}
