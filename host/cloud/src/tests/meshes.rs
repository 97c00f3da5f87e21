use super::*;
use crate::{Cloud, CloudError, Column, Transform, WriteOptions, write};
use glam::{DVec3, Vec3};

/// The sides of the cube of `cube`, counterclockwise seen from outside.
const QUADS: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// The same as triangles.
fn triangles() -> Vec<[u32; 3]> {
    QUADS.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect()
}

/// Appends an element of lists.
fn lists(mut ply: Ply, element: &str, [length, item, name]: [&str; 3], rows: &[&[i64]]) -> Ply {
    ply = ply.line(&format!("element {element} {}", rows.len()));
    ply = ply.line(&format!("property list {length} {item} {name}"));
    for row in rows {
        ply.value(length, row.len() as f64);
        row.iter().for_each(|&corner| ply.value(item, corner as f64));
        ply.end_row();
    }
    ply
}

fn quads() -> Vec<Vec<i64>> {
    QUADS.iter().map(|quad| quad.map(i64::from).to_vec()).collect()
}

fn slices(rows: &[Vec<i64>]) -> Vec<&[i64]> {
    rows.iter().map(Vec::as_slice).collect()
}

#[test]
fn faces_are_read_in_every_encoding_and_type() {
    let quads = quads();
    for encoding in ENCODINGS {
        for kind in ["char", "uchar", "short", "ushort", "int", "uint", "int8", "uint32"] {
            for name in ["vertex_indices", "vertex_index"] {
                let ply = Ply::new(encoding).element("vertex", &XYZ, &cube());
                let loaded = lists(ply, "face", [kind, kind, name], &slices(&quads)).load();
                assert_eq!(loaded.cloud.faces(), triangles(), "{encoding} {kind}");
                assert_eq!(loaded.cloud.view().faces, triangles());
                assert_eq!(loaded.summary.n_triangles, 12);
                assert!(loaded.summary.warnings.is_empty(), "{:?}", loaded.summary.warnings);
            }
        }
    }
}

#[test]
fn faces_are_found_before_points_and_behind_other_elements() {
    let quads = quads();
    let spelled = ["uchar", "int", "vertex_indices"];
    for encoding in ENCODINGS {
        let before = lists(Ply::new(encoding), "face", spelled, &slices(&quads));
        let loaded = before.element("vertex", &XYZ, &cube()).load();
        assert_eq!(loaded.cloud.faces(), triangles());
        let mut ply = Ply::new(encoding)
            .element("vertex", &XYZ, &cube())
            .element("camera", &["float view_px", "double x"], &[vec![1.0, 2.0]])
            .line("element face 6")
            .line("property uchar flags")
            .line("property list uchar float texcoord")
            .line("property list uchar int vertex_indices")
            .line("property double quality");
        for quad in &quads {
            ply.value("uchar", 7.0);
            ply.value("uchar", 2.0);
            ply.value("float", 0.5);
            ply.value("float", 0.25);
            ply.value("uchar", 4.0);
            quad.iter().for_each(|&corner| ply.value("int", corner as f64));
            ply.value("double", 0.5);
            ply.end_row();
        }
        let loaded = lists(ply, "face", spelled, &[&[0, 1, 2]]).load();
        assert_eq!(loaded.cloud.faces().len(), 13);
        assert_eq!(loaded.cloud.faces()[..12], triangles());
    }
}

#[test]
fn strips_become_triangles() {
    for encoding in ENCODINGS {
        for item in ["int", "short", "uint"] {
            let mark = if item == "uint" { i64::from(u32::MAX) } else { -1 };
            let ply = Ply::new(encoding).element("vertex", &XYZ, &cube());
            let strip = [0, 2, 1, 3, mark, 4, 5, 6, 7];
            let spelled = ["int", item, "vertex_indices"];
            let loaded = lists(ply, "tristrips", spelled, &[&strip]).load();
            assert_eq!(loaded.cloud.faces(), [[0, 2, 1], [1, 2, 3], [4, 5, 6], [6, 5, 7]]);
        }
    }
}

