use super::*;
use surfelshop_api::columns::Element;
use surfelshop_api::params::srgb_to_linear;

const POINT: [f32; 3] = [1.0, 2.0, 3.0];

/// Points, each with a primitive of its own: the JSON of their colours and materials.
fn points(b: &mut Builder, more: &[(String, &str)]) {
    let position = b.floats(&POINT, "VEC3");
    let primitive = |(color, material): &(String, &str)| {
        format!(r#"{{"mode":0,"attributes":{{"POSITION":{position}{color}}}{material}}}"#)
    };
    let all: Vec<String> = more.iter().map(primitive).collect();
    b.mesh(&all.join(","));
    b.root(
        r#""materials":[{},
            {"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,1,1]}},
            {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
            {"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,0.125],"baseColorTexture":{"index":0}}}]"#,
    );
}

/// What becomes of colours: the type, the components, the values, and the warnings.
fn found(b: &Builder, colors: Colors) -> (Element, u32, Vec<f64>, usize) {
    let found = read_with(&b.glb(), colors).unwrap();
    let (_, column) = only(&found).header.column("color").unwrap();
    let (element, components) = (column.element, column.components);
    (element, components, values(&found, "color").to_vec(), found.warnings.len())
}

fn attribute(accessor: usize) -> String {
    format!(r#","COLOR_0":{accessor}"#)
}

#[test]
fn whole_numbers_stay_where_nothing_multiplies_them() {
    let normalized = r#","normalized":true"#;
    let mut b = Builder::default();
    let color = b.accessor(&[255, 128, 0, 0], UNSIGNED_BYTE, "VEC3", 1, normalized);
    let alpha = b.accessor(&[1, 2, 3, 4], UNSIGNED_BYTE, "VEC4", 1, normalized);
    points(&mut b, &[(attribute(color), ""), (attribute(alpha), r#","material":0"#)]);
    let expected = vec![255.0, 128.0, 0.0, 255.0, 1.0, 2.0, 3.0, 4.0];
    assert_eq!(found(&b, Colors::Encoded), (Element::U8, 4, expected, 0));
    let (element, _, linear, _) = found(&b, Colors::Linear);
    assert_eq!(element, Element::F32);
    near(&linear[..4], &[1.0, 128.0 / 255.0, 0.0, 1.0]);
    let mut b = Builder::default();
    let color = b.accessor(&[255, 255, 1, 0, 0, 0], UNSIGNED_SHORT, "VEC3", 1, normalized);
    points(&mut b, &[(attribute(color), "")]);
    assert_eq!(found(&b, Colors::Encoded), (Element::U16, 3, vec![65535.0, 1.0, 0.0], 0));
}

#[test]
fn materials_color_points_and_multiply_their_colors() {
    let mut b = Builder::default();
    let bytes = b.accessor(&[255, 128, 0, 0], UNSIGNED_BYTE, "VEC3", 1, r#","normalized":true"#);
    let floats = b.floats(&[0.5, 2.0, 0.25, 0.5], "VEC4");
    points(
        &mut b,
        &[
            (attribute(bytes), r#","material":1"#),
            (attribute(floats), ""),
            (String::new(), r#","material":1"#),
            (String::new(), ""),
            // A texture that is not read: white says nothing, grey does.
            (String::new(), r#","material":2"#),
            (String::new(), r#","material":3"#),
        ],
    );
    let (element, components, colors, n_warnings) = found(&b, Colors::Encoded);
    assert_eq!((element, components, n_warnings), (Element::F32, 4, 1));
    let half = f64::from(srgb_to_linear(128.0 / 255.0));
    let expected = [
        [0.5, 0.25 * half, 0.0, 1.0],
        [0.5, 2.0, 0.25, 0.5],
        [0.5, 0.25, 1.0, 1.0],
        [0.5, 0.5, 0.5, 1.0],
        [0.5, 0.5, 0.5, 1.0],
        [0.5, 0.5, 0.5, 0.125],
    ];
    near(&colors, &expected.concat());
}

#[test]
fn without_colors_there_is_no_column() {
    let mut b = Builder::default();
    points(&mut b, &[(String::new(), ""), (String::new(), r#","material":2"#)]);
    let read = b.found();
    assert!(only(&read).header.column("color").is_none() && read.warnings[0].contains("textures"));
    // Whole numbers that are not normalised are no colours.
    let mut b = Builder::default();
    let color = b.accessor(&[255, 128, 0, 0], UNSIGNED_BYTE, "VEC3", 1, "");
    points(&mut b, &[(attribute(color), "")]);
    let read = b.found();
    assert!(only(&read).header.column("color").is_none() && read.warnings[0].contains("COLOR_0"));
    // A material without a texture says white.
    let mut b = Builder::default();
    points(&mut b, &[(String::new(), r#","material":0"#)]);
    assert_eq!(found(&b, Colors::Encoded), (Element::F32, 3, vec![1.0; 3], 0));
}
