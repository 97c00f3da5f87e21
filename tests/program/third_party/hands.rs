//! Tools that are led by hand, in Rust from their template and in C, and those that misbehave.
//!
//! Costs 5 s where the template is built already, and a minute where it is not.

use crate::third_party::c::cc;
use crate::third_party::project::{build, folder, project, root, surfelshop};
use std::path::{Path, PathBuf};
use std::process::Output;
use surfelshop_api::glam::DVec3;
use surfelshop_cloud::{Buffer, Cloud, ReadOptions, Transform, WriteOptions, read, write};

fn cloud(file: &Path) -> Cloud {
    read(file, &ReadOptions::default()).unwrap().cloud
}

fn sample() -> PathBuf {
    root().join("assets/sample.ply")
}

/// A stroke over the sample, of a tool, as the sample lies in a file.
fn strokes(tool: &str, file: &Path) -> PathBuf {
    let path = folder(&format!("{tool}.strokes.json"));
    let sample = cloud(file);
    let extent = sample.facts().bounds_max - sample.facts().bounds_min;
    let samples = (0..4).map(|i| {
        let at = sample.world_position(i * 40).unwrap();
        let normal = sample.normals()[i * 40];
        format!(
            "{{\"place\": [{:?}, {:?}, {:?}], \"normal\": [{:?}, {:?}, {:?}]}}",
            at.x, at.y, at.z, normal.x, normal.y, normal.z
        )
    });
    let samples = samples.collect::<Vec<_>>().join(", ");
    let radius = 0.2 * extent.max_element();
    let text = format!(
        "{{\"format\": \"surfelshop strokes\", \"version\": 1, \"strokes\": [{{\"tool\": \"{tool}\", \"values\": {{}}, \
         \"stroke\": {{\"radius\": {radius:?}, \"samples\": [{samples}]}}}}]}}"
    );
    std::fs::write(&path, text).unwrap();
    path
}

/// Leads a tool of a library along the stroke.
fn lead(tool: &str, library: &Path, sample: &Path, out: &Path) -> Output {
    let strokes = strokes(tool, sample);
    let [strokes, sample, library, out] =
        [&strokes, sample, library, out].map(|path| path.to_str().unwrap());
    surfelshop(&[
        "bake",
        sample,
        "-t",
        tool,
        "--strokes",
        strokes,
        "--plugin",
        library,
        "--trust",
        "--patience",
        "2",
        "-o",
        out,
    ])
}

fn ao(file: &Path) -> Vec<f32> {
    match cloud(file).column("ao").unwrap().values() {
        Buffer::F32(values) => values.clone(),
        other => panic!("{other:?}"),
    }
}

/// Invariant: a brush from its template and one in C do the same along a stroke, and nothing beside it
#[test]
fn a_brush_from_the_template_and_one_in_c_do_the_same() {
    let rust = build(&project("my-brush", "brush"), &["--release"], "release");
    let c = folder("libdarken_c.so");
    cc(&root().join("host/sdk/c/darken.c"), &c, &["-shared", "-fPIC"]);
    let [in_rust, in_c] = [("my-brush", &rust), ("darken-c", &c)].map(|(tool, library)| {
        let out = folder(&format!("{tool}.ply"));
        let led = lead(tool, library, &sample(), &out);
        assert!(led.status.success(), "{}", String::from_utf8_lossy(&led.stderr));
        ao(&out)
    });
    assert_eq!(in_rust, in_c);
    let darker = in_rust.iter().filter(|ao| **ao < 0.9).count();
    let same = in_rust.iter().filter(|ao| **ao == 1.0).count();
    assert!(darker > 20 && same > 20, "{darker} are darker, {same} as before");
    for library in [&rust, &c] {
        let checked = surfelshop(&["check", library.to_str().unwrap(), "--trust"]);
        let told = String::from_utf8_lossy(&checked.stdout);
        assert!(checked.status.success() && told.contains(", 0 failed, 0 limited"), "{told}");
    }
}

/// Invariant: a brush in C that panics, hangs or answers for surfels that it did not get is refused in a line, and no file
/// is written
#[test]
fn brushes_in_c_that_misbehave_are_refused() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("program/third_party/hands.c");
    for (fault, words) in
        [("PANICS", "at the worst moment"), ("HANGS", "2 s"), ("OTHERS", "surfel")]
    {
        let library = folder(&format!("hands_{}.so", fault.to_lowercase()));
        cc(&source, &library, &["-shared", "-fPIC", &format!("-DFAULT={fault}")]);
        let out = folder("never.ply");
        let led = lead("darken-c", &library, &sample(), &out);
        let told = String::from_utf8_lossy(&led.stderr);
        assert_eq!(led.status.code(), Some(1), "{fault}: {told}");
        assert!(told.contains(words) && told.trim().lines().count() == 1, "{fault}: {told}");
        assert!(!out.exists(), "{fault}");
    }
}

/// Invariant: a stroke on a model a thousand kilometres from the origin, and on one of a millionth of its size, does the same
#[test]
fn a_stroke_does_the_same_far_away_and_on_what_is_tiny() {
    let library = folder("libdarken_far.so");
    cc(&root().join("host/sdk/c/darken.c"), &library, &["-shared", "-fPIC"]);
    let led = |sample: &Path| {
        let out = folder("far-out.ply");
        let led = lead("darken-c", &library, sample, &out);
        assert!(led.status.success(), "{}", String::from_utf8_lossy(&led.stderr));
        ao(&out)
    };
    let here = led(&sample());
    let far = Transform { translation: DVec3::new(1e6, 0.0, -1e6), ..Transform::default() };
    let tiny = Transform { scale: 1e-6, ..Transform::default() };
    for (name, transform) in [("far", far), ("tiny", tiny)] {
        let file = folder(&format!("{name}.ply"));
        let moved = cloud(&sample()).transformed(&transform).unwrap();
        write(&file, &moved, &WriteOptions::default()).unwrap();
        let there = led(&file);
        assert_eq!(there.len(), here.len(), "{name}");
        // Positions are rounded otherwise there.
        let farthest = there.iter().zip(&here).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(farthest < 1e-3, "{name}: {farthest}");
    }
}
