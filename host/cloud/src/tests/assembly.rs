use super::*;
use glam::{DVec3, Vec3};

/// Points of a sphere of radius 1 on a spiral, as rows.
fn sphere(count: u32) -> Vec<Vec<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let r = (1.0 - z * z).sqrt();
            let angle = golden * f64::from(i);
            vec![r * angle.cos(), r * angle.sin(), z]
        })
        .collect()
}

const NORMALS: [&str; 3] = ["float nx", "float ny", "float nz"];

#[test]
fn points_without_finite_coordinates_are_dropped_and_counted() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3e38] {
        for axis in 0..3 {
            let mut rows = with(cube(), |i| vec![i as f64]);
            rows[2][axis] = bad;
            rows[5][axis] = bad;
            let loaded = Ply::new("binary_big_endian")
                .element("vertex", &also(&XYZ, &["int id"]), &rows)
                .load();
            assert_eq!(loaded.summary.n_dropped, 2);
            assert_eq!(values(&loaded, "id"), [0.0, 1.0, 3.0, 4.0, 6.0, 7.0]);
            assert!(loaded.summary.to_string().contains("dropped 2 of 8"));
        }
    }
}

#[test]
fn missing_normals_are_estimated_and_face_outwards() {
    let loaded = Ply::new("ascii").element("vertex", &XYZ, &sphere(2000)).load();
    assert_eq!(loaded.summary.normals.estimated, 2000);
    for (position, normal) in loaded.cloud.positions().iter().zip(loaded.cloud.normals()) {
        assert!(position.dot(*normal) > 0.99);
    }
}

#[test]
fn unit_normals_keep_their_bits_and_others_are_made_unit_length() {
    let nearly = 1.000_03;
    let mut rows = with(sphere(400), |_| vec![0.0, nearly, 0.0]);
    rows[50][3..].copy_from_slice(&[0.0, 0.0, 5.0]);
    rows[100][3..].copy_from_slice(&[1e-30, 0.0, 0.0]);
    rows[150][3..].copy_from_slice(&[0.0, 3e38, 3e38]);
    rows[200][3..].copy_from_slice(&[0.0, 0.0, 0.0]);
    rows[250][3..].copy_from_slice(&[f64::NAN, 1.0, 0.0]);
    let loaded =
        Ply::new("binary_little_endian").element("vertex", &also(&XYZ, &NORMALS), &rows).load();
    let counts = loaded.summary.normals;
    assert_eq!((counts.given, counts.normalised, counts.repaired), (395, 3, 2));
    let normals = loaded.cloud.normals();
    assert_eq!([normals[50], normals[100]], [Vec3::Z, Vec3::X]);
    assert!((normals[150] - Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt())).length() < 1e-6);
    assert!(normals[200].y > 0.99 && normals[250].y > 0.99);
    assert_eq!(normals[0], Vec3::Y * nearly as f32);
}

#[test]
fn normals_that_are_all_zero_count_as_missing() {
    let rows = with(sphere(300), |_| vec![0.0; 3]);
    let loaded = Ply::new("ascii").element("vertex", &also(&XYZ, &NORMALS), &rows).load();
    assert_eq!(loaded.summary.normals.estimated, 300);
}

#[test]
fn radii_that_cannot_be_drawn_are_estimated_or_clamped() {
    let mut rows = with(sphere(500), |_| vec![0.05]);
    for (row, bad) in rows.iter_mut().zip([0.0, -1.0, f64::NAN, f64::INFINITY, 1e30, 100.0]) {
        row[3] = bad;
    }
    let loaded = Ply::new("binary_big_endian")
        .element("vertex", &also(&XYZ, &["double radius"]), &rows)
        .load();
    let counts = loaded.summary.radii;
    assert_eq!((counts.given, counts.estimated, counts.clamped), (494, 4, 2));
    let radii = loaded.cloud.radii();
    assert!(radii[..4].iter().all(|&r| r > 0.05 && r < 0.3), "{:?}", &radii[..4]);
    // The diagonal of a box about a unit sphere.
    assert!(radii[4] == radii[5] && (radii[4] - 12f32.sqrt()).abs() < 0.05);
}