#[test]
fn bad_faces_are_left_out_with_one_warning() {
    for encoding in ENCODINGS {
        let ply = Ply::new(encoding).element("vertex", &XYZ, &cube());
        let faces: [&[i64]; 6] = [&[0, 1, 8], &[0, 1], &[], &[0, 2, 3, 1], &[1, 2, 1], &[0, -1, 3]];
        let loaded = lists(ply, "face", ["uchar", "int", "vertex_index"], &faces).load();
        assert_eq!(loaded.cloud.faces(), [[0, 2, 3], [0, 3, 1]]);
        let warnings = loaded.summary.warnings.join("; ");
        assert!(warnings.starts_with("5 of 6 faces were left out"), "{warnings}");
        assert_eq!(loaded.summary.warnings.len(), 1);
    }
}

/// Invariant: damage behind the points of a mesh keeps them and the faces before it
#[test]
fn damage_behind_the_points_keeps_them_and_the_faces_before_it() {
    let quads = quads();
    for encoding in ENCODINGS {
        let points = Ply::new(encoding).element("vertex", &XYZ, &cube());
        let ply = lists(points, "face", ["uchar", "int", "vertex_indices"], &slices(&quads));
        let bytes = ply.bytes();
        let size = if encoding == "ascii" { 11 } else { 17 };
        for cut in 1..6 * size {
            let loaded = load(&bytes[..bytes.len() - cut]);
            assert_eq!(loaded.cloud.len(), 8);
            assert!(loaded.cloud.faces().len() <= 12);
            let n_whole = 2 * (6 - cut.div_ceil(size));
            assert_eq!(loaded.cloud.faces()[..n_whole], triangles()[..n_whole]);
        }
        let mut damaged = bytes.clone();
        for place in bytes.len() - 6 * size..bytes.len() {
            for change in [0x01, 0x10, 0x80, 0xff] {
                damaged[place] ^= change;
                assert!(load(&damaged).cloud.faces().len() <= 2 * bytes.len());
                damaged[place] = bytes[place];
            }
        }
        let loaded = load(&bytes[..bytes.len() - 20]);
        let warnings = loaded.summary.warnings.join("; ");
        assert!(warnings.contains("the faces are incomplete: element `face`"), "{warnings}");
    }
}

#[test]
fn counts_and_lengths_that_are_not_there_cost_no_memory() {
    for encoding in ENCODINGS {
        let ply = Ply::new(encoding)
            .element("vertex", &XYZ, &cube())
            .line("element face 18446744073709551615")
            .line("property list uint int vertex_indices");
        let mut bytes = ply.bytes();
        bytes.extend(if encoding == "ascii" { &b"4294967295 1 2"[..] } else { &[0xff; 4] });
        let loaded = load(&bytes);
        assert_eq!((loaded.cloud.len(), loaded.cloud.faces().len()), (8, 0));
        assert!(!loaded.summary.warnings.is_empty());
    }
}

#[test]
fn triangles_stay_where_all_their_points_do() {
    let mut rows = cube();
    rows[1][2] = f64::NAN;
    let ply = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows);
    let quads = quads();
    let spelled = ["uchar", "int", "vertex_indices"];
    let loaded = lists(ply, "face", spelled, &slices(&quads)).load();
    let left: Vec<[u32; 3]> = triangles()
        .into_iter()
        .filter(|face| !face.contains(&1))
        .map(|face| face.map(|corner| corner - u32::from(corner > 1)))
        .collect();
    assert_eq!(loaded.cloud.faces(), left);
    let kept = loaded.cloud.keep(&[false, true, true, true, true, true, true]).unwrap();
    assert!(kept.faces().len() < left.len());
    for face in kept.faces() {
        let before = face.map(|corner| corner + 1);
        assert!(left.contains(&before));
    }
}

fn mesh() -> Cloud {
    let flat: Vec<f32> = cube().concat().iter().map(|&c| c as f32).collect();
    let cloud = Cloud::new(DVec3::ZERO, vec![Column::new("position", 3, Buffer::F32(flat))]);
    cloud.unwrap().with_faces(triangles()).unwrap()
}

