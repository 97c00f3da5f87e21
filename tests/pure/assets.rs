//! The committed sample and Cornell box are what their generator makes, load without repairs, and are
//! small enough to be cloned by everyone.

use std::path::{Path, PathBuf};

use surfelshop_assets::cornell;
use surfelshop_assets::coverage::{Disc, measure};

/// The sample travels with every clone; this is what its surfels may weigh.
const MOST_BYTES: usize = 4_000_000;
/// The same of the box.
const MOST_BYTES_OF_BOX: usize = 3_500_000;
const BOX_SCENE: &str = "cornell-box.scene.toml";

fn sample_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/sample.ply")
}

fn bytes_of(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn asset(name: &str) -> PathBuf {
    sample_path().with_file_name(name)
}

/// Whether a committed file is what its generator writes.
fn assert_committed(name: &str, write: impl FnOnce(&Path) -> anyhow::Result<()>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let made = folder.path().join(name);
    write(&made).expect("the file is written");
    let (committed, made) = (bytes_of(&asset(name)), bytes_of(&made));
    let differs = committed.iter().zip(&made).position(|(old, new)| old != new);
    assert!(
        committed == made,
        "assets/{name} holds {} bytes, its generator makes {}, first different byte: {differs:?}; \
         run `cargo run --release -p surfelshop-assets` and commit the file if the change is wanted",
        committed.len(),
        made.len(),
    );
}

/// Invariant: the sample and the Cornell box are what their program makes
#[test]
fn committed_sample_equals_a_regenerated_one() {
    assert_committed("sample.ply", surfelshop_assets::write_sample);
}

#[test]
fn committed_box_equals_a_regenerated_one() {
    assert_committed(cornell::CLOUD_FILE, cornell::write_cornell_box);
    assert_committed(BOX_SCENE, cornell::write_cornell_scene);
}

#[test]
fn box_opens_without_repairs() {
    let opened = surfelshop_cloud::scene::read(asset(BOX_SCENE)).expect("the scene opens");
    assert_eq!(opened.warnings, Vec::<String>::new());
    let path = opened.scene.path_of(&opened.scene.clouds[0]);
    let bytes = bytes_of(&path).len();
    assert!(bytes < MOST_BYTES_OF_BOX, "{} holds {bytes} bytes", path.display());
    let loaded = surfelshop_cloud::read(path, &surfelshop_cloud::ReadOptions::default());
    let summary = loaded.expect("the box loads").summary;
    let n_surfels = summary.n_surfels;
    assert!(n_surfels.abs_diff(cornell::N_POINTS as u64) < 1_000, "{n_surfels} surfels");
    assert_eq!(summary.n_dropped, 0);
    let given = [summary.normals.given, summary.radii.given, summary.colors.given];
    assert_eq!(given, [n_surfels; 3], "normals, radii and colours come from the file");
}

#[test]
fn sample_is_small_enough_to_ship() {
    let bytes = bytes_of(&sample_path()).len();
    assert!(bytes < MOST_BYTES, "assets/sample.ply holds {bytes} bytes of {MOST_BYTES}");
}

#[test]
fn sample_loads_without_repairs() {
    let loaded = surfelshop_cloud::read(sample_path(), &surfelshop_cloud::ReadOptions::default());
    let summary = loaded.expect("the sample loads").summary;
    let n_surfels = summary.n_surfels;
    // The sample shows what a renderer can do, and a software driver must still turn it.
    assert!((60_000..=120_000).contains(&n_surfels), "{n_surfels} surfels");
    assert_eq!(summary.n_dropped, 0);
    let given = [summary.normals.given, summary.radii.given, summary.colors.given];
    assert_eq!(given, [n_surfels; 3], "normals, radii and colours come from the file");
}

#[test]
fn rays_do_not_pass_the_sample() {
    let loaded = surfelshop_cloud::read(sample_path(), &surfelshop_cloud::ReadOptions::default());
    let cloud = loaded.expect("the sample loads").cloud;
    let discs: Vec<_> = (0..cloud.len())
        .map(|surfel| Disc {
            center: cloud.positions()[surfel].as_dvec3(),
            normal: cloud.normals()[surfel].as_dvec3(),
            radius: f64::from(cloud.radii()[surfel]),
        })
        .collect();
    let coverage = measure(&surfelshop_assets::figure::snail_on_mushroom(), &discs, 60_000, 1);
    let (met, missed) = (coverage.n_met, coverage.missed.len());
    assert!(met > 15_000, "only {met} rays met the figure");
    // Of 623 457 rays that met the figure 53 missed, 9 in 100 000; before gaps were closed 98 did.
    // The bound of 25 leaves room for the deviation of so small a number.
    assert!(missed * 4_000 <= met, "{missed} of {met} rays passed: {:?}", coverage.missed);
}

#[test]
fn committed_probe_is_the_built_in_sky() {
    use surfelshop_cloud::environment_map::{self, Mapping, Probe};
    let path = sample_path().with_file_name("sky.hdr");
    assert!(bytes_of(&path).len() < 1_000_000, "it travels with every clone");
    let read = environment_map::read(&path, None).expect("the sample probe loads");
    let made = Probe::sky();
    assert_eq!(read.mapping, Mapping::LatLong);
    assert!(read.facts.sun.is_some());
    for (found, expected) in read.picture.rgb.iter().zip(&made.picture.rgb) {
        let brightest = expected.iter().fold(0.0f32, |most, value| most.max(*value));
        for (found, expected) in found.iter().zip(expected) {
            // The format's eight bits count from the brightest channel and are cut off.
            assert!((found - expected).abs() <= brightest / 100.0, "{found} for {expected}");
        }
    }
}
