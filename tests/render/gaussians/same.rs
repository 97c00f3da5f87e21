//! What must not change a picture: the order of Gaussians, parts, and where a cloud stands that the camera follows.

use super::agreement::views;
use super::stage::{self, Gaussians};
use glam::{DQuat, DVec3};
use surfelshop_api::columns::{OPACITY, SH, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Projection, View};
use surfelshop_cloud::{Buffer, Cloud, Column, Rotation, Transform};
use surfelshop_render::{EngineOptions, GpuOptions};
use surfelshop_tests::stage::{each_way, engine, engine_with};

/// Gaussians of which many stand at one place, and more at one distance.
fn crowded(n: usize) -> Gaussians {
    let mut all = Gaussians::generated(n);
    for position in &mut all.positions {
        *position = (*position * 5.0).round() / 5.0;
    }
    // Some that nothing tells apart but the last of their numbers.
    for i in 1..50 {
        all.positions[i] = all.positions[0];
        all.scales[i] = [0.3; 3];
        all.rotations[i] = all.rotations[0];
        all.opacities[i] = 0.7;
        for (l, values) in all.harmonics.iter_mut().enumerate() {
            let n = 6 * l + 3;
            values.copy_within(0..n, i * n);
        }
        let last = 21 * i + 20;
        all.harmonics[3][last] = i as f32 / 50.0;
    }
    all
}

/// Columns in types that are converted before they are drawn.
fn in_other_types(cloud: &Cloud) -> Cloud {
    let doubles = |name: &str, n: u32| {
        let values = cloud.column(name).unwrap().values().as_values();
        Column::new(name, n, Buffer::F64(values.iter_f64().collect()))
    };
    let columns = vec![doubles(OPACITY, 1), doubles(SPLAT_SCALE, 3), doubles(SH[3], 21)];
    cloud.with_columns(columns).unwrap()
}

/// Costs 2 s.
///
/// Invariant: the order of Gaussians in a file shows in no bit of a picture
#[test]
fn the_order_of_input_shows_in_no_bit() {
    let all = crowded(2000);
    let clouds = [all.cloud(), all.shuffled().cloud()];
    let views = [views()[1], views()[3]];
    draw_alike(&clouds, &["sorted", "stochastic", "additive", "nearest", "normalized"], &views);
    // Without a graphics card the others take long.
    each_way(|| draw_alike(&clouds, &["sorted", "normalized"], &views[..1]));
}

/// Holds pictures of two clouds against each other.
#[track_caller]
fn draw_alike(clouds: &[Cloud; 2], blends: &[&str], views: &[(&str, View)]) {
    let mut engine = engine();
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        for blend in blends {
            let values = stage::values(&[("blend", stage::text(blend))]);
            for (name, view) in views {
                let [a, b] = clouds.each_ref().map(|cloud| {
                    let (clouds, mut outputs) = ([cloud], stage::outputs().to_vec());
                    if unit == "gaussians-2d" {
                        outputs.push(stage::distortion());
                    }
                    stage::frame(&mut engine, &mut renderer, &clouds, *view, &values, &outputs)
                        .unwrap()
                });
                stage::equal_bits(&a, &b, &format!("{unit} {blend} {name}"));
            }
        }
    }
}

/// The same of columns that are not of `f32`. Costs 0.2 s.
#[test]
fn nor_does_it_show_of_columns_that_are_converted() {
    let all = crowded(500);
    let clouds = [all.cloud(), all.shuffled().cloud()].map(|cloud| in_other_types(&cloud));
    let mut engine = engine();
    let mut renderer = stage::renderer(&engine, "gaussians");
    let (name, view) = views()[1];
    let [a, b] = clouds.each_ref().map(|cloud| {
        let outputs = [Output::Color];
        stage::frame(&mut engine, &mut renderer, &[cloud], view, &Values::new(), &outputs).unwrap()
    });
    stage::equal_bits(&a, &b, name);
}

/// As the CPU draws; what a device does not bind as a whole is put together there. Costs 1 s.
#[test]
fn parts_show_in_no_bit() {
    let cloud = Gaussians::generated(2500).cloud();
    let outputs = stage::outputs();
    for unit in stage::UNITS {
        let mut pictures = Vec::new();
        for part_splats in [u32::MAX, 1000, 2500, 333, 1_250] {
            let options = EngineOptions { part_splats, ..EngineOptions::default() };
            let mut engine = engine_with(&GpuOptions::default(), &options);
            let mut renderer = stage::renderer(&engine, unit);
            let (view, none) = (views()[1].1, Values::new());
            let frame =
                stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &outputs).unwrap();
            pictures.push((part_splats, frame));
        }
        for (part_splats, frame) in &pictures[1..] {
            stage::equal_bits(&pictures[0].1, frame, &format!("{unit}, parts of {part_splats}"));
        }
    }
}

/// A view that moves as a cloud does.
fn moved(view: &View, transform: &Transform) -> View {
    let turn = transform.rotation.quaternion().unwrap();
    let scale = transform.scale;
    let place = |p: DVec3| turn * (p * scale) + transform.translation;
    let mut moved = *view;
    moved.camera.eye = place(view.camera.eye);
    moved.camera.target = place(view.camera.target);
    moved.camera.up = turn * view.camera.up;
    (moved.near, moved.far) = (view.near * scale, view.far * scale);
    if let Projection::Orthographic { height } = &mut moved.camera.projection {
        *height *= scale;
    }
    moved
}