#[test]
fn colours_keep_their_type_and_are_decoded_once() {
    let names = |kind: &str| ["red", "green", "blue"].map(|name| format!("{kind} {name}"));
    for (kind, element, full) in [
        ("uchar", Element::U8, 255.0),
        ("ushort", Element::U16, 65535.0),
        ("int", Element::U8, 255.0),
        ("uint", Element::U16, 65535.0),
        ("float", Element::F32, 1.0),
        ("double", Element::F32, 1.0),
    ] {
        let names = names(kind);
        let properties = also(&XYZ, &names.each_ref().map(String::as_str));
        let rows = with(cube(), |_| vec![full, 0.0, full]);
        let loaded = Ply::new("ascii").element("vertex", &properties, &rows).load();
        let column = loaded.cloud.column("color").unwrap();
        assert_eq!((column.values().element(), column.components()), (element, 3));
        assert_eq!(loaded.cloud.linear_colors().unwrap(), [[1.0, 0.0, 1.0]; 8]);
        assert_eq!(loaded.summary.colors.given, 8);
    }
}

#[test]
fn opacity_is_the_fourth_component() {
    let properties = also(&XYZ, &["uchar r", "uchar g", "uchar b", "uchar a"]);
    let rows = with(cube(), |i| vec![1.0, 2.0, 3.0, i as f64]);
    let loaded = Ply::new("ascii").element("vertex", &properties, &rows).load();
    assert_eq!(loaded.cloud.column("color").unwrap().components(), 4);
    assert_eq!(values(&loaded, "color")[4..8], [1.0, 2.0, 3.0, 1.0]);
}

#[test]
fn float_colours_that_cannot_be_shaded_become_neutral() {
    let properties = also(&XYZ, &["float red", "float green", "float blue"]);
    let mut rows = with(cube(), |_| vec![0.25; 3]);
    for (row, bad) in rows.iter_mut().zip([f64::NAN, f64::INFINITY, -0.1]) {
        row[4] = bad;
    }
    let loaded = Ply::new("binary_little_endian").element("vertex", &properties, &rows).load();
    assert_eq!((loaded.summary.colors.replaced, loaded.summary.colors.given), (3, 5));
    let colors = loaded.cloud.linear_colors().unwrap();
    assert_eq!(colors[..3], [crate::NEUTRAL_ALBEDO; 3]);
    assert_eq!(colors[3], [0.25; 3]);
}

const TANGENTS: [&str; 6] = [
    "float tangent_u_x",
    "float tangent_u_y",
    "float tangent_u_z",
    "float tangent_v_x",
    "float tangent_v_y",
    "float tangent_v_z",
];

#[test]
fn other_meaningful_columns_are_recognised() {
    let more = ["float ao", "int material"];
    let more = [&more[..], &TANGENTS].concat();
    let mut rows = with(cube(), |_| vec![0.5, 2.0, 0.1, 0.0, 0.0, 0.0, 0.2, 0.0]);
    rows[0][3..6].copy_from_slice(&[f64::NAN, -1.0, 0.0]);
    rows[1][3] = 7.0;
    let loaded = Ply::new("binary_big_endian").element("vertex", &also(&XYZ, &more), &rows).load();
    let ao = values(&loaded, "ao");
    assert_eq!(ao[..3], [1.0, 1.0, 0.5]);
    assert_eq!(values(&loaded, "material")[..2], [0.0, 2.0]);
    assert_eq!(loaded.cloud.vectors("tangent_v")[1], Vec3::Y * 0.2);
    let u = loaded.cloud.vectors("tangent_u")[0];
    assert!((u.length() - loaded.cloud.radii()[0]).abs() < 1e-6);
    assert_eq!(loaded.summary.warnings.len(), 3);
}

#[test]
fn properties_that_only_look_meaningful_keep_another_name() {
    let more = ["float position", "uchar red", "float nx", "short color"];
    let rows = with(cube(), |i| vec![i as f64; 4]);
    let loaded = Ply::new("ascii").element("vertex", &also(&XYZ, &more), &rows).load();
    assert_eq!(values(&loaded, "position_")[3], 3.0);
    assert_eq!(values(&loaded, "color_")[3], 3.0);
    assert_eq!(values(&loaded, "red")[3], 3.0);
    assert_eq!(values(&loaded, "nx")[3], 3.0);
}

#[test]
fn millimetres_survive_at_coordinates_of_a_million_metres() {
    let base = DVec3::new(512_345.251, 5_403_210.499, 430.998);
    let rows: Vec<Vec<f64>> = sphere(200)
        .iter()
        .map(|p| (base + DVec3::from_slice(p) * 0.035).to_array().to_vec())
        .collect();
    let loaded = Ply::new("binary_big_endian")
        .element("vertex", &["double x", "double y", "double z"], &rows)
        .load();
    assert_ne!(loaded.cloud.origin(), DVec3::ZERO);
    for (i, row) in rows.iter().enumerate() {
        let world = loaded.cloud.world_position(i).unwrap();
        // f32 offsets of at most 0.035 are 4e-9 apart; f64 coordinates of 5e6 are 1e-9 apart.
        assert!(world.distance(DVec3::from_slice(row)) < 1e-8);
    }
    assert!(loaded.summary.warnings.is_empty());
}

