//! Files of second clouds.

use super::shapes::{TemporaryFile, ply_text};
use super::*;
use crate::ply::PlyFile;

fn refused(text: &str) -> String {
    PlyFile::parse(text.as_bytes().to_vec()).unwrap_err().to_string()
}

/// Two vertices in binary.
fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\ncomment é\nelement camera 1\nproperty short id\n\
         element vertex 2\nproperty double x\nproperty float y\nproperty uchar z\nproperty short w\n\
         end_header\n"
    )
    .into_bytes();
    bytes.extend([9, 9]);
    for (x, y, z, w) in [(1e6 + 0.25, 2.5f32, 3u8, -4i16), (-5.0, 0.5, 255, 300)] {
        macro_rules! put {
            ($($value:expr),*) => {
                $(bytes.extend(if big { $value.to_be_bytes() } else { $value.to_le_bytes() });)*
            };
        }
        let x: f64 = x;
        put!(x);
        put!(y, z, w);
    }
    bytes
}

#[test]
fn every_encoding_gives_the_same_numbers() {
    for big in [false, true] {
        let file = PlyFile::parse(binary(big)).unwrap();
        assert_eq!(file.len, 2);
        assert_eq!(file.values("x"), Some(vec![1_000_000.25, -5.0]));
        assert_eq!(file.values("y"), Some(vec![2.5, 0.5]));
        assert_eq!(file.values("z"), Some(vec![3.0, 255.0]));
        assert_eq!(file.values("w"), Some(vec![-4.0, 300.0]));
        assert_eq!(file.values("nx"), None);
    }
    let text = "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty int id\r\nelement vertex 2\r\n\
                property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n7\r\n1 2 3\r\n4 5 6\r\n";
    let file = PlyFile::parse(text.as_bytes().to_vec()).unwrap();
    assert_eq!(file.values("y"), Some(vec![2.0, 5.0]));
}

#[test]
fn normals_and_radii_that_lack_are_estimated() {
    let bare = TestCloud { normals: vec![0.0; 3000], ..ball(1000) };
    let text = ply_text(&bare, false).replace("property double nx", "property double n");
    let file = TemporaryFile::new("bare.ply", text.replace("double radius", "double r").as_bytes());
    let host = RecordingHost::default();
    let read = PlyFile::read(&file.0).unwrap();
    let surfels = read.surfels(DVec3::ZERO, &Job::new(&host), 0.0..1.0).unwrap();
    for (place, normal) in surfels.places.iter().zip(&surfels.normals) {
        assert!(place.dot(*normal) > 0.99);
    }
    assert!(surfels.radii.iter().all(|radius| *radius > 0.05 && *radius < 0.15));
}

#[test]
fn files_that_make_no_sense_are_refused() {
    let header = |rest: &str| format!("ply\nformat ascii 1.0\n{rest}end_header\n");
    let vertices = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    for (text, expected) in [
        ("solid".to_owned(), "found another one; `surfelshop convert`"),
        ("ply\nformat ascii 1.0\n".to_owned(), "a header that ends"),
        ("ply\nformat odd 1.0\n".to_owned(), "a known format"),
        ("ply\nelement vertex 1\nend_header\n".to_owned(), "a line `format`"),
        (header("element face 2\n"), "an element `vertex`"),
        (header("element vertex -2\n"), "the count of an element"),
        (header("property float x\n"), "an element before its properties"),
        (header("element vertex 1\nproperty half x\n"), "a known type"),
        (header("element vertex 1\nproperty list uchar int x\n"), "without lists"),
        (header(vertices) + "1 2 3\n4 5\n", "expected 3 numbers of vertex 1, found 2"),
        (header(vertices) + "1 2 3\n4 5 x\n", "a number of vertex 1, found `x`"),
        (header(vertices) + "1 2 3\n", "expected 2 vertices, found 1"),
    ] {
        assert!(refused(&text).contains(expected), "{}", refused(&text));
    }
    for most in 0..binary(false).len() {
        let cut = PlyFile::parse(binary(false)[..most].to_vec());
        assert!(cut.is_err(), "{most}");
    }
    let many = "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n\
                property double x\nend_header\n";
    assert!(refused(many).contains("expected 18446744073709551615 vertices, found 0"));
    let gone = PlyFile::read(std::path::Path::new("no/such.ply")).unwrap_err().to_string();
    assert!(gone.starts_with("no/such.ply: "), "{gone}");
}