/// Columns are rounded once more where a cloud is turned, positions to 1e-7 of its size: 1e-5 of a pixel, and colours to
/// eleven bits: the bound of the agreement with the formulas; 95 dB were measured. Costs 0.3 s.
#[test]
fn a_cloud_that_stands_elsewhere_looks_the_same_from_there() {
    let cloud = Gaussians::generated(2000).cloud();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -1.9, 2.6);
    let mut engine = engine();
    for (scale, translation) in [(1.0, DVec3::ZERO), (37.0, DVec3::new(5e5, -4e6, 210.0))] {
        let transform = Transform { scale, translation, rotation: Rotation::Quaternion(turn) };
        let placed = cloud.transformed(&transform).unwrap();
        for unit in stage::UNITS {
            let mut renderer = stage::renderer(&engine, unit);
            for (name, view) in [views()[1], views()[3], views()[5]] {
                let outputs = [Output::Color, stage::expected_depth()];
                let mut draw = |cloud: &Cloud, view: View| {
                    let none = Values::new();
                    stage::frame(&mut engine, &mut renderer, &[cloud], view, &none, &outputs)
                        .unwrap()
                };
                let (here, there) = (draw(&cloud, view), draw(&placed, moved(&view, &transform)));
                let [here_color, there_color] =
                    [&here, &there].map(|frame| stage::pixels(frame, &Output::Color));
                let decibels = stage::decibels(&there_color, &stage::wide(&here_color));
                stage::say(&format!("{unit} {name} placed at {scale}: {decibels:.1?} dB"));
                assert!(decibels.iter().all(|d| *d > 70.0), "{unit} {name}: {decibels:?}");
                let [near, far] = [&here, &there]
                    .map(|frame| stage::firsts(frame.image(&stage::expected_depth()).unwrap()));
                let is_off = |(near, far): &(&f32, &f32)| {
                    (f64::from(**far) - f64::from(**near) * scale).abs() > 1e-3 * scale
                };
                let n = near.iter().zip(&far).filter(is_off).count();
                assert!(100 * n < near.len(), "{unit} {name}: {n} depths differ");
            }
        }
    }
}

/// Without its harmonics turned along, the test above would fail. Costs 0.2 s.
#[test]
fn colours_of_a_turned_cloud_turn_along() {
    let cloud = Gaussians::generated(500).cloud();
    let rotation = Rotation::Quaternion(DQuat::from_rotation_x(1.3));
    let transform = Transform { rotation, ..Transform::default() };
    let placed = cloud.transformed(&transform).unwrap();
    let unturned = SH[1..].iter().map(|name| cloud.column(name).unwrap().clone()).collect();
    let unturned = placed.with_columns(unturned).unwrap();
    let mut engine = engine();
    let mut renderer = stage::renderer(&engine, "gaussians");
    let view = moved(&views()[1].1, &transform);
    let [right, wrong] = [&placed, &unturned].map(|cloud| {
        let (none, outputs) = (Values::new(), [Output::Color]);
        let frame =
            stage::frame(&mut engine, &mut renderer, &[cloud], view, &none, &outputs).unwrap();
        stage::pixels(&frame, &Output::Color)
    });
    let [color, coverage] = stage::decibels(&wrong, &stage::wide(&right));
    assert!(color < 40.0 && coverage > 60.0, "{color:.1} dB, coverage {coverage:.1} dB");
}

/// Costs 0.2 s.
#[test]
fn chance_tends_to_the_sorted_picture() {
    let cloud = Gaussians::generated(2500).cloud();
    let mut engine = engine();
    let mut renderer = stage::renderer(&engine, "gaussians");
    let view = views()[1].1;
    let mut draw = |blend: &str, samples: i64| {
        let pairs = [("blend", stage::text(blend)), ("samples", Value::Int(samples))];
        // Light without an encoding, so that means of light are compared.
        let linear = ("space", stage::text("linear"));
        let values = stage::values(&[pairs.as_slice(), &[linear]].concat());
        let outputs = [Output::Color];
        let frame =
            stage::frame(&mut engine, &mut renderer, &[&cloud], view, &values, &outputs).unwrap();
        stage::pixels(&frame, &Output::Color)
    };
    let sorted = draw("sorted", 1);
    let mut error = |samples: i64| {
        let found = draw("stochastic", samples);
        let square = |(a, b): (&[f32; 4], &[f32; 4])| {
            a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
        };
        let sum: f64 = found.iter().zip(&sorted).map(square).sum();
        (sum / (4 * sorted.len()) as f64).sqrt()
    };
    let [few, some, many] = [4, 16, 64].map(&mut error);
    stage::say(&format!("errors of 4, 16 and 64 samples: {few:.4}, {some:.4}, {many:.4}"));
    // Independent tries: the error is the inverse of the root of their number, here to a tenth.
    assert!(
        (few / many - 4.0).abs() < 0.4 && (few / some - 2.0).abs() < 0.2,
        "{few} {some} {many}"
    );
}