#[test]
fn a_small_cloud_far_away_gets_an_origin_even_where_f32_would_hold_it() {
    let rows: Vec<Vec<f64>> =
        sphere(100).iter().map(|p| p.iter().map(|c| (c * 8.0).round() + 1e6).collect()).collect();
    let loaded = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows).load();
    assert_eq!(loaded.cloud.origin(), DVec3::splat(1e6));
    assert!(loaded.cloud.positions().iter().all(|p| p.abs().max_element() <= 8.0));
    let near = Ply::new("ascii").element("vertex", &XYZ, &sphere(100)).load();
    assert_eq!(near.cloud.origin(), DVec3::ZERO);
}

/// A device writes what it has not seen as zeros; a register of points has a wrong row.
#[test]
fn strays_take_no_digits_from_a_cloud_on_the_map() {
    let base = DVec3::new(500_000.25, 5_400_000.5, 430.125);
    let points: Vec<DVec3> = sphere(400).iter().map(|p| base + DVec3::from_slice(p)).collect();
    for strays in [vec![DVec3::ZERO; 1], vec![DVec3::ZERO; 50], vec![DVec3::splat(-1e12); 3]] {
        let all = points.iter().chain(&strays);
        let rows: Vec<Vec<f64>> = all.map(|point| point.to_array().to_vec()).collect();
        let vertex = ["double x", "double y", "double z"];
        let loaded = Ply::new("binary_little_endian").element("vertex", &vertex, &rows).load();
        for (i, point) in points.iter().enumerate() {
            let world = loaded.cloud.world_position(i).unwrap();
            // Offsets of up to 2 are rounded by 6e-8 along each axis, coordinates of 5e6 in f64 by 5e-10.
            assert!(world.distance(*point) < 1.2e-7, "{}", world.distance(*point));
        }
        let apart = match strays.len() {
            1 => "1 point lies far apart from the others".to_owned(),
            count => format!("{count} points lie far apart from the others"),
        };
        let [line] = loaded.summary.warnings.as_slice() else { panic!("one warning") };
        assert!(line.starts_with(&apart), "{line}");
    }
    // What is near to the rest counts for the middle.
    let near = [points, vec![base + DVec3::X * 30.0]].concat();
    let rows: Vec<Vec<f64>> = near.iter().map(|point| point.to_array().to_vec()).collect();
    let vertex = ["double x", "double y", "double z"];
    let loaded = Ply::new("binary_little_endian").element("vertex", &vertex, &rows).load();
    assert!((loaded.cloud.origin().x - base.x - 14.5).abs() < 0.6);
}

#[test]
fn a_cloud_that_spans_too_far_for_single_precision_is_warned_of() {
    // Two halves of a cloud, neither of which is a few strays.
    let mut rows = sphere(100);
    rows.extend(sphere(100).iter().map(|point| vec![point[0] + 1e9, point[1], point[2]]));
    let loaded = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows).load();
    assert!(loaded.summary.warnings[0].contains("spans too far"), "{:?}", loaded.summary.warnings);
    // One point far away costs the others nothing.
    let mut rows = sphere(100);
    rows.push(vec![1e9, 0.0, 0.0]);
    let loaded = Ply::new("binary_little_endian").element("vertex", &XYZ, &rows).load();
    let [line] = loaded.summary.warnings.as_slice() else { panic!("one warning") };
    assert!(line.starts_with("1 point lies far apart"), "{line}");
}

