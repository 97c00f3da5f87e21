//! Pictures along strokes.

use super::shapes::TemporaryFile;
use super::{TestCloud, refusal, run_along};
use crate::stamp::{Emboss, EmbossSettings, ImageBrush, ImageSettings};
use image::{ImageFormat, Rgb, RgbImage};
use std::io::Cursor;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, WEIGHT};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::FilePath;
use surfelshop_api::{Dabs, Falloff, Reach, Stroke, StrokeSample};

/// Half a side of the plane, and between its surfels, scene units.
const SIDE: i32 = 60;
const APART: f32 = 0.05;

/// A plane with normals along y and weights of a stroke along x.
fn plane(stroke: &Stroke, origin: DVec3) -> TestCloud {
    let place = |i: i32, k: i32| Vec3::new(i as f32, 0.0, k as f32) * APART;
    let places: Vec<Vec3> =
        (-SIDE..=SIDE).flat_map(|i| (-SIDE..=SIDE).map(move |k| place(i, k))).collect();
    let last = stroke.samples.last().unwrap().place.x - origin.x;
    let weight = |place: &Vec3| {
        let nearest = DVec3::X * f64::from(place.x).clamp(0.0, last.max(0.0));
        let share = place.as_dvec3().distance(nearest) / stroke.radius;
        stroke.dabs.falloff.weight(share) as f32
    };
    let weights = places.iter().map(weight).collect();
    let cloud = TestCloud::new(&places, &vec![Vec3::Y; places.len()], 0.6 * APART);
    let colors = vec![255; 3 * places.len()];
    TestCloud { origin, colors, others: vec![(WEIGHT, 1, weights)], ..cloud }
}

fn stroke(origin: DVec3, ends: &[f64], falloff: Falloff) -> Stroke {
    let sample = |x: &f64| StrokeSample {
        place: origin + DVec3::X * *x,
        normal: Vec3::Y,
        time: 0.0,
        pressure: 1.0,
    };
    let dabs = Dabs { falloff, reach: Reach::Volume, ..Dabs::USUAL };
    Stroke { radius: 1.0, dabs, samples: ends.iter().map(sample).collect() }
}

/// A picture by a function of shares from the left and the top.
fn picture(
    name: &str,
    [width, height]: [u32; 2],
    of: impl Fn(f64, f64) -> [u8; 3],
) -> TemporaryFile {
    let share = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let pixel = |x, y| Rgb(of(share(x, width), share(y, height)));
    let mut bytes = Cursor::new(Vec::new());
    RgbImage::from_fn(width, height, pixel).write_to(&mut bytes, ImageFormat::Png).unwrap();
    TemporaryFile::new(name, bytes.get_ref())
}

fn image(file: &TemporaryFile) -> FilePath {
    file.path()
}

/// The picture is as wide as the stroke, its right side to the right of the way, its top ahead, again and again.
#[test]
fn a_picture_lies_along_the_stroke_and_repeats() {
    // Left red, right blue above, green below: twice as wide as high.
    let of = |x: f64, y: f64| match (x < 0.5, y < 0.5) {
        (true, true) => [255, 0, 0],
        (false, true) => [0, 0, 255],
        (_, false) => [0, 255, 0],
    };
    let file = picture("quarters-along.png", [64, 32], of);
    for origin in [DVec3::ZERO, DVec3::splat(1e6)] {
        let stroke = stroke(origin, &[0.0, 1.0, 2.0], Falloff::Constant);
        let cloud = plane(&stroke, origin);
        let settings = ImageSettings { image: image(&file), ..ImageSettings::default() };
        let ran = run_along::<ImageBrush>(&cloud, &settings, Some(&stroke)).unwrap();
        let colors = ran.bytes(COLOR);
        let at = |x: f32, z: f32| {
            let k = |at: f32| (at / APART).round() as i32 + SIDE;
            let i = (k(x) * (2 * SIDE + 1) + k(z)) as usize;
            [colors[3 * i], colors[3 * i + 1], colors[3 * i + 2]]
        };
        for turn in [0.0, 1.0] {
            assert_eq!(at(turn + 0.25, 0.0), [0, 255, 0], "the lower half");
            // Facing along x with y above, z is to the right.
            assert_eq!(at(turn + 0.75, 0.5), [0, 0, 255]);
            assert_eq!(at(turn + 0.75, -0.5), [255, 0, 0]);
        }
        assert_eq!(at(0.25, 1.1), [255; 3], "beside the stroke");
        assert_eq!(at(-0.75, 0.0), [0, 255, 0], "the band goes on around its ends");
    }
}

