use crate::{eraser, paint, sculpt, value};
use std::cell::RefCell;
use surfelshop_api::columns::WEIGHT;
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::ParamSet;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Dabs, Stroke, StrokeSample};

/// Takes what a tool stages.
#[derive(Default)]
struct Recorder(RefCell<Vec<(EditHeader, Vec<Vec<u8>>)>>);

impl JobHost for Recorder {
    fn progress(&self, _fraction: f64, _message: &str) {}
    fn cancelled(&self) -> bool {
        false
    }
    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let values = values.iter().map(|value| value.to_vec()).collect();
        self.0.borrow_mut().push((header.clone(), values));
        Ok(())
    }
}

/// Four surfels with weights 0.25 to 1, white in 8 bits, around the origin.
fn run<T: Tool>(
    mut tool: T,
    change: impl Fn(&mut T::Params),
) -> Result<(EditHeader, Vec<Vec<u8>>)> {
    let weights = [0.25, 0.5, 0.75, 1.0];
    let positions: Vec<f32> = (0..4).flat_map(|i| [(3 - i) as f32, 0.0, 0.0]).collect();
    let normals = [0.0, 1.0, 0.0].repeat(4);
    let (colors, class) = ([255u8; 12], [9u8; 4]);
    let column = |name, components, values| ColumnView { name, components, generation: 1, values };
    let columns = vec![
        column(columns::POSITION, 3, Values::F32(&positions)),
        column(columns::NORMAL, 3, Values::F32(&normals)),
        column(columns::COLOR, 3, Values::U8(&colors)),
        column("class", 1, Values::U8(&class)),
        column(WEIGHT, 1, Values::F32(&weights)),
    ];
    let cloud = CloudView { origin: DVec3::splat(1e6), len: 4, columns, ..CloudView::default() };
    let sample =
        StrokeSample { place: DVec3::splat(1e6), normal: Vec3::Y, time: 0.0, pressure: 1.0 };
    let stroke = Stroke { radius: 4.0, dabs: Dabs::USUAL, samples: vec![sample] };
    let recorder = Recorder::default();
    let mut params = T::Params::from_values(&params::Values::new());
    change(&mut params);
    tool.run(&cloud, &params, &Job::new(&recorder).with_stroke(&stroke))?;
    let mut staged = recorder.0.into_inner();
    assert_eq!(staged.len(), 1, "each stages one edit");
    Ok(staged.remove(0))
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

#[test]
fn paint_covers_by_weight_and_opacity() {
    let paint = |blend, opacity| {
        let (_, values) = run(paint::Brush, |params| {
            (params.color, params.blend, params.opacity) = ([0.0, 1.0, 0.5], blend, opacity);
        })
        .unwrap();
        values[0].clone()
    };
    let normal = paint(paint::Blend::Normal, 1.0);
    assert_eq!(normal[9..], [0, 255, 188], "the paint, encoded");
    assert!(normal[0] > normal[3] && normal[3] > normal[6] && normal[6] > 0);
    assert_eq!(paint(paint::Blend::Multiply, 1.0), normal, "over white");
    assert_eq!(paint(paint::Blend::Normal, 0.0), [255; 12]);
    assert_eq!(paint(paint::Blend::Screen, 1.0), [255; 12]);
    assert_eq!(paint(paint::Blend::Add, 1.0), [255; 12]);
}

#[test]
fn erasers_take_what_is_concerned_enough() {
    let (header, values) = run(eraser::Eraser, |params| params.least = 0.75).unwrap();
    assert_eq!((header, &values[0][..]), (EditHeader::Keep, &[1u8, 1, 0, 0][..]));
}

#[test]
fn values_keep_the_type_of_their_column() {
    let of = |column: &str, number: f64| {
        run(value::Value, |params| (params.column, params.value) = (column.to_owned(), number))
    };
    assert_eq!(of("class", 7.0).unwrap().1[0], [9, 7, 7, 7]);
    let line = of("class", 256.0).unwrap_err().to_string();
    assert_eq!(line, "column `class`: expected a number of type u8, found 256");
    assert!(of("color", 1.0).unwrap_err().to_string().contains("expected one component, found 3"));
    assert_eq!(floats(&of("ao", 0.0).unwrap().1[0]), [0.75, 0.5, 0.25, 0.0]);
    assert_eq!(of("material", 3.0).unwrap().1[0].len(), 16);
}

#[test]
fn sculpting_moves_along_normals_and_turns_them_off_the_slope() {
    let moved = |values: &[Vec<u8>]| {
        let heights: Vec<f32> = floats(&values[0]).chunks(3).map(|place| place[1]).collect();
        (heights, floats(&values[1]))
    };
    let (out, normals) = moved(&run(sculpt::Inflate, |params| params.height = 0.5).unwrap().1);
    assert_eq!(out, [0.5, 1.0, 1.5, 2.0], "half a radius of 4 by weight");
    assert!(normals[0] > 0.1 && (normals[9], normals[10]) == (0.0, 1.0), "{normals:?}");
    let (into, normals) = moved(&run(sculpt::Carve, |params| params.height = 0.5).unwrap().1);
    assert_eq!(into, [-0.5, -1.0, -1.5, -2.0]);
    assert!(normals[0] < -0.1);
}

/// A step that is twice as high as it is wide is as densely covered as the plane was.
#[test]
fn surfels_are_put_between_those_that_sculpting_pulls_apart() {
    let (apart, radius) = (0.05f32, 0.05f32);
    let places: Vec<Vec3> = (0..81)
        .flat_map(|i| (0..9).map(move |k| Vec3::new(i as f32 - 40.0, 0.0, k as f32 - 4.0) * apart))
        .collect();
    let stroke = Stroke {
        radius: 1.0,
        dabs: Dabs::USUAL,
        samples: vec![
            StrokeSample { place: DVec3::NEG_Z, normal: Vec3::Y, time: 0.0, pressure: 1.0 },
            StrokeSample { place: DVec3::Z, normal: Vec3::Y, time: 1.0, pressure: 1.0 },
        ],
    };
    let positions: Vec<f32> = places.iter().flat_map(Vec3::to_array).collect();
    let normals = [0.0, 1.0, 0.0].repeat(places.len());
    let weight = |place: &Vec3| stroke.dabs.falloff.weight(f64::from(place.x.abs())) as f32;
    let weights: Vec<f32> = places.iter().map(weight).collect();
    let radii = vec![radius; places.len()];
    let column = |name, components, values| ColumnView { name, components, generation: 1, values };
    let columns = vec![
        column(columns::POSITION, 3, Values::F32(&positions)),
        column(columns::NORMAL, 3, Values::F32(&normals)),
        column(columns::RADIUS, 1, Values::F32(&radii)),
        column(WEIGHT, 1, Values::F32(&weights)),
    ];
    let cloud = CloudView { len: places.len(), columns, ..CloudView::default() };
    let staged = |height: f32| {
        let recorder = Recorder::default();
        let job = Job::new(&recorder).with_stroke(&stroke);
        sculpt::Inflate.run(&cloud, &sculpt::Settings { height }, &job).unwrap();
        recorder.0.into_inner()
    };
    assert_eq!(staged(0.4).len(), 1, "a flat hill needs none");
    let staged = staged(2.0);
    let old = floats(&staged[0].1[0]);
    assert!(matches!(staged[1].0, EditHeader::Add(_)));
    let new = floats(&staged[1].1[1]);
    // Along the middle row: what is the nearest to each place of the true surface.
    let all: Vec<Vec3> = old.chunks(3).chain(new.chunks(3)).map(Vec3::from_slice).collect();
    let is_covered = |all: &[Vec3], x: f32| {
        let truth = Vec3::new(x, 2.0 * stroke.dabs.falloff.weight(f64::from(x.abs())) as f32, 0.0);
        all.iter().any(|place| place.distance(truth) < radius)
    };
    let n_covered =
        |all: &[Vec3]| (-1000..=1000).filter(|i| is_covered(all, *i as f32 * 1e-3)).count();
    let old: Vec<Vec3> = old.chunks(3).map(Vec3::from_slice).collect();
    assert_eq!(n_covered(&all), 2001);
    assert!(n_covered(&old) < 1990, "there were holes: {}", n_covered(&old));
}

/// A hand that is led fast leaves few samples: what it makes has no bulges at them.
#[test]
fn slopes_are_those_of_the_line_between_samples() {
    let stroke = |n: u32| {
        let place = |i: u32| DVec3::new(4.0 * f64::from(i) / f64::from(n - 1) - 2.0, 0.0, 0.0);
        let sample =
            |i| StrokeSample { place: place(i), normal: Vec3::Y, time: 0.0, pressure: 1.0 };
        Stroke { radius: 1.0, dabs: Dabs::USUAL, samples: (0..n).map(sample).collect() }
    };
    for place in [DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.3, 0.0, -0.4), DVec3::new(2.5, 0.0, 0.3)]
    {
        let [few, many] = [2, 1001].map(|n| slope(&stroke(n), place));
        assert!(few.length() > 0.5 && few.distance(many) < 0.01, "{place}: {few} {many}");
    }
    let still = Stroke { samples: vec![stroke(2).samples[0]; 3], ..stroke(2) };
    assert!(slope(&still, DVec3::new(-2.0, 0.0, 0.5)).z > 0.5);
}

fn slope(stroke: &Stroke, place: DVec3) -> Vec3 {
    sculpt::slope(stroke, sculpt::away(stroke, place), Vec3::Y)
}
