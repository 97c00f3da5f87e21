//! Scene files.

use std::path::Path;
use surfelshop_cloud::scene::read_bytes;

/// Takes the bytes as a scene; what is said of it is said in lines.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn scene(bytes: &[u8]) {
    match read_bytes(Path::new("fuzz.scene.toml"), bytes) {
        Ok(opened) => {
            let lines = opened.warnings.iter();
            assert!(lines.clone().all(|line| !line.contains('\n')), "{:?}", opened.warnings);
            drop(opened.scene.scene());
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{line:?}");
        }
    }
}
