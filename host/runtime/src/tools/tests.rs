//! Tools that are led by hand: what they get, and what becomes of those that misbehave.

use super::*;
use crate::plugins::Timeouts;
use std::time::Duration;
use surfelshop_api::columns::Values as ColumnValues;
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::params::Values;
use surfelshop_api::prelude::*;
use surfelshop_api::{Dabs, StrokeSample, static_plugin};
use surfelshop_cloud::{Buffer, Column, How};

macro_rules! tool {
    ($name:ident, $id:literal, $cloud:ident, $job:ident => $body:expr) => {
        struct $name;
        impl Tool for $name {
            const INFO: UnitInfo = UnitInfo::new($id, $id, "Is tested.");
            const HANDLING: Handling = Handling::STROKE;
            type Params = ();
            fn new(_host: &HostInfo) -> surfelshop_api::Result<Self> {
                Ok(Self)
            }
            fn run(
                &mut self,
                $cloud: &CloudView<'_>,
                _: &(),
                $job: &Job<'_>,
            ) -> surfelshop_api::Result<()> {
                $body
            }
        }
    };
}

fn ao<'a>(values: &'a [f32]) -> Vec<NewColumn<'a>> {
    vec![NewColumn { name: "ao", components: 1, values: ColumnValues::F32(values) }]
}

tool!(Weighs, "weighs", cloud, job => {
    let n = job.stroke().map_or(0, |stroke| stroke.samples.len());
    job.progress(1.0, &format!("{n} samples, {} surfels", cloud.len));
    job.edit(&Edit::Columns(ao(&cloud.weights())))
});
tool!(Others, "others", cloud, job => {
    let surfels = [0, cloud.len as u32];
    // What is refused is refused, whether the tool looks or not.
    job.edit(&Edit::Values { surfels: &surfels, columns: ao(&[0.0; 2]) })
});
tool!(Panics, "panics", _cloud, job => {
    job.edit(&Edit::Columns(ao(&vec![0.0; _cloud.len])))?;
    panic!("at the worst moment")
});
tool!(Hangs, "hangs", _cloud, _job => loop {
    std::thread::sleep(Duration::from_secs(1));
});
tool!(Stops, "stops", _cloud, job => loop {
    job.check()?;
    std::thread::sleep(Duration::from_millis(1));
});

static_plugin! { id: "org.example.hands", tools: [Weighs, Others, Panics, Hangs, Stops] }

/// Ten surfels along the x axis.
fn cloud() -> Cloud {
    let position = (0..10).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
    let columns = vec![
        Column::new("position", 3, Buffer::F32(position)),
        Column::new("normal", 3, Buffer::F32([0.0, 1.0, 0.0].repeat(10))),
        Column::new("ao", 1, Buffer::F32(vec![0.25; 10])),
    ];
    Cloud::new(DVec3::ZERO, columns).unwrap()
}

fn stroke() -> Stroke {
    let sample = |x: f64| StrokeSample {
        place: DVec3::new(x, 0.0, 0.0),
        normal: Vec3::Y,
        time: 0.0,
        pressure: 1.0,
    };
    Stroke { radius: 1.5, dabs: Dabs::USUAL, samples: vec![sample(3.0), sample(5.0)] }
}

/// Leads a tool over the cloud.
fn lead(unit: u32) -> Ended {
    let unit =
        LoadedUnit::from_static::<SurfelshopPackage>(&SURFELSHOP_STATIC_MANIFEST, unit).unwrap();
    assert_eq!(unit.unit.handling, "stroke");
    let patience =
        Timeouts { frame: Duration::from_millis(200), ..Timeouts::of(Duration::from_millis(600)) };
    let options = ToolOptions { patience, ..ToolOptions::default() };
    let part = CloudPart::along(&cloud(), &stroke(), None).unwrap();
    let mut running =
        Running::start_on(&unit, &Values::new(), part, Some(stroke()), &options).unwrap();
    loop {
        if let Some(ended) = running.wait(Duration::from_millis(10)) {
            return ended;
        }
    }
}

#[test]
fn a_tool_gets_the_surfels_of_a_stroke_alone() {
    let Ended::Done(done) = lead(0) else { panic!("it ended otherwise") };
    assert_eq!(done.said, "2 samples, 5 surfels");
    let edited = done.edited.unwrap();
    let values = edited.cloud.floats("ao", 1);
    assert_eq!([values[1], values[3], values[7]], [0.25, 1.0, 0.25]);
    assert!(values[4] > 0.95, "{values:?}");
    assert!(values[2] > 0.0 && values[2] < 0.5, "{values:?}");
    let [note] = edited.cloud.history() else { panic!("one note") };
    assert_eq!((note.how, note.n_surfels), (How::Stroked, 5));
    let Some(Value::Text(text)) = note.made.values.get(STROKE_NOTE) else { panic!("its stroke") };
    assert_eq!(serde_json::from_str::<Stroke>(text).unwrap(), stroke());
}

/// Invariant: a tool that is led by hand changes no surfel that it was not given
#[test]
fn answers_for_others_panics_and_hangs_end_the_stroke_and_nothing_else() {
    let line = |unit: u32| match lead(unit) {
        Ended::Failed(fault) => fault.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(
        line(1).contains(
            "expected answers for the 5 surfels that it was given, found one for surfel 5"
        )
    );
    assert!(line(2).contains("at the worst moment"), "{}", line(2));
    assert_eq!(line(4), "did not answer within 0.2 s", "it stopped when it was asked to");
    assert!(matches!(lead(3), Ended::LeftBehind(_)));
}

#[test]
fn without_a_stroke_it_is_led_over_everything() {
    let unit =
        LoadedUnit::from_static::<SurfelshopPackage>(&SURFELSHOP_STATIC_MANIFEST, 0).unwrap();
    let mut running =
        Running::start(&unit, &Values::new(), &cloud(), &ToolOptions::default()).unwrap();
    let Some(Ended::Done(done)) = running.wait(Duration::from_secs(20)) else {
        panic!("it ended otherwise")
    };
    assert_eq!(done.edited.unwrap().cloud.floats("ao", 1), [1.0; 10]);
}
