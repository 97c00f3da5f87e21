//! `surfelshop render --path`: a picture for each camera of a path, or for those of one part of it.

use super::camera_path::{self, Frame};
use super::{RenderArguments, check_finite, overlay_of, write_all};
use crate::input::displayed::DisplayedClouds;
use crate::input::scenes::Source;
use crate::options::part::Part;
use crate::options::values::OutputFile;
use crate::output::digest::FileDigest;
use crate::output::json::{self, Written};
use crate::output::machine::Machine;
use crate::output::overlay::Overlay;
use crate::output::part_file::{PartFile, PartStart};
use crate::output::terminal::{self, Progress};
use crate::session::LoadedRenderer;
use crate::setup::RenderSetup;
use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::hash::{DefaultHasher, Hasher as _};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use surfelshop_api::View;
use surfelshop_api::params::{ParamKind, Value, Values};
use surfelshop_cloud::files::folder_of;
use surfelshop_cloud::scene::{OpenedScene, ProbeSource};
use surfelshop_render::Rendered;
use surfelshop_runtime::plugins::{LoadedUnit, UnitRef};

/// The name of the command in files of parts.
pub const COMMAND: &str = "render";

/// The log of a part's pictures, a line each.
const LOG: &str = "frames.log";
/// Most bytes of it.
const MOST_BYTES: u64 = 1 << 28;

/// A unit that draws, with its parameters.
pub struct DrawingUnit {
    /// The unit as it was named.
    pub reference: UnitRef,
    /// The unit, loaded.
    pub unit: LoadedUnit,
    /// Its parameters.
    pub values: Values,
}

/// A setup as it is wherever its files lie.
#[must_use]
pub fn portable(setup: &RenderSetup) -> RenderSetup {
    let mut setup = setup.clone();
    if let Some(environment) = &mut setup.environment
        && let ProbeSource::File(path) = &mut environment.source
    {
        *path = PathBuf::from(path.file_name().unwrap_or_default());
    }
    setup
}

/// The files that pictures depend on: those that were typed, those that a scene shows, the environment map, plugins, and
/// files that parameters name.
#[must_use]
pub fn files_read(
    typed: &[PathBuf],
    sources: &[Source],
    setup: &RenderSetup,
    units: &[DrawingUnit],
) -> Vec<PathBuf> {
    let shown = sources.iter().map(|source| source.path.clone());
    let mut all: Vec<PathBuf> = typed.iter().cloned().chain(shown).collect();
    if let Some(ProbeSource::File(path)) = setup.environment.as_ref().map(|light| &light.source) {
        all.push(path.clone());
    }
    for unit in units {
        all.extend(unit.files());
    }
    all
}

/// All units that draw.
pub(super) fn units_of(chosen: &LoadedRenderer) -> Vec<DrawingUnit> {
    let own = (&chosen.reference, &chosen.unit, &chosen.values);
    let beside = chosen.beside.iter().map(|other| (&other.reference, &other.unit, &other.values));
    let unit = |(reference, unit, values): (&UnitRef, &LoadedUnit, &Values)| DrawingUnit {
        reference: reference.clone(),
        unit: unit.clone(),
        values: values.clone(),
    };
    std::iter::once(own).chain(beside).map(unit).collect()
}

/// A path of cameras, and what is drawn along it.
pub(super) struct PathPictures<'a> {
    pub(super) arguments: &'a RenderArguments,
    pub(super) staging: &'a RenderSetup,
    pub(super) displayed: &'a DisplayedClouds,
    pub(super) opened: Option<&'a OpenedScene>,
    pub(super) units: Vec<DrawingUnit>,
    pub(super) sources: &'a [Source],
    pub(super) device: String,
}

/// Pictures of a part.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PathPart {
    /// Pictures of the whole path.
    pub n_frames: usize,
    /// Those of the part.
    pub frames: Vec<DrawnFrame>,
}

/// A picture that was drawn.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawnFrame {
    /// Its number, as it stands in names.
    pub number: String,
    /// Its files.
    pub files: Vec<FileDigest>,
    /// Milliseconds that drawing took, without writing.
    pub render_ms: f64,
    /// What it was drawn on: a part may be ended on one machine and go on on another.
    pub machine: Machine,
}

