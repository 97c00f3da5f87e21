//! OBJ and OFF files.

use super::*;
use glam::Vec3;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn square(more: &str) -> Loaded {
    load(format!("{SQUARE}{more}").as_bytes())
}

#[test]
fn faces_are_read_in_every_spelling() {
    let normals = "vn 0 0 1\nvn 0 0 1\nvt 0 0\n";
    let expected = [[0, 1, 2], [0, 2, 3]];
    for faces in [
        "f 1 2 3 4",
        "f 1/1 2/1 3/1 4/1",
        "f 1//1 2//1 3//2 4//2",
        "f 1/1/1 2/1/1 3/1/2 4/1/2",
        "f -4 -3 -2 -1",
        "f -4//-1 -3//-1 -2//-2 -1//-2",
        "f 1 2 3\nf 1/1 3/1 4/1",
        "f 1 2 \\\n 3 4",
        "  f\t1  2 3 4  # a square\r",
        "g side\nusemtl red\ns 1\nf 1 2 3 4\nl 1 2\np 1",
    ] {
        let loaded = square(&format!("{normals}{faces}\n"));
        assert_eq!(loaded.cloud.faces(), expected, "{faces}");
        assert_eq!(loaded.summary.format, "OBJ");
        assert!(loaded.summary.warnings.is_empty(), "{:?}", loaded.summary.warnings);
        assert!(loaded.cloud.normals().iter().all(|normal| *normal == Vec3::Z));
    }
    // Faces may come before their vertices.
    let loaded = load(format!("# first\n\nf 1 2 3\n{SQUARE}").as_bytes());
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2]]);
}

#[test]
fn bad_faces_of_objects_are_left_out() {
    let loaded = square("f 1 2\nf 1 2 9\nf 0 1 2\nf 1 x 3\nf -5 1 2\nf 1 1 2\nf\nf 1 2 3\n");
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2]]);
    assert!(loaded.summary.warnings[0].starts_with("7 of 8 faces were left out"));
}

#[test]
fn normals_of_objects_belong_to_vertices() {
    // Named by faces, in another order than the vertices.
    let loaded = square("vn 1 0 0\nvn 0 1 0\nf 1//2 2//2 3//1\n");
    assert_eq!(loaded.cloud.normals()[..3], [Vec3::Y, Vec3::Y, Vec3::X]);
    assert_eq!((loaded.summary.normals.given, loaded.summary.normals.repaired), (3, 1));
    // One per vertex.
    let loaded = square("vn 1 0 0\nvn 0 1 0\nvn 0 0 1\nvn 0 -1 0\n");
    assert_eq!(loaded.cloud.normals(), [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Y]);
    // A vertex on an edge has several; others keep theirs bit by bit.
    let slanted = Vec3::new(0.6, 0.8, 0.0);
    let loaded = square("vn 0.6 0.8 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1//2 3//1 4//1\n");
    let mean = (slanted + Vec3::Z).normalize_or_zero();
    assert!(loaded.cloud.normals()[0].distance(mean) < 1e-6);
    assert_eq!(loaded.cloud.normals()[1..], [slanted; 3]);
    // Neither: they come from triangles.
    let loaded = square("vn 1 0 0\nf 1 2 3 4\n");
    assert_eq!(loaded.summary.normals.from_triangles, 4);
}

#[test]
fn vertices_of_objects_may_have_weights_and_colours() {
    let text = "v 0 0 0 1 0 0.501960784\nv 1 0 0 1.0 1 0 0.501960784\nv 1 1 0 1\nv 0 1 0\n";
    let loaded = load(text.as_bytes());
    assert_eq!(values(&loaded, "color")[..6], [255.0, 0.0, 128.0, 255.0, 0.0, 128.0]);
    assert_eq!(values(&loaded, "color")[6..], [188.0; 6]);
    assert_eq!(loaded.cloud.positions()[2], Vec3::new(1.0, 1.0, 0.0));
    assert!(loaded.summary.warnings[0].starts_with("2 vertices have no colour"));
    let whole = load(b"v 0 0 0 255 0 128\nv 1 0 0 1 2 3\n");
    assert_eq!(values(&whole, "color"), [255.0, 0.0, 128.0, 1.0, 2.0, 3.0]);
}

