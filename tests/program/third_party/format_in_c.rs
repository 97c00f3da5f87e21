//! The second example in C, a file format: it writes and reads what its twin in Rust does.

use crate::third_party::c::cc;
use crate::third_party::project::{build, folder, project, root, surfelshop, unit};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use surfelshop_api::UnitKind;

/// The example, compiled as its header says.
fn xyzb() -> &'static Path {
    // Once: a test must not load what another one is writing.
    static XYZB: LazyLock<PathBuf> = LazyLock::new(|| {
        let library = folder("libxyzb_c.so");
        cc(&root().join("host/sdk/c/xyzb.c"), &library, &["-shared", "-fPIC"]);
        library
    });
    &XYZB
}

/// Its twin.
fn twin() -> &'static Path {
    static TWIN: LazyLock<PathBuf> =
        LazyLock::new(|| build(&project("xyzb", "format"), &["--release"], "release"));
    &TWIN
}

/// What the program says, with a library of its own.
fn told(line: &[&str], library: &Path) -> String {
    let options = ["--trust", "--plugin", library.to_str().unwrap()];
    let ended = surfelshop(&[line, &options].concat());
    let (out, err) = (&ended.stdout, &ended.stderr);
    assert!(ended.status.success(), "{line:?}: {}", String::from_utf8_lossy(err));
    String::from_utf8_lossy(&[out.as_slice(), err].concat()).into_owned()
}

/// What is in a file, but for its name and the time that it took.
fn contents(file: &Path, options: &[&str], library: &Path) -> Json {
    let line = [&["info", file.to_str().unwrap(), "--json"], options].concat();
    let mut json: Json = serde_json::from_str(&told(&line, library)).unwrap();
    let cloud = json["clouds"][0].as_object_mut().unwrap();
    assert!(cloud.remove("file").is_some() && cloud.remove("seconds").is_some());
    assert_eq!(json["formats_loaded"], 1);
    json["clouds"][0].take()
}

/// Points with colours that are floats, of which some are no light.
const FLOATS: &str = "ply
format ascii 1.0
element vertex 5
property double x
property double y
property double z
property float red
property float green
property float blue
end_header
7000000.125 0 -1 0 0.5 1
1 2 3 0.001 0.003 0.004
1e-300 5 6 -1 2 1e30
4 5 6 0.21 0.22 0.23
7 8 9 0.7 0.8 0.9
";

/// Points without colours, and a triangle between them.
const TRIANGLE: &str = "ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float flow
comment surfelshop up z
comment surfelshop scanner 1 2 3
element face 1
property list uchar int vertex_indices
end_header
0 0 0 1
1 0 0 2
0 1 0 3
3 0 1 2
";

/// Invariant: a format in C writes the very bytes of its twin in Rust, and reads the same
#[test]
fn the_format_in_c_writes_and_reads_what_its_twin_in_rust_does() {
    let libraries = [xyzb(), twin()];
    let units = libraries.map(|library| unit(library, UnitKind::Format));
    assert_eq!(units[0].description, units[1].description);
    assert_eq!(units[0].unit.files, units[1].unit.files);

    let sample = root().join("assets/sample.ply");
    let [floats, triangle] = [("floats.ply", FLOATS), ("triangle.ply", TRIANGLE)].map(|file| {
        std::fs::write(folder(file.0), file.1).unwrap();
        folder(file.0)
    });
    for (cloud, lost) in [
        (&sample, &["`normal` was left out", "`radius` was left out"][..]),
        (&floats, &["colours were rounded to 8 bits"]),
        (
            &triangle,
            &["`flow` was left out", "there are no colours", "triangles", "points up", "scanner"],
        ),
    ] {
        let files = [folder("of_c.xyzb"), folder("of_rust.xyzb")];
        for (file, library) in files.iter().zip(libraries) {
            let line = ["convert", cloud.to_str().unwrap(), file.to_str().unwrap()];
            let told = told(&line, library);
            for words in lost {
                assert!(told.contains(words), "{told}");
            }
        }
        let [c, rust] = files.each_ref().map(|file| std::fs::read(file).unwrap());
        assert!(c == rust && c.len() > 100, "{}", cloud.display());
        let [c, rust] =
            libraries.map(|library| contents(&files[0], &["--format-set", "up=y"], library));
        assert_eq!(c, rust);
        assert_eq!(c["header"]["up"], "y");
    }
}

#[test]
fn damaged_files_are_warned_of_alike() {
    let point = [0u8; 27];
    let head = |n: u64| [b"points xyzb 1\n".as_slice(), &n.to_le_bytes()].concat();
    for (bytes, words) in [
        ([head(3), point.repeat(2)].concat(), "3 points are announced, 2 are there"),
        ([head(u64::MAX), point.repeat(2)].concat(), "18446744073709551615 points are announced"),
        ([head(1), point.repeat(2)].concat(), "the bytes behind the last point were left out"),
    ] {
        let file = folder("damaged.xyzb");
        std::fs::write(&file, bytes).unwrap();
        let [c, rust] = [xyzb(), twin()].map(|library| contents(&file, &[], library));
        assert_eq!(c, rust);
        assert!(c["warnings"][0].as_str().unwrap().contains(words), "{c}");
    }
}

#[test]
fn the_format_in_c_is_listed_with_its_files_and_passes_every_case() {
    let library = xyzb().to_str().unwrap();
    let listed = surfelshop(&["plugins", "--plugin", library]);
    let told = String::from_utf8_lossy(&listed.stdout);
    let row = "format    xyzb-c (Xyzb in C): Points with colours in a simple file.";
    assert!(told.contains(row) && told.contains("files     .xyzb; read and written"), "{told}");

    let checked = surfelshop(&["check", library, "--trust"]);
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && told.contains(", 0 failed, 0 limited"), "{told}");
}
