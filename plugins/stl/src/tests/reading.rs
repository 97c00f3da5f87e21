use super::*;
use surfelshop_api::columns::Element;

/// The triangles with the coordinates of their corners.
fn triangles(found: &Collected) -> Vec<[[f64; 3]; 3]> {
    let cloud = &found.clouds[0];
    let (points, _) = cloud.columns[0].as_chunks::<3>();
    cloud.faces.iter().map(|face| face.map(|corner| points[corner as usize])).collect()
}

#[test]
fn a_cube_has_eight_corners() {
    let expected: Vec<_> = cube().iter().map(|t| t.map(|corner| corner.map(f64::from))).collect();
    let files = [
        (binary("a cube", &cube()), Element::F32, "STL, binary", ""),
        (binary("solid, it says", &cube()), Element::F32, "STL, binary", ""),
        (text("a cube", &cube()).into_bytes(), Element::F64, "STL, ascii", "a cube"),
    ];
    for (bytes, element, format, name) in files {
        let found = read(&bytes).unwrap();
        let header = &found.clouds[0].header;
        assert_eq!((found.clouds[0].columns[0].len(), found.clouds[0].faces.len()), (24, 12));
        assert_eq!(triangles(&found), expected);
        assert_eq!((header.columns[0].element, header.format.as_str()), (element, format));
        assert_eq!((header.name.as_str(), header.has_faces, header.rows), (name, true, None));
        assert!(found.warnings.is_empty());
    }
    let title = &read(&binary("solid, it says", &cube())).unwrap().clouds[0].header.comments;
    assert_eq!(title, &["solid, it says"]);
}

#[test]
fn corners_are_welded_by_their_bits() {
    let near = 1.0f32.next_up();
    let odd = [[[0.0, -0.0, 1.0], [0.0, 0.0, near], [-0.0, 0.0, 1.0]], [[f32::NAN; 3]; 3]];
    let found = read(&binary("", &odd)).unwrap();
    assert_eq!(found.clouds[0].faces, [[0, 1, 0], [2, 2, 2]]);
    assert_eq!(found.clouds[0].columns[0].len(), 9);
}

#[test]
fn meshes_of_several_batches_are_whole() {
    // Strips of 100,000 triangles, whose neighbours share two corners; more text than a block.
    let corner = |i: u32| [(i / 2) as f32, (i % 2) as f32, 0.5];
    let strip: Vec<_> = (0..100_000).map(|i| [i, i + 1, i + 2].map(corner)).collect();
    let text = text("strip", &strip).into_bytes();
    assert!(text.len() > 8 << 20);
    for bytes in [binary("", &strip), text] {
        let found = read(&bytes).unwrap();
        assert_eq!(found.clouds[0].columns[0].len(), 3 * 100_002);
        for (i, face) in (0u32..).zip(&found.clouds[0].faces) {
            assert_eq!(*face, [i, i + 1, i + 2]);
        }
        assert_eq!(found.clouds[0].faces.len(), 100_000);
    }
}

#[test]
fn texts_of_many_programs_are_understood() {
    let cube = text("cube", &cube());
    let crlf = format!("\n {}", cube.replace('\n', "\r\n").to_uppercase().replace("E0", "e+00"));
    let twice = format!("\u{feff}{cube}{}", cube.replace("cube", "more"));
    let colored = cube.replace("  endfacet", "  endfacet\n  color 1 0 0");
    for (text, n, n_warnings) in [(crlf, 12, 0), (twice, 24, 0), (colored, 12, 1)] {
        let found = read(text.as_bytes()).unwrap();
        assert_eq!((found.clouds[0].columns[0].len(), found.clouds[0].faces.len()), (24, n));
        assert_eq!(found.warnings.len(), n_warnings, "{:?}", found.warnings);
    }
    let empty = read(b"solid\nendsolid\n").unwrap();
    assert!(empty.clouds[0].faces.is_empty() && empty.warnings.is_empty());
}

#[test]
fn texts_that_are_wrong_are_refused() {
    let cube = text("cube", &cube());
    for (text, expected) in [
        (cube.replacen("    endloop\n", "", 1), "facet 1: expected a line `endloop`"),
        (
            cube.replacen("outer loop\n", "outer loop\nvertex 0 0 0\n", 2).replacen(
                "outer loop\nvertex 0 0 0\n",
                "outer loop\n",
                1,
            ),
            "facet 2: expected a line `endloop`",
        ),
        (
            cube.replacen("vertex 0 0e0 1\n", "endloop\n", 1),
            "facet 1: expected three corners, found 1",
        ),
        (cube.replacen("vertex 0 0e0 1\n", "vertex 0 zero 1\n", 1), "found `0 zero 1`"),
        (cube.replacen("vertex 0 0e0 1\n", "vertex 0 0 1 0\n", 1), "expected three numbers"),
        (cube[..cube.len() - 70].to_owned(), "cut short"),
        (
            "solid angle is a quantity\nof radiometry\n".to_owned(),
            "expected facets, found `of radiometry`",
        ),
    ] {
        let line = refusal(text.as_bytes());
        assert!(line.contains(expected), "{line}");
    }
}

#[test]
fn lengths_decide_what_a_file_is() {
    let cube = binary("title", &cube());
    let longer = [&cube[..], b"abc"].concat();
    let found = read(&longer).unwrap();
    assert!(found.warnings[0].contains("3 bytes"), "{:?}", found.warnings);
    assert_eq!(found.clouds[0].faces.len(), 12);
    assert!(refusal(&cube[..cube.len() - 1]).contains("684 bytes of 12 triangles, found 683"));
    assert!(refusal(b"some text").contains("begins with `solid`"));
    // Announced triangles take no memory.
    let mut lying = cube;
    lying[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(refusal(&lying).contains("cut short"));
}
