//! Graphs in files: kept by `--save-graph`, drawn by `--graph`, those of earlier revisions among them.

use crate::cli::program::{TestFolder, read_png};
use std::path::{Path, PathBuf};

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");

/// Where the stored pictures were drawn from, by what is drawn.
const SAMPLE_FROM: &str = "2.15903046331131,2.5276005638755947,3.8247997419520763;\
                           -0.01952570676803589,0.9423533082008362,0.05172586441040039";
const SPLATS_FROM: &str = "2.3137441744367027,2.6370805787123333,4.099913761536963;\
                           -0.021083861589431763,0.9381206035614014,0.056190311908721924";

fn stored(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("stored").join(name)
}

#[test]
fn graphs_of_earlier_revisions_draw_what_they_drew_then() {
    let desk = TestFolder::new();
    for (name, light) in [
        ("3.0/ewa-phong", &[][..]),
        ("3.0/environment", &["--env", "studio"]),
        ("3.0/procedural", &["--env", "sky"]),
        ("3.3/flat", &[]),
        ("3.3/environment", &["--env", "studio"]),
        ("3.3/procedural", &["--env", "sky"]),
        ("3.4/phong-splatting", &[]),
        ("3.4/mapped", &[]),
        ("3.5/global-illumination", &["--light", "point:0.8,2.6,1.6:5,5,5"]),
    ] {
        let graph = stored(&format!("{name}.graph")).display().to_string();
        let line = ["render", SAMPLE, "--size", "64", "-o", "now.png", "--graph", &graph];
        let line = [&line[..], &["--camera", SAMPLE_FROM], light].concat();
        // Past rims, where backs are seen, surfels look another way than then.
        desk.run_with(&[&line[..], &["--one-sided"]].concat()).done();
        let front = read_png(&desk.at("now.png"));
        desk.run_with(&line).done();
        let now = read_png(&desk.at("now.png"));
        let shows_no_back = |at: usize| {
            let pixel = at / 4 * 4..at / 4 * 4 + 4;
            let pairs = now.as_raw()[pixel.clone()].iter().zip(&front.as_raw()[pixel]);
            pairs.into_iter().all(|(now, front)| now.abs_diff(*front) <= 2)
        };
        assert_looks_as_then(&desk, name, shows_no_back);
    }
    let cloud = stored("3.9/splats.ply").display().to_string();
    for name in ["3.9/gaussians", "3.9/gaussians-2d", "3.9/splats"] {
        let graph = stored(&format!("{name}.graph")).display().to_string();
        let line = ["render", &cloud, "--size", "64", "-o", "now.png", "--graph", &graph];
        desk.run_with(&[&line[..], &["--camera", SPLATS_FROM]].concat()).done();
        assert_looks_as_then(&desk, name, |_| true);
    }
}

/// The picture `now.png` is the one that is stored, in the values that count.
fn assert_looks_as_then(desk: &TestFolder, name: &str, counts: impl Fn(usize) -> bool) {
    let (now, then) = (read_png(&desk.at("now.png")), read_png(&stored(&format!("{name}.png"))));
    assert_eq!(now.dimensions(), then.dimensions());
    assert!(then.as_raw().iter().any(|&value| value < 240), "{name}: there is a picture");
    assert!((0..then.as_raw().len()).filter(|&at| counts(at)).count() > 15_000, "{name}");
    let pairs = now.as_raw().iter().zip(then.as_raw()).enumerate();
    let off = pairs.filter(|(at, _)| counts(*at)).map(|(_, (a, b))| a.abs_diff(*b));
    // Drivers round differently, and edges of discs may go to either side: one pixel in a hundred.
    let n_off = off.filter(|&off| off > 2).count();
    let most = then.as_raw().len() / 100;
    assert!(n_off <= most, "{name}: {n_off} values differ by more than 2, at most {most} may");
}

// Libraries are stored as they were built then, for one system.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn a_library_of_splats_draws_what_it_drew_then() {
    let desk = TestFolder::new();
    let zipped = std::fs::File::open(stored("3.9/splats-x86_64-linux.so.gz")).unwrap();
    let mut library = std::fs::File::create(desk.at("splats.so")).unwrap();
    std::io::copy(&mut flate2::read::GzDecoder::new(zipped), &mut library).unwrap();
    drop(library);
    let cloud = stored("3.9/splats.ply").display().to_string();
    let unit = ["-r", "stored-splats", "--plugin", "splats.so", "--trust"];
    let line = ["render", &cloud, "--size", "64", "-o", "now.png", "--camera", SPLATS_FROM];
    desk.run_with(&[&line[..], &unit].concat()).done();
    assert_looks_as_then(&desk, "3.9/splats", |_| true);
    // A cloud without what it needs is refused by the names of the columns.
    let line = ["render", SAMPLE, "--size", "64", "-o", "now.png"];
    desk.run_with(&[&line[..], &unit].concat()).failed(&["splat_scale", "splat_rotation"]);
}

#[test]
fn a_saved_graph_draws_the_same_picture_without_its_plugin() {
    let desk = TestFolder::new();
    let ours = "--size 48 --exposure 0.5 --output debug.nothing";
    let picture = "--size 48 --exposure 0.5";
    desk.run(&format!("render {SAMPLE} -r flat {picture} -o a.png --save-graph a.graph")).done();
    desk.run(&format!("render {SAMPLE} --graph a.graph {picture} -o b.png")).done();
    assert!(std::fs::read(desk.at("a.png")).unwrap() == std::fs::read(desk.at("b.png")).unwrap());
    desk.run(&format!("render {SAMPLE} --graph a.graph {ours} -o c.png"))
        .failed(&["a.graph", "no output `debug.nothing`"]);
}

#[test]
fn what_is_no_graph_or_a_newer_one_is_one_line() {
    let desk = TestFolder::new();
    let draw = |graph: &str| desk.run(&format!("render {SAMPLE} -o a.png --graph {graph}"));
    draw("none.graph").failed(&["none.graph", "cannot be read"]);
    draw(SAMPLE).failed(&["sample.ply", "expected a graph as --save-graph writes it"]);
    let mut bytes = std::fs::read(stored("3.3/flat.graph")).unwrap();
    bytes[18] = 200;
    std::fs::write(desk.at("newer.graph"), &bytes).unwrap();
    draw("newer.graph").failed(&["newer.graph", "ABI 3.200", "update Surfelshop"]);
    bytes[18] = 3;
    // A kind of work that this host does not know.
    let at = bytes.windows(7).position(|window| window == b"Shading").unwrap();
    bytes[at..at + 7].copy_from_slice(b"Meshing");
    std::fs::write(desk.at("feature.graph"), &bytes).unwrap();
    draw("feature.graph").failed(&["feature.graph", "`Meshing`", "update Surfelshop"]);
    desk.run(&format!("render {SAMPLE} -o a.png -r reference --save-graph a.graph"))
        .failed(&["describes no graph to save"]);
    desk.run("render a.ply -o a.png -r flat --graph a.graph").misused(&["--graph", "--renderer"]);
    assert_eq!(desk.files(), ["feature.graph", "newer.graph"]);
}
