use super::*;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use surfelshop_api::columns::Element;
use surfelshop_api::format::UpAxis;

const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Two nodes: a triangle with a normal and two points beside it in one mesh, which is moved, and mirrored.
fn two_nodes() -> Builder {
    let mut b = Builder::default();
    let position = b.floats(&TRIANGLE, "VEC3");
    let normal = b.floats(&[0.0, 0.0, 1.0].repeat(3), "VEC3");
    let indices = b.shorts(&[0, 1, 2]);
    let points = b.floats(&[5.0, 6.0, 7.0, 8.0, 9.0, 10.0], "VEC3");
    b.root(&format!(
        r#""meshes":[{{"name":"m","primitives":[
            {{"attributes":{{"POSITION":{position},"NORMAL":{normal}}},"indices":{indices}}},
            {{"attributes":{{"POSITION":{points}}},"mode":0}}]}}]"#
    ));
    b.root(
        r#""nodes":[
            {"children":[1],"translation":[10,0,0]},
            {"mesh":0,"rotation":[0,0,0.70710677,0.70710677]},
            {"mesh":0,"matrix":[-1,0,0,0, 0,2,0,0, 0,0,1,0, 0,0,3,1]}],
        "scenes":[{"nodes":[0,2],"name":"both"}],"scene":0"#,
    );
    b
}