impl PathPictures<'_> {
    /// Draws all pictures, or those of a part that are not there yet; `draw` makes that of a view, and says in how many
    /// milliseconds.
    pub(super) fn render(
        &self,
        mut draw: impl FnMut(View) -> anyhow::Result<(Rendered, f64)>,
    ) -> anyhow::Result<()> {
        let started = PartStart::now();
        let Self { arguments, staging, displayed, .. } = self;
        let clouds = &displayed.clouds;
        let path = arguments.path;
        let frames = camera_path::frames(path, &arguments.picture, staging, self.opened, clouds)?;
        let known = match arguments.part {
            Some(part) => Some(self.begun(part, &frames)?),
            None => None,
        };
        let is_own = |i: &usize| arguments.part.is_none_or(|part| part.takes(*i));
        let own: Vec<&Frame> =
            frames.iter().enumerate().filter(|(i, _)| is_own(i)).map(|(_, frame)| frame).collect();
        let machine = Machine::this(self.device.clone());
        // Each picture has its own view of it.
        let first = frames.first().context("a path without a picture")?.view;
        let overlay = overlay_of(arguments, self.opened, staging, displayed, first);
        let progress = Progress::new(format!("drawing {} pictures", own.len()));
        let (mut all, mut drawn) = (Vec::with_capacity(own.len()), Vec::with_capacity(own.len()));
        for (i, frame) in own.iter().enumerate() {
            let number = frame.number().to_owned();
            if let Some(there) = known.as_ref().and_then(|log| log.known(&number)) {
                all.push(there);
                continue;
            }
            let (rendered, render_ms) = draw(frame.view)?;
            check_finite(&rendered);
            let out = numbered(&arguments.out, &number, arguments.part);
            let overlay = Overlay { view: frame.view, ..overlay.clone() };
            let written = write_all(&out, arguments, staging, &overlay, &rendered)?;
            let files = FileDigest::of_all(out.iter().map(OutputFile::path))?;
            let frame = DrawnFrame { number, files, render_ms, machine: machine.clone() };
            if let Some(log) = &known {
                log.note(&frame)?;
            }
            self.say(&written, render_ms)?;
            drawn.push((written, render_ms));
            all.push(frame);
            // Ctrl-C ends the program; the pictures that are done are on the disk.
            let _goes_on = progress.tell((i + 1) as f64 / own.len() as f64);
        }
        drop(progress);
        if let (Some(part), Some(log)) = (arguments.part, &known) {
            let of = PathPart { n_frames: frames.len(), frames: all };
            let read = (log.options.clone(), log.inputs.clone());
            PartFile::new((COMMAND, part), read, (machine.clone(), started), of)
                .write(&log.folder)?;
        }
        self.tell(&drawn, (frames.len(), own.len()), &machine)
    }

    /// The folder of a part, made, with what is known of it.
    fn begun(&self, part: Part, frames: &[Frame]) -> anyhow::Result<FrameLog> {
        let folder = part_folder(&self.arguments.out, part)?;
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        let arguments = self.arguments;
        let mut files = files_read(&arguments.files, self.sources, self.staging, &self.units);
        files.extend(arguments.graph.clone());
        let inputs = FileDigest::of_all(files.iter().map(PathBuf::as_path))?;
        FrameLog::open(folder, self.options(frames), inputs)
    }

    /// Everything that pictures depend on besides files.
    fn options(&self, frames: &[Frame]) -> String {
        let Self { arguments, staging, .. } = self;
        let units: Vec<String> = self.units.iter().map(DrawingUnit::told).collect();
        let names: Vec<_> = arguments.out.iter().filter_map(|file| file.path.file_name()).collect();
        format!(
            "{:?}",
            (
                units,
                portable(staging),
                frames,
                names,
                arguments.bits,
                arguments.legend,
                arguments.device.surfels
            )
        )
    }

    fn say(&self, written: &[Written], render_ms: f64) -> anyhow::Result<()> {
        if self.arguments.report.json {
            return Ok(());
        }
        let line = |file: &Written| terminal::line(format!("{} in {render_ms:.0} ms", file.what()));
        written.iter().try_for_each(line)
    }

    fn tell(
        &self,
        drawn: &[(Vec<Written>, f64)],
        (n_frames, n_own): (usize, usize),
        machine: &Machine,
    ) -> anyhow::Result<()> {
        let Self { arguments, displayed, .. } = self;
        let n_known = n_own - drawn.len();
        if !arguments.report.json {
            return match n_known {
                0 => Ok(()),
                n => terminal::line(format!("{n} pictures were there already")),
            };
        }
        let units = self.units.iter().map(|one| json::unit(&one.reference, &one.unit, &one.values));
        let frames = drawn.iter().map(|(files, ms)| json!({ "files": files, "render_ms": ms }));
        terminal::json(&json!({
            "command": COMMAND,
            "version": env!("CARGO_PKG_VERSION"),
            "frames": frames.collect::<Vec<_>>(),
            "n_frames": n_frames,
            "n_known": n_known,
            "part": arguments.part,
            "machine": machine,
            "facts": displayed.clouds.facts,
            "display": displayed.object(),
            "scene": self.staging.scene,
            "renderers": units.collect::<Vec<_>>(),
        }))
    }
}