#[test]
fn vertices_of_objects_that_cannot_be_read_are_named() {
    for (line, found) in [("v 1 2", "``"), ("v 1 2 x", "`x`"), ("vn 1 2", "``")] {
        let refused = refusal(format!("{SQUARE}{line}\n").as_bytes());
        let expected = format!("line 5: expected 3 numbers, found {found}");
        assert!(refused.starts_with(&expected), "{refused}");
    }
    let loaded = load(b"v nan 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 2 3 4\n");
    assert_eq!((loaded.cloud.len(), loaded.summary.n_dropped), (3, 1));
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2]]);
}

#[test]
fn objects_far_away_keep_their_millimetres() {
    let loaded = load(b"v 512345.251 5403210.499 430.998\nv 512345.252 5403210.5 430.999\n");
    let apart = loaded.cloud.world_position(1).unwrap() - loaded.cloud.world_position(0).unwrap();
    assert!(apart.distance(glam::DVec3::splat(0.001)) < 1e-8, "{apart}");
}

#[test]
fn formats_are_told_by_content() {
    for (text, format) in [
        ("# exported\n\n#\nmtllib a.mtl\no thing\nv 0 0 0\n", "OBJ"),
        ("OFF\n1 0 0\n0 0 0\n", "OFF"),
        ("# a comment\nOFF 1 0 0 # counts\n\n0 0 0\n", "OFF"),
    ] {
        assert_eq!(load(text.as_bytes()).summary.format, format);
    }
    for text in ["very much text", "v\n", "OFFSET 1\n", "# only a comment\n"] {
        let refused = refusal(text.as_bytes());
        assert!(refused.starts_with("expected a PLY, OBJ or OFF file, found"), "{refused}");
    }
}

#[test]
fn off_files_have_faces_normals_and_colours() {
    let text = "OFF\n# a square\n4 2 5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3 255 0 0\n";
    let loaded = load(text.as_bytes());
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(loaded.cloud.normals(), [Vec3::Z; 4]);
    let text = "CNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0.5 1\n1 0 0 0 0 1 0 0 0 1\n1 1 0 0 1 0 0 0 1 1\n\
                3 0 1 2\n";
    let loaded = load(text.as_bytes());
    assert_eq!(loaded.cloud.normals(), [Vec3::Z, Vec3::Z, Vec3::Y]);
    assert_eq!(values(&loaded, "color")[..3], [255.0, 0.0, 128.0]);
    assert_eq!(loaded.summary.normals.given, 3);
}

#[test]
fn damaged_off_files_are_refused_or_warned_of() {
    for (text, expected) in [
        ("OFF\n4 x 0\n", "header line 2: expected the numbers of vertices and faces"),
        ("4OFF\n1 0 0\n0 0 0 0\n", "header line 1: expected OFF, COFF, NOFF or CNOFF as text"),
        ("OFF BINARY\n", "header line 1: expected OFF, COFF, NOFF or CNOFF as text"),
        ("OFF\n999999999999 0 0\n0 0 0\n", "element `vertices`: expected 999999999999 lines"),
        ("OFF\n2 0 0\n0 0 0.0000\n", "element `vertices`: expected 2 lines"),
        ("OFF\n1 0 0\n0 zero 0\n", "line 3: expected 3 numbers, found `zero`"),
    ] {
        let refused = refusal(text.as_bytes());
        assert!(refused.starts_with(expected), "{refused}");
    }
    let points = "OFF\n3 99999999999 0\n0 0 0\n1 0 0\n0 1 0\n";
    let loaded = load(format!("{points}3 0 1 2\n3 0 1\n9 0 1 2\n3 0 1 3\n").as_bytes());
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2]]);
    assert!(loaded.summary.warnings[0].starts_with("the faces are incomplete"));
    assert!(loaded.summary.warnings[1].starts_with("3 of 4 faces were left out"));
}

#[test]
fn every_shorter_or_changed_text_loads_or_is_refused_in_one_line() {
    let object = format!("# one\n{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1\nf -1 -2 -3\n");
    let off = "COFF\n3 1 0\n0 0 0 1 0 0\n1 0 0 1 1 1\n0 1 0 0 0 0\n3 0 1 2\n";
    for text in [object.as_bytes(), off.as_bytes()] {
        let check = |bytes: &[u8]| match try_load(bytes) {
            Ok(loaded) => assert!(loaded.cloud.len() <= 5),
            Err(error) => assert!(!error.to_string().contains('\n')),
        };
        for place in 0..text.len() {
            check(&text[..place]);
            for change in [0x01, 0x10, 0x80, 0xff] {
                let mut damaged = text.to_vec();
                damaged[place] ^= change;
                check(&damaged);
            }
        }
    }
}
