use super::*;
use glam::Vec3;

const TYPES: [(Element, [&str; 2]); 8] = [
    (Element::I8, ["char", "int8"]),
    (Element::U8, ["uchar", "uint8"]),
    (Element::I16, ["short", "int16"]),
    (Element::U16, ["ushort", "uint16"]),
    (Element::I32, ["int", "int32"]),
    (Element::U32, ["uint", "uint32"]),
    (Element::F32, ["float", "float32"]),
    (Element::F64, ["double", "float64"]),
];

#[test]
fn every_scalar_type_is_kept_in_every_encoding() {
    for encoding in ENCODINGS {
        for (element, names) in TYPES {
            for name in names {
                let edges = edge_values(element);
                let rows = with(cube(), |i| vec![edges[i % 5]]);
                let property = format!("{name} quality");
                let loaded =
                    Ply::new(encoding).element("vertex", &also(&XYZ, &[&property]), &rows).load();
                let column = loaded.cloud.column("quality").unwrap();
                assert_eq!(column.values().element(), element);
                let expected: Vec<f64> = (0..8).map(|i| edges[i % 5]).collect();
                assert_eq!(values(&loaded, "quality"), expected, "{encoding} {name}");
            }
        }
    }
}

#[test]
fn coordinates_are_read_from_every_scalar_type() {
    for encoding in ENCODINGS {
        for (_, [name, _]) in TYPES {
            let rows = vec![vec![0.0, 1.0, 2.0], vec![3.0, 4.0, 5.0], vec![100.0, 7.0, 8.0]];
            let properties = ["x", "y", "z"].map(|axis| format!("{name} {axis}"));
            let properties = properties.each_ref().map(String::as_str);
            let loaded = Ply::new(encoding).element("vertex", &properties, &rows).load();
            assert_eq!(loaded.cloud.positions()[2], Vec3::new(100.0, 7.0, 8.0));
            assert_eq!(loaded.cloud.origin(), glam::DVec3::ZERO);
        }
    }
}

#[test]
fn the_order_of_properties_does_not_matter() {
    let properties = ["float x", "double y", "short z", "uchar radius"];
    for turn in 0..4 {
        let turned: Vec<&str> = (0..4).map(|i| properties[(i + turn) % 4]).collect();
        let rows: Vec<Vec<f64>> = (0..6)
            .map(|i| {
                let row = [f64::from(i), 2.0 * f64::from(i % 2), 5.0, 1.0];
                (0..4).map(|p| row[(p + turn) % 4]).collect()
            })
            .collect();
        for encoding in ENCODINGS {
            let loaded = Ply::new(encoding).element("vertex", &turned, &rows).load();
            assert_eq!(loaded.cloud.positions()[3], Vec3::new(3.0, 2.0, 5.0));
            assert_eq!(loaded.cloud.radii(), [1.0; 6]);
        }
    }
}

/// Vertices with a list of varying length between y and z.
fn with_list(encoding: &'static str, length: &str, item: &str) -> Ply {
    let mut ply = Ply::new(encoding)
        .line("element vertex 5")
        .line("property float x")
        .line("property float y")
        .line(&format!("property list {length} {item} near"))
        .line("property float z");
    for i in 0..5u8 {
        ply.value("float", f64::from(i));
        ply.value("float", 1.0);
        ply.value(length, f64::from(i));
        for j in 0..i {
            ply.value(item, f64::from(j));
        }
        ply.value("float", -f64::from(i));
        ply.end_row();
    }
    ply
}

#[test]
fn lists_inside_vertices_are_passed_over() {
    for encoding in ENCODINGS {
        for length in ["uchar", "int", "ushort"] {
            for item in ["uchar", "short", "int", "float", "double"] {
                let loaded = with_list(encoding, length, item).load();
                assert_eq!(loaded.cloud.positions()[4], Vec3::new(4.0, 1.0, -4.0));
                assert_eq!(loaded.summary.columns, ["position", "normal", "radius"]);
            }
        }
    }
}

#[test]
fn elements_before_the_vertices_are_passed_over() {
    for encoding in ENCODINGS {
        let mut ply = Ply::new(encoding)
            .element("camera", &["float view_px", "double x"], &[vec![1.0, 2.0]])
            .element("nothing", &[], &[vec![], vec![]])
            .line("element face 2")
            .line("property list uchar int vertex_indices")
            .line("property list uchar int vertex_indices")
            .line("property uchar flags");
        for _ in 0..2 {
            for (kind, value) in [
                ("uchar", 2.0),
                ("int", 1.0),
                ("int", 2.0),
                ("uchar", 1.0),
                ("int", 9.0),
                ("uchar", 8.0),
            ] {
                ply.value(kind, value);
            }
            ply.end_row();
        }
        if encoding == "ascii" {
            // Blank lines stand for records without properties, and are passed over anyway.
            ply.body.extend(b"\n\n");
        }
        let loaded = ply.element("vertex", &XYZ, &cube()).load();
        assert_eq!(loaded.cloud.len(), 8);
        assert_eq!(loaded.cloud.positions()[0], -Vec3::ONE);
    }
}

#[test]
fn what_follows_the_vertices_may_be_damaged() {
    for encoding in ENCODINGS {
        let loaded = Ply::new(encoding)
            .element("vertex", &XYZ, &cube())
            .line("element tristrips 4000000000")
            .line("property list int int vertex_indices")
            .load();
        assert_eq!(loaded.cloud.len(), 8);
    }
}

