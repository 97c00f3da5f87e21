//! Constants that shaders and their twins on the CPU share are the same numbers. Costs nothing.

use crate::repository::root;

/// The number of a constant in a source.
fn constant(file: &str, name: &str) -> f64 {
    let text = std::fs::read_to_string(root().join(file)).unwrap();
    let declared = format!("const {name}");
    let line = text
        .lines()
        .find(|line| line.trim_start().trim_start_matches("pub(crate) ").starts_with(&declared));
    let value = line.unwrap_or_else(|| panic!("{file} has no {name}")).split('=').nth(1).unwrap();
    value.trim().trim_end_matches(';').parse().unwrap()
}

/// Invariant: constants that shaders and their twins share are the same numbers
#[test]
fn constants_of_shaders_and_twins_are_the_same_numbers() {
    let shader = "host/render/src/surfels/quads/disc.wgsl";
    for (name, file) in [
        ("MAX_SLOPE", "host/raster/src/disc.rs"),
        ("MAX_PULL", "host/raster/src/disc.rs"),
        ("MAX_SLOPE", "tests/support/twin.rs"),
    ] {
        let (gpu, cpu) = (constant(shader, name), constant(file, name));
        assert_eq!(gpu.to_bits(), cpu.to_bits(), "{name}: {gpu} in the shader, {cpu} in {file}");
    }
}