/// A click lays all of it, upright: on the ground its top is away from the z axis.
#[test]
fn a_click_lays_the_picture_once() {
    let of = |x: f64, y: f64| [if x < 0.5 { 0 } else { 200 }, if y < 0.5 { 0 } else { 200 }, 0];
    let file = picture("once.png", [32, 32], of);
    let stroke = stroke(DVec3::ZERO, &[0.0], Falloff::Constant);
    let cloud = plane(&stroke, DVec3::ZERO);
    let settings = ImageSettings { image: image(&file), ..ImageSettings::default() };
    let ran = run_along::<ImageBrush>(&cloud, &settings, Some(&stroke)).unwrap();
    let colors = ran.bytes(COLOR);
    for (place, color) in cloud.places().iter().zip(colors.chunks(3)) {
        if place.length() > 1.001 {
            assert_eq!(color, [255; 3], "{place}");
        } else if place.length() < 0.999 && place.x.abs() > 0.1 && place.z.abs() > 0.1 {
            let expected =
                [if place.x < 0.0 { 0 } else { 200 }, if place.z < 0.0 { 0 } else { 200 }];
            assert_eq!(color[..2], expected, "{place}");
        }
    }
    // Turned clockwise by a quarter what was on the left is above.
    let settings = ImageSettings { turn: 90.0, ..settings };
    let ran = run_along::<ImageBrush>(&cloud, &settings, Some(&stroke)).unwrap();
    let colors = ran.bytes(COLOR);
    let at = |x: f32, z: f32| {
        let near = |place: &Vec3| place.distance(Vec3::new(x, 0.0, z)) < 0.01;
        let i = cloud.places().iter().position(near).unwrap();
        [colors[3 * i], colors[3 * i + 1]]
    };
    assert_eq!([at(-0.5, -0.5), at(0.5, -0.5)], [[0, 200], [0, 0]]);
    assert_eq!([at(-0.5, 0.5), at(0.5, 0.5)], [[200, 200], [200, 0]]);
}

/// Normals are those of the heights that were made, and white is as high as asked.
#[test]
fn embossed_normals_are_those_of_the_heights() {
    let wave = |t: f64| 0.5 - 0.4 * (std::f64::consts::TAU * t).cos();
    let of = |x: f64, y: f64| [(255.0 * wave(x) * wave(y)).round() as u8; 3];
    let file = picture("waves.png", [256, 256], of);
    let stroke = stroke(DVec3::ZERO, &[0.0, 2.0], Falloff::Smooth);
    let cloud = plane(&stroke, DVec3::ZERO);
    let settings = EmbossSettings { image: image(&file), height: 0.2, ..EmbossSettings::default() };
    let ran = run_along::<Emboss>(&cloud, &settings, Some(&stroke)).unwrap();
    let (places, normals) = (ran.vectors(POSITION), ran.vectors(NORMAL));
    let row = (2 * SIDE + 1) as usize;
    let mut worst = 0.0f32;
    for (i, place) in cloud.places().iter().enumerate() {
        // Between the ends, and off the crease where the weight has its second derivative's jump.
        if !(0.2..1.8).contains(&place.x) || place.z.abs() > 0.85 {
            continue;
        }
        let [across, along] = [1, row].map(|step| places[i + step] - places[i - step]);
        let truth = across.cross(along).normalize_or_zero();
        worst = worst.max(truth.angle_between(normals[i]).to_degrees());
    }
    // Codes of 8 bits over a spacing, and a slope that is measured over a width: the steepest is 40 degrees.
    assert!(worst < 3.0, "{worst} degrees");
    let high = places.iter().map(|place| place.y).fold(0.0, f32::max);
    assert!((0.1..=0.2).contains(&high), "{high}");
    let settings = EmbossSettings { height: -0.2, ..settings };
    let ran = run_along::<Emboss>(&cloud, &settings, Some(&stroke)).unwrap();
    let low = ran.vectors(POSITION).iter().map(|place| place.y).fold(0.0, f32::min);
    assert_eq!(low, -high);
}

#[test]
fn without_a_picture_or_a_stroke_they_are_refused() {
    let stroke = stroke(DVec3::ZERO, &[0.0], Falloff::Constant);
    let cloud = plane(&stroke, DVec3::ZERO);
    let line = refusal::<ImageBrush>(&cloud, &ImageSettings::default());
    assert_eq!(line, "expected a picture in `image`, found no file");
    let file = picture("small.png", [2, 2], |_, _| [9; 3]);
    let settings = EmbossSettings { image: image(&file), ..EmbossSettings::default() };
    let line = refusal::<Emboss>(&cloud, &settings);
    assert!(line.starts_with("expected a stroke, found none"), "{line}");
    let bare = TestCloud { normals: Vec::new(), ..cloud };
    let line = run_along::<Emboss>(&bare, &settings, Some(&stroke)).map(|_| ()).unwrap_err();
    assert!(line.to_string().contains("expected normals"), "{line}");
}