#[test]
fn line_ends_of_every_system_are_read() {
    let text = "ply\nformat ascii 1.0\ncomment made by hand\nobj_info none\n\nelement vertex 3\n\
                property float x\nproperty float y\nproperty float z\nend_header\n\
                0 0 0\n1 0 0\n0 1 0";
    for ends in ["\n", "\r\n", "\r"] {
        for mark in ["", "\u{feff}"] {
            let loaded = load(format!("{mark}{}", text.replace('\n', ends)).as_bytes());
            assert_eq!(loaded.cloud.positions(), [Vec3::ZERO, Vec3::X, Vec3::Y]);
            assert_eq!(loaded.summary.comments, ["made by hand"]);
        }
    }
}

#[test]
fn a_binary_body_follows_any_line_end_byte_by_byte() {
    // The first coordinate begins with the bytes of a line feed and a carriage return.
    let first = f32::from_le_bytes([b'\n', b'\r', 0x20, 0x41]);
    let mut rows = cube();
    rows[0][0] = f64::from(first);
    let plain = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows);
    for crlf in [false, true] {
        let mut header = plain.header.clone() + "end_header\n";
        if crlf {
            header = header.replace('\n', "\r\n");
        }
        let loaded = load(&[header.as_bytes(), &plain.body].concat());
        assert_eq!(loaded.cloud.positions()[0].x, first);
    }
}

#[test]
fn comments_in_any_encoding_and_of_any_length_are_read() {
    let plain = Ply::new("binary_big_endian").element("vertex", &XYZ, &cube());
    let header = plain.header.replacen("element", "comment \0\n", 1);
    let long = vec![b'x'; 1 << 20];
    let (start, rest) = header.split_once('\0').unwrap();
    let bytes = [
        start.as_bytes(),
        b"M\xfcller ",
        &long,
        rest.replacen("\n", "\nelement", 1).as_bytes(),
        b"end_header\n",
        &plain.body,
    ]
    .concat();
    let loaded = load(&bytes);
    assert!(loaded.summary.comments[0].starts_with("M\u{fffd}ller x"));
}

#[test]
fn names_are_read_in_any_case_and_under_their_aliases() {
    let properties = [
        "float X",
        "float Y",
        "float Z",
        "float Normal_X",
        "float normal_y",
        "float normal_z",
        "uchar diffuse_red",
        "uchar diffuse_green",
        "uchar diffuse_blue",
    ];
    let rows = with(cube(), |_| vec![0.0, 1.0, 0.0, 10.0, 20.0, 30.0]);
    let loaded = Ply::new("ascii").element("Point", &properties, &rows).load();
    assert_eq!(loaded.summary.columns, ["position", "normal", "radius", "color"]);
    assert_eq!(loaded.cloud.normals(), [Vec3::Y; 8]);
    assert_eq!(values(&loaded, "color")[..3], [10.0, 20.0, 30.0]);
}

#[test]
fn numbers_that_c_programs_print_are_read() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
                property float z\nproperty double q\nproperty uchar n\nend_header\n\
                +.5 1. -0 1e3 7\n  1E0\t0 0 nan 7.0\n0 1 0 -inf 1e2\n0 0 1 1.#INF 0\n\
                NaN 0 0 0 0\n-1.#IND 0 0 0 0 99\n";
    let loaded = load(text.as_bytes());
    assert_eq!(loaded.summary.n_dropped, 2);
    assert_eq!(loaded.cloud.positions()[0], Vec3::new(0.5, 1.0, 0.0));
    let q = values(&loaded, "q");
    assert!(q[0] == 1000.0 && q[1].is_nan() && q[2] == f64::NEG_INFINITY && q[3] == f64::INFINITY);
    assert_eq!(values(&loaded, "n"), [7.0, 7.0, 100.0, 0.0]);
    assert_eq!(loaded.summary.warnings.len(), 1);
}

#[test]
fn columns_side_by_side_are_read_like_columns_apart() {
    let names = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha"];
    let rows: Vec<Vec<f64>> = (0..9000)
        .map(|i| {
            let at = f64::from(i);
            // One row in a hundred is dropped.
            let x = if i % 100 == 7 { f64::NAN } else { (at * 0.7).sin() };
            let shade = f64::from(i % 251);
            vec![x, at * 0.01, (at * 0.3).cos(), 0.6, 0.0, 0.8, shade, 1.0, 250.0 - shade, 255.0]
        })
        .collect();
    for (float, color) in [("float", "uchar"), ("double", "ushort"), ("float", "int")] {
        let kind = |i: usize| if i < 6 { float } else { color };
        let load = |encoding, order: &[usize]| {
            let properties: Vec<String> =
                order.iter().map(|&i| format!("{} {}", kind(i), names[i])).collect();
            let properties: Vec<&str> = properties.iter().map(String::as_str).collect();
            let pick = |row: &Vec<f64>| order.iter().map(|&i| row[i]).collect();
            let rows: Vec<Vec<f64>> = rows.iter().map(pick).collect();
            let bytes = Ply::new(encoding).element("vertex", &properties, &rows).bytes();
            let (_folder, path) = file(&bytes);
            read(path, &ReadOptions { radius: Some(0.25), ..Default::default() }).unwrap()
        };
        let apart = load("binary_big_endian", &[9, 0, 3, 6, 1, 4, 7, 2, 5, 8]);
        assert_eq!(apart.summary.n_dropped, 90);
        assert_eq!(apart.summary.radii.given, 8910);
        assert_eq!(apart.cloud.radii()[0], 0.25);
        for encoding in ENCODINGS {
            for order in [&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], &[9, 6, 7, 8, 3, 4, 5, 0, 1, 2]] {
                let beside = load(encoding, order);
                assert_eq!(beside.summary.columns, apart.summary.columns);
                for column in apart.cloud.columns() {
                    let found = beside.cloud.column(column.name()).unwrap();
                    assert_eq!(found.components(), column.components());
                    assert_eq!(found.values(), column.values(), "{encoding} {}", column.name());
                }
            }
        }
    }
}
