//! Parts of clouds along strokes, and what is made of them put back.

use crate::selection::{Selection, SurfelRuns};
use crate::{
    Buffer, Cloud, CloudEdit, CloudPart, Column, How, ReadOptions, StagedEdits, ToolRun,
    WriteOptions, changed_rows,
};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::UNIX_EPOCH;
use surfelshop_api::columns::{Element, WEIGHT};
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_api::{Dabs, Falloff, Reach, Stroke, StrokeSample};

/// Surfels along the x axis, one a unit, every second of which faces downwards.
fn line(n: usize, scale: f32, origin: DVec3) -> Cloud {
    let position = (0..n).flat_map(|i| [i as f32 * scale, 0.0, 0.0]).collect();
    let normal = (0..n).flat_map(|i| [0.0, if i % 2 == 0 { 1.0 } else { -1.0 }, 0.0]).collect();
    let ao = (0..n).map(|i| i as f32 / 100.0).collect();
    let column =
        |name: &str, components, values| Column::new(name, components, Buffer::F32(values));
    let columns =
        vec![column("position", 3, position), column("normal", 3, normal), column("ao", 1, ao)];
    Cloud::new(origin, columns).unwrap()
}

fn sample(x: f64, scale: f64, origin: DVec3) -> StrokeSample {
    let place = origin + DVec3::X * x * scale;
    StrokeSample { place, normal: Vec3::Y, time: 0.0, pressure: 1.0 }
}

fn stroke(ends: [f64; 2], scale: f64, origin: DVec3, reach: Reach) -> Stroke {
    let dabs = Dabs { spacing: 0.25, falloff: Falloff::Linear, reach };
    let samples = ends.map(|x| sample(x, scale, origin)).to_vec();
    Stroke { radius: 2.0 * scale, dabs, samples }
}

fn run() -> ToolRun {
    ToolRun::new("org.example/brush".to_owned(), "1".to_owned(), &Default::default(), UNIX_EPOCH)
}

fn bytes<T: bytemuck::NoUninit>(values: &[T]) -> Vec<u8> {
    bytemuck::cast_slice(values).to_vec()
}

fn header(name: &str) -> ColumnHeader {
    ColumnHeader { name: name.to_owned(), components: 1, element: Element::F32 }
}

#[test]
fn strokes_concern_the_same_surfels_at_any_scale_and_place() {
    for (scale, origin) in
        [(1.0f32, DVec3::ZERO), (1e-6, DVec3::ZERO), (1.0, DVec3::new(1e6, 0.0, -1e6))]
    {
        let cloud = line(30, scale, origin);
        let along = |reach| {
            let stroke = stroke([10.0, 14.0], f64::from(scale), origin, reach);
            CloudPart::along(&cloud, &stroke, None).unwrap()
        };
        let all = along(Reach::Volume);
        assert_eq!(&*all.rows, [9, 10, 11, 12, 13, 14, 15]);
        let weights = all.cloud.floats(WEIGHT, 1);
        for (found, expected) in weights.iter().zip([0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5]) {
            assert!((found - expected).abs() < 1e-5, "{weights:?}");
        }
        assert_eq!(&*along(Reach::Facing).rows, [10, 12, 14]);
        let some = Selection::of(30, |i| i > 12).unwrap();
        let stroke = stroke([10.0, 14.0], f64::from(scale), origin, Reach::Volume);
        let within = CloudPart::along(&cloud, &stroke, Some(&some)).unwrap();
        assert_eq!(&*within.rows, [13, 14, 15]);
    }
}

#[test]
fn strokes_that_cannot_be_followed_are_refused_in_a_line() {
    let cloud = line(3, 1.0, DVec3::ZERO);
    let good = stroke([0.0, 1.0], 1.0, DVec3::ZERO, Reach::Volume);
    let line = |change: &dyn Fn(&mut Stroke)| {
        let mut stroke = good.clone();
        change(&mut stroke);
        CloudPart::along(&cloud, &stroke, None).unwrap_err().to_string()
    };
    assert_eq!(line(&|s| s.radius = 0.0), "stroke: expected a radius above 0, found 0");
    assert!(line(&|s| s.radius = f64::NAN).contains("found NaN"));
    assert!(line(&|s| s.dabs.spacing = 0.0).contains("a spacing of 0.01 to 10 radii"));
    assert!(line(&|s| s.samples.clear()).contains("1 to 1048576 samples, found 0"));
    assert!(line(&|s| s.samples[1].pressure = 1.5).contains("found sample 1 with other numbers"));
    assert!(line(&|s| s.samples[1].place.x = 1e9).contains("at most 1048576 dabs"));
}

