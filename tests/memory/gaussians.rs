//! Gaussians of a trainer's file become a cloud without a second copy of their columns.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use surfelshop_cloud::{ReadOptions, read};
use surfelshop_tests::measure::{Cost, task_of_child, test_in_child};

/// Floats of a Gaussian with spherical harmonics of order 3.
const FLOATS: usize = 62;

/// The most memory a load may take, in sizes of what it reads.
const MOST_MEMORY: f64 = 1.4;

fn write_file(path: &Path, n: usize) {
    let mut file = BufWriter::new(File::create(path).unwrap());
    write!(file, "ply\nformat binary_little_endian 1.0\nelement vertex {n}\n").unwrap();
    let names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"].map(str::to_owned);
    let rest = (0..45).map(|i| format!("f_rest_{i}"));
    let last = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];
    for name in names.into_iter().chain(rest).chain(last.map(str::to_owned)) {
        writeln!(file, "property float {name}").unwrap();
    }
    writeln!(file, "end_header").unwrap();
    for i in 0..n {
        let value = |k: usize| (((i * FLOATS + k) % 1013) as f32 / 1013.0).to_le_bytes();
        file.write_all((0..FLOATS).map(value).collect::<Vec<_>>().as_flattened()).unwrap();
    }
    file.flush().unwrap();
}

/// Invariant: a load of a trainer's Gaussians takes at most 1.4 times the bytes of their properties
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells a process its peak of memory")]
fn gaussians_are_loaded_without_a_second_copy() {
    if let Some(file) = task_of_child() {
        let load = || {
            let loaded = read(&file, &ReadOptions::default())?;
            assert!(loaded.summary.splats.is_some());
            Ok(loaded)
        };
        return println!("{}", Cost::of(load).unwrap().1.to_line());
    }
    let folder = tempfile::tempdir().unwrap();
    // What a process and its threads take besides is in both.
    let [few, many] = [1000, 201_000].map(|n| {
        let path = folder.path().join(format!("{n}.ply"));
        write_file(&path, n);
        let test = "gaussians::gaussians_are_loaded_without_a_second_copy";
        let lines = test_in_child(test, path.to_str().unwrap()).unwrap();
        Cost::from_lines(&lines).unwrap().peak
    });
    let share = (many - few) / (200_000.0 * 4.0 * FLOATS as f64);
    println!("{share:.2} times the properties");
    assert!((1.0..MOST_MEMORY).contains(&share), "{share}");
}
