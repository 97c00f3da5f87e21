//! `texture`: pictures on planes, cylinders and half spheres.

use super::shapes::TemporaryFile;
use super::*;
use crate::texture::{Settings, Texture};
use surfelshop_api::glam::DVec2;

/// A PNG file of four quarters: red and green above, blue and white below.
fn quarters(name: &str) -> TemporaryFile {
    let color = |x: u32, y: u32| match (x < 8, y < 8) {
        (true, true) => [255, 0, 0],
        (false, true) => [0, 255, 0],
        (true, false) => [0, 0, 255],
        (false, false) => [255, 255, 255],
    };
    let picture = image::RgbImage::from_fn(16, 16, |x, y| image::Rgb(color(x, y)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    TemporaryFile::new(name, bytes.get_ref())
}

fn settings(file: &TemporaryFile, pairs: &str) -> Settings {
    let (image, pairs) = (file.path(), pairs.to_owned());
    Settings { image, pairs, distortion: true, coordinates: true, ..Default::default() }
}

/// A square of 41 x 41 surfels that faces +z, of side 1, and what `map` makes of each.
fn sheet(map: impl Fn(DVec2) -> (DVec3, DVec3)) -> TestCloud {
    let shares = (0..41 * 41).map(|i| DVec2::new(f64::from(i % 41), f64::from(i / 41)) / 40.0);
    let (places, normals): (Vec<Vec3>, Vec<Vec3>) =
        shares.map(&map).map(|(place, normal)| (place.as_vec3(), normal.as_vec3())).unzip();
    TestCloud::new(&places, &normals, 0.02)
}

fn coordinates(ran: &ToolOutput) -> Vec<DVec2> {
    let pairs = ran.floats("texture_coordinate");
    pairs.chunks_exact(2).map(|pair| DVec2::new(pair[0].into(), pair[1].into())).collect()
}

#[test]
fn on_a_plane_a_picture_lies_as_it_is() {
    let file = quarters("plane.png");
    // Of any size, and far away.
    for (scale, origin) in
        [(1.0, DVec3::ZERO), (1e-6, DVec3::ZERO), (1.0, DVec3::new(1e6, -2e6, 0.0))]
    {
        let mut cloud = sheet(|share| (scale * share.extend(0.0), DVec3::Z));
        cloud.origin = origin;
        cloud.colors = vec![7; 3 * 41 * 41];
        cloud.radii.fill((0.02 * scale) as f32);
        let place = |share: DVec2| {
            let DVec3 { x, y, z } = origin + scale * share.extend(0.0);
            format!("{x:.12} {y:.12} {z}")
        };
        let [a, b] = [DVec2::new(0.2, 0.2), DVec2::new(0.8, 0.2)].map(place);
        let ran = run::<Texture>(&cloud, &settings(&file, &format!("{a} 0 1; {b} 1 1"))).unwrap();
        let (colors, distortion) = (ran.bytes("color"), ran.floats("distortion"));
        for (i, at) in coordinates(&ran).iter().enumerate() {
            if distortion[i] == 0.0 {
                // Beyond the patch.
                continue;
            }
            let own = DVec2::new((i % 41) as f64, (i / 41) as f64) / 40.0;
            let expected = DVec2::new((own.x - 0.2) / 0.6, 1.0 - (own.y - 0.2) / 0.6);
            assert!(at.distance(expected) < 1e-4, "{scale}: {own} is at {at}, expected {expected}");
            // Away from the lines between two colours, which are blended.
            let away = (expected - 0.5).abs().min_element() > 0.1;
            let is_inside = (expected - 0.5).abs().max_element() < 0.499;
            let color = match (expected.x < 0.5, expected.y < 0.5) {
                _ if !is_inside => [7, 7, 7],
                (true, true) => [255, 0, 0],
                (false, true) => [0, 255, 0],
                (true, false) => [0, 0, 255],
                (false, false) => [255, 255, 255],
            };
            let is_edge = ((expected - 0.5).abs().max_element() - 0.5).abs() < 0.01;
            assert!(!away || is_edge || colors[3 * i..3 * i + 3] == color, "{own}");
        }
        let laid = distortion.iter().filter(|value| **value > 0.0);
        assert!(
            laid.clone().count() > 600 && laid.into_iter().all(|value| (value - 1.0).abs() < 1e-3)
        );
    }
}

#[test]
fn what_can_be_unrolled_is() {
    let file = quarters("cylinder.png");
    // Three quarters of a circle, an arc as long as the height.
    let radius = 1.0 / 4.7;
    let cloud = sheet(|share| {
        let (sin, cos) = (share.x / radius).sin_cos();
        (DVec3::new(radius * sin, share.y, radius * cos), DVec3::new(sin, 0.0, cos))
    });
    let place = |share: DVec2| {
        let (sin, cos) = (share.x / radius).sin_cos();
        format!("{:.12} {} {:.12}", radius * sin, share.y, radius * cos)
    };
    let pairs = [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]
        .map(|[x, y]| format!("{} {x} {}", place(DVec2::new(x, y)), 1.0 - y));
    let settings = Settings { reach: 2.0, ..settings(&file, &pairs.join(";")) };
    let ran = run::<Texture>(&cloud, &settings).unwrap();
    for (i, at) in coordinates(&ran).iter().enumerate() {
        let own = DVec2::new((i % 41) as f64, 1.0 - (i / 41) as f64 / 40.0);
        let expected = DVec2::new(own.x / 40.0, own.y);
        // Chords between surfels are arcs again but for their lengths along the axis.
        assert!(at.distance(expected) < 0.01, "{i} is at {at}, expected {expected}");
    }
    let most = ran.floats("distortion").into_iter().fold(0.0, f32::max);
    assert!(most < 1.02, "{most}");
}

/// Of all maps of a half sphere that whose stretches are nearest to 1 in the mean square takes an angle t from the pole to
/// a radius r with (sin t (r' - 1))' = r / sin t - 1, and its rim, of length 2 pi, to a circle of radius 2 ln 2. So lengths
/// become 0.847 to 1.386 times as long, and no map has a smaller ratio of the two than pi / 2: Milnor, "A problem in
/// cartography", 1969.
#[test]
fn a_half_sphere_is_stretched_as_little_as_can_be() {
    let file = quarters("half.png");
    let points: Vec<Vec3> = sphere(8000).into_iter().filter(|point| point.z > 0.0).collect();
    let cloud = TestCloud::new(&points, &points, 0.03);
    // A picture larger than the half sphere.
    let pairs = "-0.2 0 0.979796 0.45 0.5; 0.2 0 0.979796 0.55 0.5";
    let settings = Settings { reach: 9.0, rounds: 200, ..settings(&file, pairs) };
    let ran = run::<Texture>(&cloud, &settings).unwrap();
    let at = coordinates(&ran);
    // The scale of the picture, from its map near the pole.
    let pole = (0..points.len()).max_by(|a, b| points[*a].z.total_cmp(&points[*b].z)).unwrap();
    let radius = |low: f32, high: f32| {
        let ring = (0..points.len()).filter(|i| (low..high).contains(&points[*i].z));
        let radii: Vec<f64> = ring.map(|i| at[i].distance(at[pole])).collect();
        radii.iter().sum::<f64>() / radii.len() as f64
    };
    // 0.2 of angle is 0.16935 of radius by the equation.
    let near = radius(0.2f32.cos() - 0.002, 0.2f32.cos() + 0.002) / 0.169_35;
    let rim = radius(0.0, 0.03) / near;
    // The ring is 0.016 within the rim, in the mean.
    let truth = 1.3706;
    assert!((rim / truth - 1.0).abs() < 0.01, "{rim}, expected {truth}");
    let distortion = ran.floats("distortion");
    // The derivative at the rim itself is that of one side alone.
    let inside = |i: &usize| points[*i].z > 0.1;
    let most = (0..points.len()).filter(inside).map(|i| distortion[i]).fold(0.0, f32::max);
    assert!((1.2..1.42).contains(&most), "{most}");
    assert!((distortion[pole] - 1.0 / 0.8466).abs() < 0.03, "{}", distortion[pole]);
}

#[test]
fn more_than_two_pairs_pull_the_picture_into_place() {
    let file = quarters("pulled.png");
    let cloud = sheet(|share| (share.extend(0.0), DVec3::Z));
    // Twice as wide as it is.
    let pairs = "0.1 0.3 0 0 1; 0.9 0.3 0 1 1; 0.9 0.7 0 1 0; 0.1 0.7 0 0 0";
    let ran = run::<Texture>(&cloud, &settings(&file, pairs)).unwrap();
    let words = ran.message.split_once("off by at most ").unwrap().1;
    let off: f64 = words.split(' ').next().unwrap().parse().unwrap();
    assert!(off < 0.005, "{}", ran.message);
    let at = coordinates(&ran)[20 * 41 + 20];
    assert!(at.distance(DVec2::splat(0.5)) < 0.02, "{at}");
}

#[test]
fn what_cannot_be_done_is_said() {
    let file = quarters("said.png");
    let cloud = sheet(|share| (share.extend(0.0), DVec3::Z));
    let said = |pairs: &str| refusal::<Texture>(&cloud, &settings(&file, pairs));
    assert!(said("").contains("two pairs or more"));
    assert!(said("0 0 0 0 1").contains("found 1"));
    assert!(said("0 0 0 0; 1 1 0 1 1").contains("`0 0 0 0`"));
    assert!(said("0 0 0 0 1; 1 1 nan 1 1").contains("nan"));
    assert!(said("0 0 0 0 1; 1 0 9 1 1").contains("place 2"));
    assert!(said("0 0 0 0 1; 0 0 0 1 1").contains("differ"));
    let mirrored = "0.2 0.2 0 0 0; 0.8 0.2 0 1 0; 0.8 0.8 0 1 1; 0.2 0.8 0 0 1";
    assert!(said(mirrored).contains("mirrored"));
    // Row by row.
    let mirrored_rows = "0.2 0.2 0 0 0; 0.8 0.2 0 1 0; 0.2 0.8 0 0 1; 0.8 0.8 0 1 1";
    assert!(said(mirrored_rows).contains("mirrored"));
    let apart = Settings { reach: 0.1, ..settings(&file, "0.2 0.2 0 0 1; 0.8 0.2 0 1 1") };
    assert!(refusal::<Texture>(&cloud, &apart).contains("gap"));
    let none = TemporaryFile::new("none.png", b"no picture");
    assert!(refusal::<Texture>(&cloud, &settings(&none, mirrored)).contains("PNG or JPEG"));
    assert!(refusal::<Texture>(&cloud, &Settings::default()).contains("`image`"));
    for cloud in odd_clouds() {
        drop(run::<Texture>(&cloud, &settings(&file, "0 0 0 0 1; 1 0 0 1 1")));
    }
}

#[test]
fn it_stops_where_it_is_told_to() {
    let file = quarters("stops.png");
    let cloud = sheet(|share| (share.extend(0.0), DVec3::Z));
    let settings = Settings { rounds: 3, ..settings(&file, "0.2 0.2 0 0 1; 0.8 0.2 0 1 1") };
    stops_everywhere::<Texture>(&cloud, &settings);
}

/// Corners of a picture around a body with a wall: the inner side is nearer to their middle than the outer one.
#[test]
fn a_label_around_a_thin_wall_is_no_mirror() {
    let file = quarters("label.png");
    let place = |radius: f64, angle: f64, y: f64| {
        let (sin, cos) = angle.sin_cos();
        DVec3::new(radius * sin, y, radius * cos)
    };
    let (mut places, mut normals) = (Vec::new(), Vec::new());
    for (radius, side) in [(1.0, 1.0), (0.95, -1.0)] {
        for i in 0..160 * 25 {
            let angle = f64::from(i % 160) * std::f64::consts::TAU / 160.0;
            places.push(place(radius, angle, f64::from(i / 160) * 0.04).as_vec3());
            normals.push((side * place(1.0, angle, 0.0)).as_vec3());
        }
    }
    let cloud = TestCloud::new(&places, &normals, 0.03);
    // Two fifths of the way around, row by row from the top: of more than half the back would be nearer.
    let corner = |angle: f64, y: f64, u: u32, v: u32| {
        let DVec3 { x, y, z } = place(1.0, angle, y);
        format!("{x:.9} {y} {z:.9} {u} {v}")
    };
    let a = 0.4 * std::f64::consts::PI;
    let right =
        [corner(-a, 0.9, 0, 0), corner(a, 0.9, 1, 0), corner(-a, 0.1, 0, 1), corner(a, 0.1, 1, 1)];
    let wrong =
        [corner(a, 0.9, 0, 0), corner(-a, 0.9, 1, 0), corner(a, 0.1, 0, 1), corner(-a, 0.1, 1, 1)];
    let ran = run::<Texture>(&cloud, &settings(&file, &right.join(";"))).unwrap();
    // The front, and nothing of the inner side.
    let distortion = ran.floats("distortion");
    assert!(distortion[..4000].iter().filter(|value| **value > 0.0).count() > 1000);
    assert!(distortion[4000..].iter().all(|value| *value == 0.0));
    assert!(refusal::<Texture>(&cloud, &settings(&file, &wrong.join(";"))).contains("mirrored"));
}

/// Black and white by columns of a pixel become the mean of their light, whatever the sides; opacity mixes, and so do transparent
/// pixels; floats stay floats.
#[test]
fn what_is_finer_than_a_surfel_is_averaged_in_linear_light() {
    for [width, height] in [[300, 200], [257, 129]] {
        for (alpha, opacity) in [(255, 1.0), (255, 0.25), (51, 1.0)] {
            let color = |x: u32, _| {
                let grey = 255 * (x % 2) as u8;
                image::Rgba([grey, grey, grey, alpha])
            };
            let picture = image::RgbaImage::from_fn(width, height, color);
            let mut bytes = std::io::Cursor::new(Vec::new());
            picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            let file = TemporaryFile::new(&format!("{width}-{alpha}.png"), bytes.get_ref());
            let mut cloud = sheet(|share| (share.extend(0.0), DVec3::Z));
            cloud.radii.fill(0.1);
            cloud.others = vec![("color", 3, vec![0.1; 3 * 41 * 41])];
            let settings = Settings { opacity, ..settings(&file, "0 0.2 0 0 1; 1 0.2 0 1 1") };
            let ran = run::<Texture>(&cloud, &settings).unwrap();
            let cover = opacity * f32::from(alpha) / 255.0;
            let expected = 0.1 + cover * (0.5 - 0.1);
            // In the middle of the picture.
            let found = ran.floats("color")[3 * (15 * 41 + 20)];
            assert!(
                (found - expected).abs() < 0.02,
                "{width}, {alpha}: {found}, expected {expected}"
            );
        }
    }
}