#[test]
fn points_and_triangles_of_all_nodes_are_one_cloud() {
    let found = two_nodes().found();
    let cloud = only(&found);
    // A quarter turn about z and 10 along x; then x mirrored, y stretched, and 3 along z.
    let turned = [10.0, 0.0, 0.0, 10.0, 1.0, 0.0, 9.0, 0.0, 0.0, 4.0, 5.0, 7.0, 1.0, 8.0, 10.0];
    let mirrored =
        [0.0, 0.0, 3.0, -1.0, 0.0, 3.0, 0.0, 2.0, 3.0, -5.0, 12.0, 10.0, -8.0, 18.0, 13.0];
    near(values(&found, "position"), &[turned, mirrored].concat());
    // The mirrored triangle is listed the other way round, so that it is still seen from where its normal points.
    assert_eq!(cloud.faces, [[0, 1, 2], [5, 7, 6]]);
    let z = [0.0, 0.0, 1.0];
    let none = [f64::NAN; 3];
    near(values(&found, "normal"), &[z, z, z, none, none, z, z, z, none, none].concat());
    let header = &cloud.header;
    assert_eq!((header.rows, header.has_faces, header.up), (Some(10), true, UpAxis::Y));
    assert_eq!((header.format.as_str(), header.name.as_str()), ("GLB 2.0", "both"));
    assert_eq!(
        (header.metres_per_unit, header.comments.as_slice()),
        (1.0, &["a test".to_owned()][..])
    );
    assert_eq!(header.column("position").unwrap().1.element, Element::F64);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn normals_stay_normal_to_stretched_surfaces() {
    let mut b = Builder::default();
    let position = b.floats(&TRIANGLE, "VEC3");
    let normal = b.floats(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
    b.root(&format!(r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":{position},"NORMAL":{normal}}}}}]}}]"#));
    b.root(r#""nodes":[{"mesh":0,"scale":[2,1,0]}],"scenes":[{"nodes":[0]}]"#);
    // Flattened to no depth, only what points along it has a direction; it has no inverse.
    let found = b.found();
    near(values(&found, "normal"), &[f64::NAN; 9]);
    b.rest[1] = b.rest[1].replace("[2,1,0]", "[2,1,-1]");
    let h = 5f64.sqrt();
    near(
        values(&b.found(), "normal"),
        &[1.0 / h, 2.0 / h, 0.0, f64::NAN, f64::NAN, f64::NAN, 0.0, 1.0, 0.0],
    );
}

#[test]
fn buffers_in_the_text_are_read_and_others_are_named() {
    let b = two_nodes();
    let expected = b.found();
    let data = BASE64_STANDARD.encode(&b.bytes);
    let json = |uri: &str| b.json(&format!(r#","uri":"{uri}""#));
    let uri = format!("data:application/octet-stream;base64,{data}");
    let found = read(json(&uri).as_bytes()).unwrap();
    assert_eq!(only(&found).columns[0], only(&expected).columns[0]);
    assert_eq!(only(&found).faces, only(&expected).faces);
    assert_eq!(only(&found).header.format, "glTF 2.0");
    for (uri, expected) in [
        ("scene.bin", "in the file `scene.bin` in the folder of the scene"),
        ("data:text/plain,abc", "no `data:` URI of base64"),
        ("data:;base64,ab*c", "damaged base64"),
        ("data:;base64,AAAA", "expected 104 bytes in buffer 0, found 3"),
    ] {
        let line = refusal(json(uri).as_bytes());
        assert!(line.contains(expected), "{line}");
    }
    assert!(refusal(b.json("").as_bytes()).contains("buffer 0 has no bytes"));
}

#[test]
fn buffers_in_files_of_the_same_folder_are_read() {
    let b = two_nodes();
    let expected = b.found();
    let json = |uri: &str| b.json(&format!(r#","uri":"{uri}""#)).into_bytes();
    let read = |uri: &str, bytes: &[u8]| {
        let files = vec![("a.gltf", json(uri)), ("the scene%.bin", bytes.to_vec())];
        read_file(&FileSource::of_files(files), Colors::Encoded)
    };
    for uri in ["the scene%.bin", "the%20scene%25.bin", "./the%20scene%.bin"] {
        let found = read(uri, &b.bytes).unwrap();
        assert_eq!(only(&found).columns[0], only(&expected).columns[0]);
        assert_eq!(only(&found).faces, only(&expected).faces);
    }
    for uri in ["../the scene%.bin", "/the scene%.bin", "the%20scene", "%", "%zz", "%+f", ""] {
        let line = read(uri, &b.bytes).unwrap_err().to_string();
        assert!(line.contains("in the folder of the scene") && !line.contains('\n'), "{line}");
    }
    let line = read("the scene%.bin", &b.bytes[1..]).unwrap_err().to_string();
    assert!(line.contains("expected 104 bytes in buffer 0, found 103"), "{line}");
}

#[test]
fn without_a_scene_every_mesh_is_read_once() {
    let mut b = two_nodes();
    b.rest.truncate(1);
    let found = b.found();
    assert_eq!((only(&found).header.rows, only(&found).faces.len()), (Some(5), 1));
    assert_eq!(only(&found).header.columns[0].element, Element::F32);
    near(&values(&found, "position")[..9], &TRIANGLE.map(f64::from));
    let nothing = Builder::default().found();
    assert_eq!((only(&nothing).header.rows, only(&nothing).header.has_faces), (Some(0), false));
}

#[test]
fn nodes_are_visited_once() {
    let mut b = two_nodes();
    b.rest[1] = r#""nodes":[{"children":[1,1,0],"mesh":0},{"children":[0]}],"scenes":[{"nodes":[0]},{"nodes":[]}]"#.to_owned();
    let found = b.found();
    assert_eq!(only(&found).header.rows, Some(5));
    assert!(
        found.warnings.iter().any(|line| line.contains("3 nodes are below several others")),
        "{:?}",
        found.warnings
    );
    assert!(found.warnings.iter().any(|line| line.contains("one of 2 scenes")));
}

#[test]
fn references_to_nothing_are_refused() {
    for (from, to, expected) in [
        (r#""scene":0"#, r#""scene":7"#, "expected a scene 7"),
        (r#""nodes":[0,2]"#, r#""nodes":[9]"#, "expected a node 9"),
        (r#"{"mesh":0,"rot"#, r#"{"mesh":8,"rot"#, "expected a mesh 8"),
        (r#""indices":2"#, r#""indices":20"#, "expected an accessor 20"),
        (r#""POSITION":0"#, r#""POSITION":4000000000"#, "expected an accessor 4000000000"),
        (r#""indices":2"#, r#""material":3"#, "expected a material 3"),
        (r#""bufferView":1,"#, r#""bufferView":9,"#, "expected a buffer view 9"),
        (r#"{"buffer":0,"byteOffset":36"#, r#"{"buffer":1,"byteOffset":36"#, "expected a buffer 1"),
        (
            r#""byteOffset":36,"byteLength":36"#,
            r#""byteOffset":18446744073709551615,"byteLength":36"#,
            "expected 36 bytes from byte 18446744073709551615",
        ),
        (
            r#""count":3}"#,
            r#""count":4}"#,
            "expected 48 bytes from byte 0 of its buffer view, found 36",
        ),
        (r#""count":3}"#, r#""count":18446744073709551615}"#, "at most 4294967295 elements"),
        (r#""version":"2.0""#, r#""version":"1.0""#, "found version 1.0"),
        (r#""mode":0"#, r#""mode":9"#, "expected a mode of glTF"),
        (
            r#""type":"VEC3","count":2"#,
            r#""type":"VEC2","count":2"#,
            "expected 3 components, found 2",
        ),
        (
            r#""scene":0"#,
            r#""scene":0,"extensionsRequired":["KHR_draco_mesh_compression"]"#,
            "KHR_draco_mesh_compression is required",
        ),
        (
            r#""scene":0"#,
            r#""scene":0,"extensionsRequired":["EXT_meshopt_compression"]"#,
            "EXT_meshopt_compression is required",
        ),
    ] {
        let b = two_nodes();
        let json = b.json("");
        assert!(json.contains(from), "{from}");
        let line = refusal(&glb(&json.replacen(from, to, 1), &b.bytes));
        assert!(line.contains(expected), "{line}");
    }
}

#[test]
fn extensions_that_change_no_points_are_no_matter() {
    let mut b = two_nodes();
    b.root(r#""extensionsRequired":["KHR_materials_unlit","KHR_mesh_quantization"]"#);
    assert!(b.found().warnings.is_empty());
    b.rest.pop();
    b.root(r#""extensionsRequired":["ACME_a","ACME_b"]"#);
    assert!(b.found().warnings[0].contains("ACME_a and 1 others are required"));
    let b = two_nodes();
    let lines = b.json("").replace(r#""mode":0"#, r#""mode":3"#);
    let found = read(&glb(&lines, &b.bytes)).unwrap();
    assert_eq!((only(&found).header.rows, found.warnings.len()), (Some(6), 1));
}

#[test]
fn damaged_containers_are_refused() {
    let whole = two_nodes().glb();
    for (len, expected) in [(0, "as JSON"), (3, "as JSON"), (11, "cut short"), (40, "cut short")] {
        let line = refusal(&whole[..len]);
        assert!(line.contains(expected), "{line}");
    }
    let with = |place: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[place..place + bytes.len()].copy_from_slice(bytes);
        refusal(&file)
    };
    assert!(with(4, &[1]).contains("found version 1"));
    assert!(with(8, &[0, 0, 0, 0]).contains("expected a chunk of JSON"));
    assert!(with(12, &[255, 255, 255, 255]).contains("expected a chunk of 4294967295 bytes"));
    assert!(with(16, b"JSOM").contains("expected a chunk of JSON"));
    // Bytes behind the announced length do not count.
    let longer = [&whole[..], &[7; 5]].concat();
    assert!(read(&longer).is_ok());
}
