//! What is seen in which direction.

use crate::environment::light::{TO_EYE, all_reflected, text, values};
use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::{Camera, Projection};
use surfelshop_cloud::environment_map::{Mapping, Picture, Probe};
use surfelshop_tests::natural_light::{Lab, around, pixels};

/// Six colours, one around each axis: x red, -x cyan, y green, -y magenta, z blue, -z yellow.
fn color_of(direction: DVec3) -> [f32; 3] {
    let largest = direction.abs().max_element();
    let axis = (0..3).find(|&k| direction[k].abs() == largest).unwrap();
    let towards = direction[axis] > 0.0;
    let mut color = [if towards { 0.0 } else { 1.0 }; 3];
    color[axis] = if towards { 1.0 } else { 0.0 };
    color
}

/// The six colours as a picture of a mapping.
fn six_colors(mapping: Mapping) -> Picture {
    let (width, height) = match mapping {
        Mapping::LatLong => (512, 256),
        Mapping::VerticalCross => (384, 512),
        Mapping::HorizontalCross => (512, 384),
        _ => (512, 512),
    };
    let texel = |i: u32| {
        let at = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n);
        let direction = mapping.direction(at(i % width, width), at(i / width, height));
        direction.map_or([0.0; 3], color_of)
    };
    Picture { width, height, rgb: (0..width * height).map(texel).collect() }
}

#[test]
fn every_mapping_shows_each_axis_in_its_color() {
    let mut lab = Lab::new(20_000, 40);
    for mapping in Mapping::ALL {
        let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
        let near_axis = |direction: DVec3| direction.abs().max_element() > 0.9;
        let mut seen = [0; 6];
        for pixel in lab.pixels(&probe, &all_reflected(0.0)).unwrap() {
            let mirrored = 2.0 * pixel.normal.dot(TO_EYE) * pixel.normal - TO_EYE;
            if !near_axis(mirrored) || pixel.normal.z < 0.2 {
                continue;
            }
            let expected = color_of(mirrored);
            for (found, expected) in pixel.color.iter().zip(expected) {
                assert!(
                    (found - f64::from(expected)).abs() < 0.02,
                    "{}: towards {mirrored} is {:?}, not {expected:?}",
                    mapping.name(),
                    pixel.color
                );
            }
            let axis = (0..3).find(|&k| mirrored[k].abs() > 0.9).unwrap();
            seen[2 * axis + usize::from(mirrored[axis] < 0.0)] += 1;
        }
        // Straight behind the sphere nothing can be seen in it.
        assert!(seen[..5].iter().all(|n| *n > 0), "{}: {seen:?}", mapping.name());
    }
}

#[test]
fn backgrounds_show_the_environment_where_nothing_else_is() {
    let mut lab = Lab::new(20_000, 40);
    let mapping = Mapping::LatLong;
    let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
    let environment = around(&probe);
    for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
        let up = if axis.y.abs() > 0.5 { DVec3::Z } else { DVec3::Y };
        lab.view.camera = Camera {
            eye: 5.0 * axis,
            target: 10.0 * axis,
            up,
            projection: Projection::Perspective { fov_y: 0.3 },
        };
        for how in ["sharp", "blurred"] {
            let values = values(&[("background", text(how))]);
            let rendered = lab.frame(Some((&environment, &probe)), &values, 1).unwrap();
            let color = rendered.image(&Output::Color).unwrap();
            for pixel in color.data.chunks_exact(4) {
                let expected = color_of(axis);
                let close = pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02);
                assert!(close && pixel[3] == 1.0, "{how} towards {axis}: {pixel:?}");
            }
        }
    }
}

#[test]
fn parallel_views_see_the_same_background_at_any_scale() {
    let mut lab = Lab::new(20_000, 40);
    let probe = Probe::sky();
    let environment = around(&probe);
    // Past the sphere, so that nothing else is seen.
    lab.view.camera.eye = DVec3::new(10.0, 0.0, 4.0);
    lab.view.camera.target = DVec3::new(10.0, 0.5, 0.0);
    let mut corner = |height: f64| {
        lab.view.camera.projection = Projection::Orthographic { height };
        let asked = values(&[("background", text("sharp"))]);
        let rendered = lab.frame(Some((&environment, &probe)), &asked, 1).unwrap();
        rendered.image(&Output::Color).unwrap().pixel(0, 0).to_vec()
    };
    let usual = corner(2.5);
    assert!(usual[0] > 0.0);
    for height in [0.0025, 12.0] {
        assert_eq!(corner(height), usual, "{height}");
    }
}

#[test]
fn turning_the_light_is_turning_the_world() {
    let mut lab = Lab::new(20_000, 40);
    let mapping = Mapping::Octahedral;
    let probe = Probe::from_picture("axes", six_colors(mapping), Some(mapping)).unwrap();
    let mut environment = around(&probe);
    // A quarter about y: what came from x comes from -z.
    environment.probe_from_world = glam::DMat3::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    environment.gain = 2.0;
    let seen =
        pixels(&lab.frame(Some((&environment, &probe)), &all_reflected(0.0), 1).unwrap(), TO_EYE);
    let in_front = seen.iter().max_by(|a, b| a.normal.z.total_cmp(&b.normal.z)).unwrap();
    // The mirrored direction is z; x of the probe lies at -z now, so -x lies at z.
    let expected = color_of(DVec3::NEG_X).map(|c| 2.0 * f64::from(c));
    for (found, expected) in in_front.color.iter().zip(expected) {
        assert!((found - expected).abs() < 0.05, "{:?}", in_front.color);
    }
}