/// Invariant: every loaded cloud can be drawn
#[test]
fn every_loaded_cloud_can_be_drawn() {
    let scaled = |scale: f64| -> Vec<Vec<f64>> {
        sphere(100).iter().map(|p| p.iter().map(|c| c * scale).collect()).collect()
    };
    let cases: Vec<Vec<Vec<f64>>> = vec![
        vec![],
        vec![vec![1.0, 2.0, 3.0]],
        vec![vec![1.0, 2.0, 3.0]; 2],
        vec![vec![1.0, 2.0, 3.0]; 10_000],
        vec![vec![f64::NAN; 3]; 5],
        vec![vec![0.0; 3], vec![1.0, 0.0, 0.0]],
        (0..100).map(|i| vec![f64::from(i), 0.0, 0.0]).collect(),
        (0..100).map(|i| vec![f64::from(i % 10), f64::from(i / 10), 0.0]).collect(),
        scaled(1e-30),
        scaled(1e-20),
        scaled(1e28),
        scaled(1e37),
        [scaled(1.0), vec![vec![1e28, 0.0, 0.0]]].concat(),
    ];
    for rows in cases {
        for kind in ["float", "double"] {
            let properties = ["x", "y", "z"].map(|axis| format!("{kind} {axis}"));
            let properties = properties.each_ref().map(String::as_str);
            // The checks are those of `load`, which every test goes through.
            let loaded =
                Ply::new("binary_little_endian").element("vertex", &properties, &rows).load();
            let facts = loaded.cloud.facts();
            assert!(facts.bounds_min.is_finite() && facts.bounds_max.is_finite());
        }
    }
}

#[test]
fn the_summary_is_a_few_lines_for_people_and_fields_for_programs() {
    let loaded = Ply::new("ascii").element("vertex", &XYZ, &cube()).load();
    let text = loaded.summary.to_string();
    assert!(text.contains("8 surfels (PLY, ascii") && text.lines().count() <= 4, "{text}");
    assert!(text.contains("normals 8 estimated; radii 8 estimated; colours 8 neutral"), "{text}");
    let json = serde_json::to_value(&loaded.summary).unwrap();
    assert_eq!(json["normals"]["estimated"], 8);
    assert!(json["seconds"].as_f64().unwrap() > 0.0);
}

#[test]
fn tangents_longer_than_the_cloud_are_shortened() {
    let mut rows = with(sphere(100), |_| vec![0.2, 0.0, 0.0, 0.0, 0.1, 0.0]);
    rows[0][3] = 1e25;
    rows[1][7] = 1e15;
    let loaded =
        Ply::new("binary_little_endian").element("vertex", &also(&XYZ, &TANGENTS), &rows).load();
    let longest = loaded.cloud.vectors("tangent_u")[0];
    assert!((longest.length() - 12f32.sqrt()).abs() < 0.2 && longest.y == 0.0, "{longest}");
    assert!((loaded.cloud.vectors("tangent_v")[1].length() - 12f32.sqrt()).abs() < 0.2);
    assert_eq!(loaded.cloud.vectors("tangent_u")[2], Vec3::X * 0.2);
    let warnings = loaded.summary.warnings.join("; ");
    assert!(warnings.contains("2 tangents were longer than the cloud"), "{warnings}");
}

/// Few splats stand for much: those of two walls have a box of centres that is flat.
#[test]
fn splats_larger_than_the_box_of_their_centres_stay_as_they_are() {
    let rest = ["radius", "normal_field_0", "normal_field_1", "normal_field_2", "normal_field_3"];
    let rest = rest.map(|name| format!("float {name}"));
    let names = also(&also(&XYZ, &TANGENTS), &rest.each_ref().map(String::as_str));
    let row = |y| vec![0.0, y, 0.0, 0.28, 0.0, 0.0, 0.0, 0.0, 0.2, 0.28, 0.0, 0.0, 0.5, 0.5];
    let rows = [row(0.0), row(0.1)];
    let loaded = Ply::new("ascii").element("vertex", &names, &rows).load();
    assert_eq!(loaded.cloud.vectors("tangent_u"), [Vec3::X * 0.28; 2]);
    assert_eq!(loaded.cloud.radii(), [0.28; 2]);
    assert!(loaded.summary.warnings.is_empty(), "{:?}", loaded.summary.warnings);
}

#[test]
#[cfg(unix)]
fn pipes_are_refused_without_waiting_for_a_writer() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe.ply");
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("a pipe or device"), "{error}");
}

#[test]
fn coordinates_that_are_too_large_are_not_called_infinite() {
    for (kind, large) in [("float", "1e38"), ("double", "1e100"), ("double", "-1e38")] {
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty {kind} x\nproperty {kind} y\nproperty \
             {kind} z\nend_header\n0 0 0\n1 0 0\n0 {large} 0\n0 nan 0\n"
        );
        let summary = load(text.as_bytes()).summary;
        assert_eq!((summary.n_dropped, summary.n_too_large), (2, 1), "{large}");
        let why = summary.why_dropped();
        assert_eq!(
            why,
            "the coordinates of 1 are not finite; of the others their coordinates exceed 8.5e37; \
             scale the file"
        );
    }
}