impl DrawingUnit {
    /// Its name and parameters, wherever its file lies.
    #[must_use]
    pub fn told(&self) -> String {
        let mut object = json::unit(&self.reference, &self.unit, &self.values);
        object["file"] = json!(null);
        object.to_string()
    }

    /// Its plugin, and files that its parameters name.
    fn files(&self) -> Vec<PathBuf> {
        let declared = self.unit.description.params.iter();
        let files = declared.filter(|one| matches!(one.kind, ParamKind::File { .. }));
        let named = files.filter_map(|one| match self.values.get(&one.id) {
            Some(Value::Text(path)) if !path.is_empty() => Some(PathBuf::from(path)),
            _ => None,
        });
        // A captured graph has no plugin.
        let own = self.reference.path.is_file().then(|| self.reference.path.clone());
        own.into_iter().chain(named).collect()
    }
}

/// The folder of a part, beside the files that are to be written.
fn part_folder(out: &[OutputFile], part: Part) -> anyhow::Result<PathBuf> {
    let first = out.first().map(|file| folder_of(file.path()).to_owned()).unwrap_or_default();
    for file in out {
        ensure!(
            folder_of(file.path()) == first,
            "{}: expected all pictures of a part in one folder, {}",
            file.path().display(),
            first.display()
        );
    }
    Ok(first.join(part.folder()))
}

/// The files of a picture: `turn/snail.png` becomes `turn/snail-0007.png`, or of a part
/// `turn/part-3-of-8/snail-0007.png`.
fn numbered(out: &[OutputFile], number: &str, part: Option<Part>) -> Vec<OutputFile> {
    let own = |OutputFile { path, format }: &OutputFile| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let folder = folder_of(path);
        let folder = part.map_or_else(|| folder.to_owned(), |part| folder.join(part.folder()));
        OutputFile { path: folder.join(format!("{stem}-{number}.{ending}")), format: *format }
    };
    out.iter().map(own).collect()
}

/// What is known of a part's pictures.
struct FrameLog {
    folder: PathBuf,
    options: String,
    inputs: Vec<FileDigest>,
    /// A hash of both: lines of others do not count.
    of: u64,
    frames: Vec<DrawnFrame>,
}

#[derive(Serialize, Deserialize)]
struct LogLine {
    of: u64,
    frame: DrawnFrame,
}

impl FrameLog {
    /// Reads the log of a folder, where there is one. A line that a kill cut short is passed over.
    fn open(folder: PathBuf, options: String, inputs: Vec<FileDigest>) -> anyhow::Result<Self> {
        let mut hasher = DefaultHasher::new();
        hasher.write(options.as_bytes());
        hasher.write(serde_json::to_string(&(&inputs, env!("CARGO_PKG_VERSION")))?.as_bytes());
        let of = hasher.finish();
        let path = folder.join(LOG);
        let text = match path.exists() {
            true => crate::output::files::read_short(&path, MOST_BYTES)?,
            false => Vec::new(),
        };
        let lines = text.split(|byte| *byte == b'\n');
        let lines = lines.filter_map(|line| serde_json::from_slice::<LogLine>(line).ok());
        let frames = lines.filter(|line| line.of == of).map(|line| line.frame).collect();
        Ok(Self { folder, options, inputs, of, frames })
    }

    /// A picture whose files are there as they were written.
    fn known(&self, number: &str) -> Option<DrawnFrame> {
        let is_there = |file: &FileDigest| {
            FileDigest::of(&self.folder.join(&file.name)).is_ok_and(|found| found == *file)
        };
        let frame = self.frames.iter().rev().find(|frame| frame.number == number)?;
        frame.files.iter().all(is_there).then(|| frame.clone())
    }

    /// Notes a picture that is on the disk.
    fn note(&self, frame: &DrawnFrame) -> anyhow::Result<()> {
        let path = self.folder.join(LOG);
        let mut line = serde_json::to_string(&LogLine { of: self.of, frame: frame.clone() })?;
        // A line that was cut short ends here.
        line.insert(0, '\n');
        line.push('\n');
        append(&path, &line).with_context(|| format!("{}: cannot be written", path.display()))
    }
}

fn append(path: &Path, line: &str) -> std::io::Result<()> {
    surfelshop_cloud::files::append(path)?.write_all(line.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_before_the_ending() {
        let out = [OutputFile::parse("turn/snail.png").unwrap()];
        assert_eq!(numbered(&out, "007", None)[0].path, Path::new("turn/snail-007.png"));
        let part = Some(Part { number: 3, of: 8 });
        let found = numbered(&out, "007", part)[0].path.clone();
        assert_eq!(found, Path::new("turn/part-3-of-8/snail-007.png"));
        let apart = [out[0].clone(), OutputFile::parse("other/snail.exr").unwrap()];
        assert!(part_folder(&apart, Part { number: 3, of: 8 }).is_err());
    }
}
