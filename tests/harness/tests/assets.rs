//! The committed sample is what its generator makes, and is small enough to be cloned by everyone.

use std::path::Path;

/// The sample travels with every clone; this is what its surfels may weigh.
const MOST_BYTES: usize = 4_000_000;

fn committed_sample() -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sample.ply");
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn committed_sample_equals_a_regenerated_one() {
    let committed = committed_sample();
    let made = surfelshop_assets::sample_cloud();
    let differs = committed.iter().zip(&made).position(|(old, new)| old != new);
    assert!(
        committed == made,
        "assets/sample.ply holds {} bytes, its generator makes {}, first different byte: \
         {differs:?}; run `cargo run --release -p surfelshop-assets` and commit the file if the \
         change is wanted",
        committed.len(),
        made.len(),
    );
}

#[test]
fn sample_is_small_enough_to_ship() {
    let bytes = committed_sample().len();
    assert!(bytes < MOST_BYTES, "assets/sample.ply holds {bytes} bytes of {MOST_BYTES}");
}
