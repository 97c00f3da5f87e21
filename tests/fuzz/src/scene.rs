//! Scene files.

use crate::assert_one_line;
use std::path::Path;
use surfelshop_cloud::scene::read_bytes;

/// Takes the bytes as a scene; what is said of it is said in lines.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn scene(bytes: &[u8]) {
    match read_bytes(Path::new("fuzz.scene.toml"), bytes) {
        Ok(opened) => {
            opened.warnings.iter().for_each(|line| assert_one_line(line));
            drop((opened.scene.scene(), opened.scene.display()));
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
}