#[test]
fn edits_and_moves_keep_triangles() {
    let cloud = mesh();
    let radius = Column::new("radius", 1, Buffer::F32(vec![1.0; 8]));
    let edited = cloud.with_columns(vec![radius]).unwrap();
    assert_eq!(edited.faces(), cloud.faces());
    assert_eq!(edited.without_column("radius").faces(), cloud.faces());
    let moved = Transform { scale: 2.0, translation: DVec3::X, ..Transform::default() };
    assert_eq!(edited.transformed(&moved).unwrap().faces(), cloud.faces());
    assert_eq!(cloud.keep(&[true; 8]).unwrap().faces(), cloud.faces());
    assert!(cloud.keep(&[false; 8]).unwrap().faces().is_empty());
    let error = mesh().with_faces(vec![[0, 1, 2], [0, 8, 1]]).unwrap_err();
    assert_eq!(error, CloudError::Face { triangle: 1, len: 8 });
    assert_eq!(error.to_string(), "triangle 1: expected corners below 8");
}

#[test]
fn written_meshes_are_read_back() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("mesh.ply");
    for ascii in [false, true] {
        write(&path, &mesh(), &WriteOptions { ascii, ..WriteOptions::default() }).unwrap();
        let first = read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(first.cloud.faces(), triangles());
        write(&path, &first.cloud, &WriteOptions { ascii, ..WriteOptions::default() }).unwrap();
        let second = read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(second.cloud.faces(), triangles());
        assert_eq!(second.summary.normals.given, 8);
        assert_eq!(second.cloud.normals(), first.cloud.normals());
        assert_eq!(second.cloud.radii(), first.cloud.radii());
    }
    let text = String::from_utf8(std::fs::read(&path).unwrap()).unwrap();
    assert!(text.contains("element face 12\nproperty list uchar int vertex_indices\n"), "{text}");
    assert!(text.ends_with("3 1 7 5\n"), "{text}");
}

#[test]
fn normals_and_radii_come_from_triangles_and_loose_points_from_neighbours() {
    let mut rows = cube();
    rows.push(vec![1.1, 1.0, 1.0]);
    let ply = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows);
    let quads = quads();
    let spelled = ["uchar", "int", "vertex_indices"];
    let loaded = lists(ply, "face", spelled, &slices(&quads)).load();
    let (normals, radii) = (&loaded.summary.normals, &loaded.summary.radii);
    assert_eq!((normals.from_triangles, normals.estimated, normals.given), (8, 1, 0));
    assert_eq!((radii.from_triangles, radii.estimated, radii.given), (8, 1, 0));
    for (position, normal) in loaded.cloud.positions().iter().zip(loaded.cloud.normals()).take(8) {
        // Corners on a diagonal have an area more on some sides.
        assert!(position.dot(*normal) > 0.9 * 3f32.sqrt(), "{position} {normal}");
    }
    let text = loaded.summary.to_string();
    assert!(text.contains("12 triangles") && text.contains("8 from triangles"), "{text}");
    let given = with(cube(), |_| vec![0.0, 0.0, 1.0]);
    let properties = also(&XYZ, &["float nx", "float ny", "float nz"]);
    let ply = Ply::new("ascii").element("vertex", &properties, &given);
    let loaded = lists(ply, "face", spelled, &slices(&quads)).load();
    assert_eq!(loaded.summary.normals.given, 8);
    assert_eq!(loaded.cloud.normals(), [Vec3::Z; 8]);
}

#[test]
fn closed_meshes_are_turned_to_face_outwards() {
    let turned: Vec<Vec<i64>> =
        quads().into_iter().map(|q| q.into_iter().rev().collect()).collect();
    let spelled = ["uchar", "int", "vertex_indices"];
    let ply = Ply::new("ascii").element("vertex", &XYZ, &cube());
    let loaded = lists(ply, "face", spelled, &slices(&turned)).load();
    for (position, normal) in loaded.cloud.positions().iter().zip(loaded.cloud.normals()) {
        assert!(position.dot(*normal) > 1.5);
    }
    assert!(loaded.summary.warnings[0].starts_with("the mesh is inside out"));
    let ply = Ply::new("ascii").element("vertex", &XYZ, &cube());
    let open = lists(ply, "face", spelled, &slices(&turned[1..])).load();
    assert!(open.summary.warnings.is_empty());
}