#[test]
fn what_is_made_of_a_part_is_put_back_where_it_was() {
    let cloud = line(30, 1.0, DVec3::ZERO);
    let part =
        CloudPart::along(&cloud, &stroke([10.0, 12.0], 1.0, DVec3::ZERO, Reach::Volume), None);
    let part = part.unwrap();
    assert_eq!(&*part.rows, [9, 10, 11, 12, 13]);
    let mut staged = StagedEdits::new(part.cloud.clone());
    // Of some surfels, in any order; what is as before is no change.
    let values = [bytes(&[4u32, 0, 1]), bytes(&[1.0f32, 0.5, 0.10])];
    staged.stage(&EditHeader::Values(vec![header("ao")]), &[&values[0], &values[1]]).unwrap();
    let edited = part.put_back(&staged.commit(run()).unwrap(), run()).unwrap();
    let ao = edited.cloud.floats("ao", 1);
    assert_eq!([ao[9], ao[10], ao[13], ao[14]], [0.5, 0.10, 1.0, 0.14]);
    let generation = |cloud: &Cloud| cloud.column("ao").unwrap().generation();
    assert_eq!(changed_rows(generation(&cloud), generation(&edited.cloud)), Some(vec![9, 13]));
    assert_eq!(
        cloud.column("position").unwrap().generation(),
        edited.cloud.column("position").unwrap().generation()
    );
    assert!(edited.cloud.column(WEIGHT).is_none());
    let [note] = edited.cloud.history() else { panic!("one note") };
    assert_eq!((note.how, note.n_surfels, note.n_before), (How::Stroked, 5, 30));

    // Removals and a new column.
    let mut staged = StagedEdits::new(part.cloud.clone());
    staged.stage(&EditHeader::Columns(vec![header("wet")]), &[&bytes(&[1.0f32; 5])]).unwrap();
    staged.stage(&EditHeader::Keep, &[&[1, 0, 1, 1, 1]]).unwrap();
    let edited = part.put_back(&staged.commit(run()).unwrap(), run()).unwrap();
    assert_eq!(edited.cloud.len(), 29);
    let wet = edited.cloud.floats("wet", 1);
    assert_eq!((wet.iter().sum::<f32>(), wet[9], wet[10], wet[8]), (4.0, 1.0, 1.0, 0.0));

    // New surfels, behind all others.
    let mut staged = StagedEdits::new(part.cloud.clone());
    let more = [bytes(&[0u32, 4]), bytes(&[0.25f32, 0.75])];
    staged.stage(&EditHeader::Add(vec![header("ao")]), &[&more[0], &more[1]]).unwrap();
    let edited = part.put_back(&staged.commit(run()).unwrap(), run()).unwrap();
    assert_eq!((edited.cloud.len(), edited.n_added), (32, 2));
    assert_eq!(edited.cloud.floats("ao", 1)[30..], [0.25, 0.75]);
    assert_eq!([30, 31].map(|i| edited.cloud.positions()[i].x), [9.0, 13.0]);
}

