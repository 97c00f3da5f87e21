//! Clouds and light probes, which are read from files.

use crate::assert_one_line;
use std::path::Path;
use surfelshop_cloud::{ReadOptions, WriteOptions, environment_map, read, write};

/// Has `read` read a file of these bytes.
pub(crate) fn with_file(bytes: &[u8], ending: &str, read: impl FnOnce(&Path)) {
    let name = format!("fuzz.{ending}");
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("no folder: {error}"));
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap_or_else(|error| panic!("no file: {error}"));
    read(&path);
}

/// Takes the bytes as a cloud in any format. What is read can be written and read again.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn cloud(bytes: &[u8]) {
    with_file(bytes, "obj", |path| match read(path, &ReadOptions::default()) {
        Ok(loaded) => {
            let copy = path.with_extension("ply");
            match write(&copy, &loaded.cloud, &WriteOptions::default()) {
                Ok(_) => {
                    let again = read(&copy, &ReadOptions::default());
                    let again = again.unwrap_or_else(|error| panic!("what was written: {error}"));
                    assert_eq!(again.cloud.len(), loaded.cloud.len());
                }
                Err(error) => assert_one_line(&error.to_string()),
            }
        }
        Err(error) => assert_one_line(&error.to_string()),
    });
}

/// Takes the bytes as a light probe.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn probe(bytes: &[u8]) {
    with_file(bytes, "hdr", |path| match environment_map::read(path, None) {
        Ok(probe) => assert!(probe.texels.iter().flatten().all(|value| value.is_finite())),
        Err(error) => assert_one_line(&error.to_string()),
    });
}
