//! `surfelshop info`: what is in a cloud, and what its load repaired or estimated; what is in a
//! scene or a light probe.

use crate::arguments::InfoArguments;
use crate::contents_info::{self, shortened};
use crate::{pyramid_info, scene_info};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use surfelshop_cloud::{Cloud, Column, Loaded, Summary};
use surfelshop_pyramid::is_pyramid_file;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::{clouds, environment_map, probe_info};
use surfelshop_session::output::terminal::Progress;
use surfelshop_session::output::{provenance, terminal};

/// Runs the command.
pub(crate) fn run(arguments: &InfoArguments) -> anyhow::Result<()> {
    let mut report = InfoObjects::default();
    let formats = SessionFormats::new(&arguments.plugins);
    let mut faults = Vec::new();
    for file in &arguments.files {
        // What is wrong with one file keeps nobody from knowing the others.
        if let Err(error) = tell(file, arguments, &formats, &mut report) {
            faults.push(error);
        }
    }
    let Some(last) = faults.pop() else { return report.finish(arguments, &formats) };
    if faults.len() + 1 < arguments.files.len() {
        report.finish(arguments, &formats)?;
    }
    faults.iter().for_each(|error| terminal::note(format!("{error:#}")));
    Err(last)
}

/// What was said of files, as JSON.
#[derive(Default)]
struct InfoObjects {
    clouds: Vec<Value>,
    scenes: Vec<Value>,
    probes: Vec<Value>,
}

impl InfoObjects {
    fn finish(self, arguments: &InfoArguments, formats: &SessionFormats) -> anyhow::Result<()> {
        if !arguments.report.json {
            return Ok(());
        }
        terminal::json(&json!({
            "command": "info",
            "version": env!("CARGO_PKG_VERSION"),
            "clouds": self.clouds,
            "scenes": self.scenes,
            "probes": self.probes,
            "formats_loaded": formats.n_loaded(),
            "modules_compiled": surfelshop_runtime::plugins::n_compiled(),
        }))
    }
}

/// Says what is in a file.
fn tell(
    file: &Path,
    arguments: &InfoArguments,
    formats: &SessionFormats,
    report: &mut InfoObjects,
) -> anyhow::Result<()> {
    let json = arguments.report.json;
    if surfelshop_cloud::scene::is_scene(file) {
        let opened = surfelshop_cloud::scene::read(file)?;
        match json {
            true => report.scenes.push(scene_info::object(&opened)),
            false => terminal::line(scene_info::text(&opened)?)?,
        }
    } else if let Some(source) = environment_map::probe_named(file) {
        let probe = environment_map::read(&source, None)?;
        match json {
            true => report.probes.push(probe_info::object(&probe)),
            false => terminal::line(probe_info::text(&probe)?)?,
        }
    } else if is_pyramid_file(file) {
        match json {
            true => report.clouds.push(pyramid_info::object(file)?),
            false => terminal::line(pyramid_info::text(file)?)?,
        }
    } else if !arguments.full {
        let progress = Progress::new(format!("reading {}", file.display()));
        let tell = |fraction| progress.tell(fraction);
        let contents = surfelshop_cloud::inspect(file, &formats.reading(&tell))?;
        drop(progress);
        match json {
            true => report.clouds.extend(contents_info::objects(&contents)),
            false => terminal::line(contents_info::text(&contents)?)?,
        }
    } else {
        let loaded = clouds::read(file, formats)?;
        match json {
            true => report.clouds.push(object(&loaded)),
            false => terminal::line(text(&loaded)?)?,
        }
    }
    Ok(())
}

/// Bytes of a column's values.
fn bytes(column: &Column) -> u64 {
    column.values().len() as u64 * column.values().element().size() as u64
}

fn total_bytes(cloud: &Cloud) -> u64 {
    let triangles = size_of_val(cloud.faces()) as u64;
    cloud.columns().iter().map(bytes).sum::<u64>() + triangles
}

/// Smallest and largest radius.
fn radii(cloud: &Cloud) -> Option<[f32; 2]> {
    let first = *cloud.radii().first()?;
    let ends = |[low, high]: [f32; 2], radius: &f32| [low.min(*radius), high.max(*radius)];
    Some(cloud.radii().iter().fold([first; 2], ends))
}

fn object(Loaded { cloud, summary }: &Loaded) -> Value {
    let columns: Vec<Value> = cloud
        .columns()
        .iter()
        .map(|column| {
            json!({
                "name": column.name(),
                "components": column.components(),
                "type": column.values().element().name(),
                "bytes": bytes(column),
                "made": column.made().map(|made| provenance::object(made)),
            })
        })
        .collect();
    json!({
        "summary": summary,
        "facts": cloud.facts(),
        "radius_range": radii(cloud),
        "source": cloud.source(),
        "columns": columns,
        "history": cloud.history().iter().map(provenance::cloud_object).collect::<Vec<_>>(),
        "bytes": total_bytes(cloud),
    })
}