#[test]
fn answers_for_surfels_that_were_not_given_are_refused_by_their_number() {
    let cloud = line(30, 1.0, DVec3::ZERO);
    let part =
        CloudPart::along(&cloud, &stroke([10.0, 12.0], 1.0, DVec3::ZERO, Reach::Volume), None);
    let part = part.unwrap();
    let refusal = |rows: &[u32], values: &[f32], name: &str| {
        let mut staged = StagedEdits::new(part.cloud.clone());
        let header = EditHeader::Values(vec![header(name)]);
        let refused = staged.stage(&header, &[&bytes(rows), &bytes(values)]).unwrap_err();
        assert!(staged.commit(run()).is_none(), "nothing of it is staged");
        refused.to_string()
    };
    assert_eq!(
        refusal(&[1, 5], &[0.0; 2], "ao"),
        "edit: expected answers for the 5 surfels that it was given, found one for surfel 5"
    );
    assert_eq!(
        refusal(&[1, 1], &[0.0; 2], "ao"),
        "edit: expected one answer for each surfel, found two for surfel 1"
    );
    assert_eq!(refusal(&[1], &[0.0; 2], "ao"), "column `ao`: expected 1 values, found 2");
    assert_eq!(
        refusal(&[1], &[0.0], "oa"),
        "edit: expected values of columns that are there, found some of `oa`"
    );
    let mut staged = StagedEdits::new(part.cloud.clone());
    staged
        .stage(
            &EditHeader::NewCloud {
                origin: DVec3::ZERO,
                columns: vec![ColumnHeader { components: 3, ..header("position") }],
            },
            &[&bytes(&[0.0f32; 3])],
        )
        .unwrap();
    let line = part.put_back(&staged.commit(run()).unwrap(), run()).unwrap_err().to_string();
    assert!(line.contains("found a cloud of its own"), "{line}");
}

#[test]
fn tools_work_on_what_is_selected_alone() {
    let cloud = line(10, 1.0, DVec3::ZERO);
    let part = CloudPart::selected(&cloud, &Selection::of(10, |i| i < 3).unwrap()).unwrap();
    assert_eq!((part.cloud.len(), part.cloud.column(WEIGHT).is_none()), (3, true));
    let mut staged = StagedEdits::new(part.cloud.clone());
    staged.stage(&EditHeader::Columns(vec![header("ao")]), &[&bytes(&[1.0f32; 3])]).unwrap();
    let edited = part.put_back(&staged.commit(run()).unwrap(), run()).unwrap();
    assert_eq!(edited.cloud.floats("ao", 1)[..4], [1.0, 1.0, 1.0, 0.03]);
    assert!(edited.cloud.history().is_empty() && edited.whole.is_none());
    assert!(CloudPart::selected(&cloud, &Selection::none(10).unwrap()).is_err());
}

/// Only where surfels near the stroke were left out is it said which it concerned, once.
#[test]
fn what_a_stroke_was_led_over_is_said_where_it_left_some_out() {
    let cloud = line(30, 1.0, DVec3::ZERO);
    let stroke = stroke([10.0, 14.0], 1.0, DVec3::ZERO, Reach::Volume);
    let part = |test: &(dyn Fn(usize) -> bool + Sync)| {
        let selection = Selection::of(30, test).unwrap();
        CloudPart::along(&cloud, &stroke, Some(&selection)).unwrap()
    };
    assert_eq!(CloudPart::along(&cloud, &stroke, None).unwrap().restriction(), None);
    assert_eq!(part(&|i| i < 20).restriction(), None, "those beyond are far away");
    let restricted = part(&|i| i < 12);
    assert_eq!(restricted.restriction(), Some(SurfelRuns::of_rows(30, 9..12)));
}

/// A history that is too long for a header is shortened from its beginning, with a line, so that the file can be read.
#[test]
fn long_histories_are_shortened_where_a_file_cannot_hold_them() {
    let note = |i: usize| {
        let text = Value::Text(format!("{i}").repeat(5 << 20));
        let values = Values::from([("stroke".to_owned(), text)]);
        let made =
            ToolRun::new("org.example/brush".to_owned(), "1".to_owned(), &values, UNIX_EPOCH);
        CloudEdit { how: How::Stroked, n_surfels: 1, n_before: 3, made: Arc::new(made) }
    };
    let cloud = line(3, 1.0, DVec3::ZERO).with_history((0..4).map(note).collect());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.ply");
    let written = crate::write(&path, &cloud, &WriteOptions::default()).unwrap();
    assert!(written.lost[0].starts_with("the history of the first 3 edits"), "{:?}", written.lost);
    let read = crate::read(&path, &ReadOptions::default()).unwrap().cloud;
    assert!(read.history() == &cloud.history()[3..]);
}
