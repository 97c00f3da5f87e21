//! Columns of clouds as graphs are given them: what is missing, and what is of other types.

use super::scripted::drawn;
use super::stage;
use glam::DVec3;
use surfelshop_api::columns::{COLOR, POSITION};
use surfelshop_api::graph::Output;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::*;
use surfelshop_cloud::{Buffer as Values, Cloud, Column};
use surfelshop_render::{EngineOptions, GpuOptions};
use surfelshop_tests::stage::{engine, engine_with};

/// Three surfels along a line, in the order in which they are given, with columns.
fn row(origin: DVec3, columns: Vec<Column>) -> Cloud {
    let places = vec![0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0];
    let position = Column::new(POSITION, 3, Values::F32(places));
    Cloud::new(origin, [vec![position], columns].concat()).unwrap()
}

/// What a graph sees of a column of these clouds: a value for each surfel, its first four numbers.
fn seen(clouds: &[&Cloud], objects: &'static [u32], column: BufferColumn) -> Vec<[f32; 4]> {
    let mut engine = engine();
    let n: usize = objects.iter().map(|i| clouds[*i as usize].len()).sum();
    let frame = drawn(&mut engine, clouds, move |frame, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let (n, given) =
            graph.columns("given", &frame.cloud, objects, std::slice::from_ref(&column));
        let value = format!("given::{}(i)", column.name);
        let shown = match column.components {
            1 => format!("vec4({value}, 0.0, 0.0, 0.0)"),
            3 => format!("vec4({value}, 0.0)"),
            _ => value,
        };
        let wgsl = format!(
            "#import given\n\
             @fragment fn show(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {{\n\
                 let i = u32(p.x);\n\
                 if i >= {n}u {{ return vec4(-1.0); }}\n\
                 return {shown};\n\
             }}\n"
        );
        graph.pass(Pass::fullscreen("show", &wgsl, "show").reads(&given).target(color));
        graph.output(Output::Color, color);
    });
    let pixels = stage::pixels(&frame.unwrap(), &Output::Color);
    assert_eq!(pixels[n], [-1.0; 4], "there are {n} surfels");
    pixels[..n].to_vec()
}

/// The first number of each surfel.
fn numbers(cloud: &Cloud, column: BufferColumn) -> [f32; 3] {
    let seen = seen(&[cloud], &[0], column);
    [seen[0][0], seen[1][0], seen[2][0]]
}

/// Costs 0.2 s.
#[test]
fn numbers_of_all_types_are_given_as_floats() {
    let column = |values: Values| row(DVec3::ZERO, vec![Column::new("value", 1, values)]);
    let ask = || BufferColumn::new("value", 1);
    for (values, expected) in [
        (Values::U8(vec![0, 7, 255]), [0.0, 7.0, 255.0]),
        (Values::I8(vec![-128, 0, 127]), [-128.0, 0.0, 127.0]),
        (Values::U16(vec![0, 1, 65535]), [0.0, 1.0, 65535.0]),
        (Values::I16(vec![-5, 0, 5]), [-5.0, 0.0, 5.0]),
        (Values::U32(vec![0, 1, 1 << 20]), [0.0, 1.0, 1_048_576.0]),
        (Values::I32(vec![-7, 0, 7]), [-7.0, 0.0, 7.0]),
        (Values::F32(vec![0.1, -2.5, 1e30]), [0.1, -2.5, 1e30]),
        (Values::F64(vec![0.1, -2.5, 1e30]), [0.1, -2.5, 1e30]),
    ] {
        let element = values.element();
        assert_eq!(numbers(&column(values), ask()), expected, "{element:?}");
    }
    let cloud = column(Values::F32(vec![0.1, 1.0 / 3.0, 1.5]));
    let half = numbers(&cloud, ask().f16());
    assert_eq!(half, [0.099_975_586, 0.333_251_95, 1.5], "eleven bits");
    let eighth = numbers(&cloud, ask().unorm8());
    // Source: WGSL, section 15.7.4, a quotient of floats is right to 2.5 units in the last place; the software driver
    // divides as the CPU does.
    let rounding = if engine().gpu().is_software() { 0.0 } else { 2.5 * f32::EPSILON };
    for (found, expected) in eighth.into_iter().zip([26.0 / 255.0, 85.0 / 255.0, 1.0f32]) {
        assert!((found - expected).abs() <= rounding * expected, "from 0 to 1: {eighth:?}");
    }
}