/// A row for each thing to know.
fn text(Loaded { cloud, summary }: &Loaded) -> Result<String, std::fmt::Error> {
    let mut text = summary.file.clone();
    let mut row = |name: &str, value: String| write!(text, "\n  {name:<9} {value}");
    row("format", summary.format.clone())?;
    row("points", points(summary))?;
    if summary.n_triangles > 0 {
        row("triangles", summary.n_triangles.to_string())?;
    }
    // A fit that may be off by more fits nothing.
    let error = summary.normal_error_deg.filter(|degrees| *degrees < 45.0);
    let error = error.map_or(String::new(), |degrees| {
        format!("; their median error is about {degrees:.1} degrees, by the scatter of points")
    });
    let n_normals = summary.normals.estimated.max(summary.n_surfels);
    row("normals", shares(&normal_counts(summary), n_normals) + &error)?;
    if let Some(path) = &summary.trajectory {
        row("scanner", format!("its path {path}"))?;
    }
    let r = &summary.radii;
    let counts = [
        (r.given, "given"),
        (r.from_triangles, "from triangles"),
        (r.estimated, "estimated"),
        (r.clamped, "clamped"),
    ];
    let range = match radii(cloud) {
        Some([low, high]) if low < high => format!(", {low} to {high}"),
        Some([low, _]) => format!(", all {low}"),
        None => String::new(),
    };
    row("radii", counted(&counts) + &range)?;
    let c = &summary.colors;
    let counts = [
        (c.given, "given"),
        (c.neutral, "not given: drawn in neutral grey"),
        (c.replaced, "replaced"),
    ];
    row("colours", counted(&counts))?;
    let facts = cloud.facts();
    if !cloud.is_empty() {
        let size = facts.bounds_max - facts.bounds_min;
        let longest = size.max_element();
        let [low, high, size] = [facts.bounds_min, facts.bounds_max, size]
            .map(|v| v.to_array().map(|number| shortened(number, longest)).join(" "));
        row("bounds", format!("{low} to {high}, size {size}"))?;
    }
    contents_info::source_rows(cloud.source(), &mut row)?;
    row("origin", summary.origin.map(|number| number.to_string()).join(" "))?;
    let columns: Vec<String> = cloud
        .columns()
        .iter()
        .map(|c| format!("{} {} x {}", c.name(), c.components(), c.values().element().name()))
        .collect();
    row("columns", columns.join(", "))?;
    for line in provenance::lines(cloud) {
        row("made", line)?;
    }
    row("memory", size_in_words(total_bytes(cloud)))?;
    row("read in", format!("{:.2} s", summary.seconds))?;
    for warning in &summary.warnings {
        row("warning", warning.clone())?;
    }
    Ok(text)
}

fn points(summary: &Summary) -> String {
    let Summary { n_surfels, n_in_file, n_dropped, .. } = summary;
    let why = summary.why_dropped();
    match n_dropped {
        0 => n_surfels.to_string(),
        _ => format!("{n_surfels}; {n_dropped} of {n_in_file} dropped, {why}"),
    }
}

/// What the load left out or replaced, a line each; nothing where the file was sound.
pub(crate) fn repairs(summary: &Summary) -> Vec<String> {
    let mut lines = Vec::new();
    if summary.n_dropped > 0 {
        lines.push(format!("points {}", points(summary)));
    }
    if summary.normals.repaired + summary.normals.estimated > 0 {
        lines.push(format!("normals {}", counted(&normal_counts(summary))));
    }
    lines.extend(summary.warnings.iter().map(|warning| format!("warning: {warning}")));
    lines
}

fn normal_counts(summary: &Summary) -> [(u64, &'static str); 11] {
    let n = &summary.normals;
    [
        (n.given, "given"),
        (n.normalised, "made unit length"),
        (n.from_triangles, "from triangles"),
        (n.repaired, "repaired"),
        (n.estimated, "estimated"),
        (n.degenerate, "without a plane around them"),
        (n.scattered, "of no surface"),
        (n.towards_scanner, "towards the scanner"),
        (n.towards_free_space, "towards free space"),
        (n.of_unsure_side, "of uncertain side"),
        (n.turned, "flipped for it"),
    ]
}

/// The counts that are not zero.
fn counted(counts: &[(u64, &str)]) -> String {
    let shown: Vec<String> =
        counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
}

/// The same, each beside its share of all, where it is not all.
fn shares(counts: &[(u64, &str)], all: u64) -> String {
    let share = |n: u64| match 100.0 * n as f64 / all.max(1) as f64 {
        // Nothing that a digit behind the point would show.
        percent if !(0.05..99.95).contains(&percent) => String::new(),
        percent => format!(" ({percent:.1} %)"),
    };
    let shown = counts.iter().filter(|(n, _)| *n > 0);
    let shown = shown.map(|(n, what)| format!("{n} {what}{}", share(*n)));
    let shown: Vec<String> = shown.collect();
    if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
}

fn size_in_words(bytes: u64) -> String {
    let mut size = bytes as f64;
    for unit in ["B", "kB", "MB"] {
        if size < 1000.0 {
            return if unit == "B" { format!("{bytes} B") } else { format!("{size:.1} {unit}") };
        }
        size /= 1000.0;
    }
    format!("{size:.1} GB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_in_words() {
        assert_eq!(size_in_words(999), "999 B");
        assert_eq!(size_in_words(3_600_000), "3.6 MB");
        assert_eq!(size_in_words(12_000_000_000), "12.0 GB");
    }

    #[test]
    fn coordinates_are_short_and_keep_their_digits() {
        assert_eq!(shortened(0.1 + 0.2, 1.8), "0.3");
        assert_eq!(shortened(-4_512_345.678, 20.0), "-4512345.678");
        assert_eq!(shortened(-8.4e-25, 2.0), "0");
        assert_eq!(shortened(100.0, 0.0), "100");
        assert_eq!(shortened(1.25e9, 3e9), "1250000000");
    }
}
