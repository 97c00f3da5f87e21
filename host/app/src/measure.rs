//! `surfelshop measure`: the measures of a scene, and those that are typed, as numbers.

use crate::arguments::MeasureArguments;
use anyhow::{Context as _, bail, ensure};
use serde_json::json;
use std::path::Path;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::{
    Measure, MeasureKind, MeasuredRow, Profile, Quantity, SceneCloud, SceneFile, Units,
};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::UpAxis;
use surfelshop_session::output::measures::measured;
use surfelshop_session::output::{files, terminal};

/// Runs the command.
pub(crate) fn run(arguments: &MeasureArguments) -> anyhow::Result<()> {
    let inputs = Inputs::open(&arguments.files)?;
    let outputs = [arguments.out.as_deref(), arguments.points.as_deref()];
    files::check_outputs(&outputs.into_iter().flatten().collect::<Vec<_>>())?;
    let opened = inputs.opened.as_ref().map(|opened| &opened.scene);
    let mut all: Vec<Measure> = opened
        .into_iter()
        .flat_map(|scene| &scene.measures)
        .map(|measure| measure.known.clone())
        .collect();
    let n_before = all.len();
    all.extend(arguments.measures.all());
    ensure!(
        !all.is_empty(),
        "expected measures, found a command without any; type one, such as --distance 0,0,0:1,0,0"
    );
    let formats = SessionFormats::new(&arguments.plugins);
    let displayed = DisplayedClouds::read(
        &inputs.sources,
        &opened.map(SceneFile::display).unwrap_or_default(),
        &formats,
    )?;
    let clouds = &displayed.clouds;
    let up = up_of(arguments, opened, clouds.loaded.iter().map(|loaded| &loaded.cloud));
    let units = Units { metres: clouds.metres_per_unit() };
    let rows = all.iter().enumerate().map(|(i, measure)| row(i, measure, up, clouds));
    let rows: Vec<MeasuredRow> = rows.collect::<anyhow::Result<_>>()?;
    if let Some(path) = &arguments.points {
        write_points(path, &all, up, clouds)?;
    }
    if let Some(out) = &arguments.out {
        scene_with(arguments, opened, &all[n_before..], up).write(out)?;
    }
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "measure",
            "version": env!("CARGO_PKG_VERSION"),
            "metres_per_unit": units.metres,
            "up": up.name(),
            "measures": rows.iter().map(|row| object(row, units)).collect::<Vec<_>>(),
        }));
    }
    if arguments.csv {
        return terminal::line(MeasuredRow::csv(&rows, units).trim_end());
    }
    rows.iter().try_for_each(|row| terminal::line(line(row, up, units)))
}

/// The axis that points upwards: as it was typed, else as the scene says, else as the files do.
fn up_of<'a>(
    arguments: &MeasureArguments,
    opened: Option<&SceneFile>,
    clouds: impl Iterator<Item = &'a Cloud>,
) -> Axis {
    match (arguments.up, opened.and_then(|scene| scene.up)) {
        (UpAxis::Auto, Some(up)) => up,
        (typed, _) => typed.or_of(clouds.map(Cloud::source)).into(),
    }
}

fn row(i: usize, measure: &Measure, up: Axis, clouds: &Clouds) -> anyhow::Result<MeasuredRow> {
    let (title, up) = (measure.title(i), up.direction());
    let mut quantities = measure.quantities(up);
    let clouds = measured(clouds, measure, up)?;
    let clouds: Vec<&Cloud> = clouds.iter().collect();
    let more = measure.surfel_quantities(up, &clouds).with_context(|| title.clone())?;
    quantities.extend(more);
    Ok(MeasuredRow { title, measure: measure.clone(), quantities })
}

/// The scene with further measures; where none was opened, one of the files that were named.
fn scene_with(
    arguments: &MeasureArguments,
    opened: Option<&SceneFile>,
    more: &[Measure],
    up: Axis,
) -> SceneFile {
    let mut scene = opened.cloned().unwrap_or_else(|| SceneFile {
        clouds: arguments.files.iter().map(|file| SceneCloud::new(file).into()).collect(),
        up: (up != Axis::default()).then_some(up),
        ..SceneFile::default()
    });
    scene.measures.extend(more.iter().cloned().map(Into::into));
    scene
}

/// Writes the surfels of the profile.
fn write_points(path: &Path, all: &[Measure], up: Axis, clouds: &Clouds) -> anyhow::Result<()> {
    let mut profiles = all.iter().filter(|measure| measure.kind == MeasureKind::Profile);
    let (Some(measure), None) = (profiles.next(), profiles.next()) else {
        bail!("--points: expected one profile among the measures, found none or several");
    };
    let clouds = measured(clouds, measure, up.direction())?;
    let clouds: Vec<&Cloud> = clouds.iter().collect();
    let profile = Profile::of(measure, up.direction(), &clouds)?;
    files::write_whole(path, profile.csv().as_bytes())
}

/// A line for people.
fn line(row: &MeasuredRow, up: Axis, units: Units) -> String {
    let MeasuredRow { title, measure, quantities } = row;
    if measure.kind == MeasureKind::Note {
        let text = units.label(measure, up.direction(), &[]);
        let name = if *title == text { "note" } else { title.as_str() };
        return format!("{name}: {text}");
    }
    let number = |quantity: &Quantity| format!("{} {}", quantity.name, units.text(quantity));
    let numbers: Vec<String> = quantities.iter().map(number).collect();
    format!("{title}: {}", numbers.join(", "))
}

fn object(row: &MeasuredRow, units: Units) -> serde_json::Value {
    let MeasuredRow { title, measure, quantities } = row;
    let number = |quantity: &Quantity| {
        json!({
            "name": quantity.name,
            "value": units.number(quantity),
            "unit": units.unit(quantity.kind),
        })
    };
    json!({
        "name": title,
        "kind": measure.kind.name(),
        "text": measure.text,
        "visible": !measure.hidden,
        "places": measure.places.iter().map(|place| place.to_array()).collect::<Vec<_>>(),
        "quantities": quantities.iter().map(number).collect::<Vec<_>>(),
    })
}
