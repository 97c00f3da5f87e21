//! A conversion takes as much memory for many points as for few. Costs 12 s.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_cloud::convert::{Selection, convert};
use surfelshop_cloud::{ReadOptions, WriteOptions};
use surfelshop_runtime::formats::PluginFormats;
use surfelshop_runtime::plugins::{Origin, Place, Registry, SearchPath, Timeouts, Trust};
use surfelshop_tests::measure::{Cost, task_of_child, test_in_child};
use surfelshop_tests::stage::build_folder;

const TEST: &str = "convert::the_memory_of_a_conversion_does_not_grow_with_the_file";

/// Points of the smaller and of the larger cloud; the smaller one has more than any format holds back.
const FEW: usize = 1_200_000;
const MANY: usize = 3_000_000;

/// Bytes of a point in memory: three doubles, a time and a colour.
const POINT_BYTES: usize = 24 + 8 + 3;

/// The most that the larger cloud may take more than the smaller one, of what its further points would.
const MOST_SHARE: f64 = 0.35;

/// Files one after the other, each made of the one before.
const CHAIN: [&str; 8] = ["in.ply", "a.las", "b.laz", "c.pcd", "d.e57", "e.xyz", "f.ply", "g.sfl"];

/// Steps whose format is known to need the whole: SFL has its scene before its points.
const WHOLE: [&str; 1] = ["g.sfl"];

fn formats() -> PluginFormats {
    let places = ["e57", "las", "pcd", "sfl", "text"].map(|name| {
        let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let path = build_folder().join(format!("{prefix}surfelshop_{name}{suffix}"));
        assert!(path.is_file(), "{} is missing: `cargo verify` builds it", path.display());
        Place::new(path, Origin::CommandLine)
    });
    let (files, trust) = (places.into(), Trust::everything());
    let registry = Registry::scan(&SearchPath { files, trust, ..SearchPath::default() });
    PluginFormats::new(Arc::new(registry), Timeouts::default())
}

/// Points on a wavy sheet with times and colours, written one by one.
fn put_points(path: &Path, n: usize) {
    let mut out = BufWriter::new(File::create(path).unwrap());
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {n}\n").unwrap();
    ["x", "y", "z"].iter().for_each(|axis| writeln!(out, "property float {axis}").unwrap());
    writeln!(out, "property double gps_time").unwrap();
    ["red", "green", "blue"].iter().for_each(|c| writeln!(out, "property uchar {c}").unwrap());
    writeln!(out, "end_header").unwrap();
    for i in 0..n {
        let (x, y) = ((i % 2000) as f32 * 0.01, (i / 2000) as f32 * 0.01);
        for value in [x, y, (x * 3.0).sin() * 0.25] {
            out.write_all(&value.to_le_bytes()).unwrap();
        }
        out.write_all(&(i as f64 * 1e-4).to_le_bytes()).unwrap();
        out.write_all(&[i as u8, (i >> 8) as u8, 7]).unwrap();
    }
    out.flush().unwrap();
}

/// Converts a file in a process of its own and returns that one's peak of memory, bytes.
fn peak_of(from: &Path, to: &Path) -> f64 {
    let task = format!("{}\n{}", from.display(), to.display());
    Cost::from_lines(&test_in_child(TEST, &task).unwrap()).unwrap().peak
}

/// What the child does.
fn convert_files(task: &str) {
    let (from, to) = task.split_once('\n').unwrap();
    let (inputs, formats) = ([PathBuf::from(from)], formats());
    let read = ReadOptions { formats: &formats, ..ReadOptions::default() };
    let write = WriteOptions { formats: &formats, ..WriteOptions::default() };
    let work = || Ok(convert(&inputs, Path::new(to), &Selection::default(), false, &read, &write)?);
    println!("{}", Cost::of(work).unwrap().1.to_line());
}

/// Invariant: the memory of a conversion does not grow with the file
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells a process its peak of memory")]
fn the_memory_of_a_conversion_does_not_grow_with_the_file() {
    if let Some(task) = task_of_child() {
        return convert_files(&task);
    }
    let folders = [FEW, MANY].map(|n| {
        let folder = tempfile::tempdir().unwrap();
        put_points(&folder.path().join(CHAIN[0]), n);
        folder
    });
    let further = ((MANY - FEW) * POINT_BYTES) as f64;
    let mut grown = Vec::new();
    for step in CHAIN.windows(2) {
        let [from, to] = [step[0], step[1]];
        let [few, many] = folders.each_ref().map(|folder| {
            let peak = peak_of(&folder.path().join(from), &folder.path().join(to));
            println!("{from} to {to}: {:.0} MB", peak * 1e-6);
            peak
        });
        let share = (many - few) / further;
        println!("{from} to {to}: each byte more takes {share:.2}");
        if share > MOST_SHARE && !WHOLE.contains(&to) {
            grown.push(format!("{from} to {to}: {share:.2}"));
        }
    }
    assert!(grown.is_empty(), "memory grows with the file: {grown:?}");
}