/// Costs 0.1 s.
#[test]
fn what_is_missing_is_what_was_said() {
    let cloud = row(DVec3::ZERO, vec![Column::new("two", 2, Values::U8(vec![1, 2, 3, 4, 5, 6]))]);
    assert_eq!(numbers(&cloud, BufferColumn::new("other", 1).or(0.25)), [0.25; 3]);
    assert_eq!(numbers(&cloud, BufferColumn::new("other", 1)), [0.0; 3]);
    let three = seen(&[&cloud], &[0], BufferColumn::new("two", 4).or(9.0));
    assert_eq!(three[1], [3.0, 4.0, 9.0, 9.0], "components that are not there");
    assert_eq!(
        numbers(&cloud, BufferColumn::new("two", 1)),
        [1.0, 3.0, 5.0],
        "fewer than there are"
    );
    // Of two clouds one has it.
    let other =
        row(DVec3::new(0.0, 0.0, 5.0), vec![Column::new("a", 1, Values::F32(vec![4.0; 3]))]);
    let both = seen(&[&cloud, &other], &[0, 1], BufferColumn::new("a", 1).or(-3.0));
    let firsts: Vec<f32> = both.iter().map(|value| value[0]).collect();
    assert_eq!(firsts, [-3.0, -3.0, -3.0, 4.0, 4.0, 4.0]);
    let second = seen(&[&cloud, &other], &[1], BufferColumn::new("a", 1));
    assert_eq!(second.len(), 3);
}

/// Colours are linear, places are from the scene's origin, which is that of its first cloud. Costs 0.1 s.
#[test]
fn colours_are_decoded_and_places_have_one_origin() {
    let color = Column::new(COLOR, 4, Values::U8([[128, 0, 255, 64]; 3].as_flattened().to_vec()));
    let first = row(DVec3::new(1e6, 2e6, 3e6), vec![color]);
    let seen_color = seen(&[&first], &[0], BufferColumn::new(COLOR, 4))[0];
    let of = |code: f32| srgb_to_linear(code / 255.0);
    let apart = |a: f32, b: f32| (a - b).abs();
    let expected = [of(128.0), 0.0, 1.0, 64.0 / 255.0];
    assert!((0..4).all(|k| apart(seen_color[k], expected[k]) < 1e-6), "{seen_color:?}");
    let second = row(DVec3::new(1e6 + 2.0, 2e6, 3e6), vec![]);
    let places = seen(&[&first, &second], &[0, 1], BufferColumn::new(POSITION, 3));
    let x: Vec<f32> = places.iter().map(|place| place[0]).collect();
    assert_eq!(x, [0.0, 0.5, 1.0, 2.0, 2.5, 3.0]);
}

/// Passes of other kinds cannot take columns in parts. Costs 0.1 s.
#[test]
fn parts_are_refused_to_passes_that_do_not_draw_splats() {
    let options = EngineOptions { part_splats: 2, ..EngineOptions::default() };
    let mut engine = engine_with(&GpuOptions::default(), &options);
    let cloud = row(DVec3::ZERO, vec![]);
    let refused = drawn(&mut engine, &[&cloud], |frame, graph| {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let columns = [BufferColumn::new(POSITION, 3)];
        let (_, given) = graph.columns("given", &frame.cloud, &[0], &columns);
        let wgsl = "
            #import given
            @fragment fn show() -> @location(0) vec4<f32> {
                return vec4(given::position(0u), 1.0);
            }";
        graph.pass(Pass::fullscreen("show", wgsl, "show").reads(&given).target(color));
        graph.output(Output::Color, color);
    });
    let line = refused.err().unwrap().to_string();
    assert!(line.contains("pass `show`") && line.contains("given"), "{line}");
    assert!(!line.contains('\n'), "{line}");
}
