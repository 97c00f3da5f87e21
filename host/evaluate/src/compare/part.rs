//! A part of a comparison along a path: its frames, in a folder of its own.

use super::candidate::{Candidate, Stage};
use super::compared::Compared;
use super::report::frame_folder;
use super::{CompareArguments, Limits};
use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::part::Part;
use surfelshop_session::output::digest::FileDigest;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::part_file::{PART_FILE, PartFile, PartStart};
use surfelshop_session::output::terminal;
use surfelshop_session::render::camera_path::Frame;
use surfelshop_session::render::path_pictures::{DrawingUnit, files_read, portable};

/// What a part leaves behind.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ComparePart {
    /// Its frames.
    pub(crate) compared: Compared,
    /// The names of all frames, in their order.
    pub(crate) frames: Vec<String>,
    pub(crate) limits: Limits,
    /// The files of its frames, by their places in the part's folder.
    pub(crate) files: BTreeMap<PathBuf, FileDigest>,
}

/// The files in the folders of a part's frames, by their places in its folder.
pub(crate) fn files_of(
    folder: &Path,
    compared: &Compared,
) -> anyhow::Result<BTreeMap<PathBuf, FileDigest>> {
    let mut found = BTreeMap::new();
    for told in &compared.frames {
        add_files(folder, &frame_folder(folder, &told.frame), &mut found)?;
    }
    Ok(found)
}

fn add_files(
    root: &Path,
    folder: &Path,
    found: &mut BTreeMap<PathBuf, FileDigest>,
) -> anyhow::Result<()> {
    let cannot = || format!("{}: cannot be read", folder.display());
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        let path = entry.with_context(cannot)?.path();
        if path.is_dir() {
            add_files(root, &path, found)?;
        } else if let Ok(place) = path.strip_prefix(root) {
            found.insert(place.to_owned(), FileDigest::of(&path)?);
        }
    }
    Ok(())
}

/// Takes away what says that a part is done, where it is begun anew.
pub(super) fn begin(folder: &Path) -> anyhow::Result<()> {
    let path = folder.join(PART_FILE);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}

/// The name of the command in files of parts.
pub(crate) const COMMAND: &str = "compare";

/// The folder that is written: that of a part lies in the one that was named.
pub(super) fn folder(arguments: &CompareArguments) -> PathBuf {
    match arguments.part {
        Some(part) => arguments.out.join(part.folder()),
        None => arguments.out.clone(),
    }
}

/// The frames of a part.
pub(super) fn own_frames(part: Option<Part>, frames: Vec<Frame>) -> anyhow::Result<Vec<Frame>> {
    let Some(part) = part else { return Ok(frames) };
    let n = frames.len();
    ensure!(
        part.of as usize <= n,
        "--part {}/{}: expected at most as many parts as the path has pictures, {n}",
        part.number,
        part.of
    );
    let own = frames.into_iter().enumerate().filter(|(i, _)| part.takes(*i));
    Ok(own.map(|(_, frame)| frame).collect())
}

/// What the parts are of.
pub(super) struct Whole<'a> {
    pub(super) arguments: &'a CompareArguments,
    pub(super) stage: &'a Stage<'a>,
    pub(super) sources: &'a [Source],
    pub(super) candidates: &'a [Candidate],
    pub(super) frames: &'a [Frame],
    pub(super) started: PartStart,
}

impl Whole<'_> {
    /// Writes what a part leaves behind.
    pub(super) fn write(
        &self,
        part: Part,
        compared: Compared,
        limits: Limits,
    ) -> anyhow::Result<()> {
        let Self { arguments, stage, .. } = self;
        let folder = folder(arguments);
        let unit = |one: &Candidate| {
            let unit = one.ready.as_ref().ok()?.unit.clone();
            Some(DrawingUnit { reference: one.reference.clone(), unit, values: one.values.clone() })
        };
        let units: Vec<DrawingUnit> = self.candidates.iter().filter_map(unit).collect();
        let names: Vec<&str> = self.candidates.iter().map(|one| one.name.as_str()).collect();
        let told: Vec<String> = units.iter().map(DrawingUnit::told).collect();
        let options = format!(
            "{:?}",
            (
                names,
                told,
                portable(stage.staging),
                self.frames,
                arguments.repeats,
                arguments.device.surfels
            )
        );
        let files = files_read(&arguments.files, self.sources, stage.staging, &units);
        let inputs = FileDigest::of_all(files.iter().map(PathBuf::as_path))?;
        let machine = Machine::this(compared.device.clone());
        let frames = self.frames.iter().map(|frame| frame.name.clone()).collect();
        let files = files_of(&folder, &compared)?;
        let of = ComparePart { compared, frames, limits, files };
        let file = PartFile::new((COMMAND, part), (options, inputs), (machine, self.started), of);
        file.write(&folder)?;
        match arguments.report.json {
            true => terminal::json(&file),
            false => terminal::line(format!("{}: {}", folder.display(), file.line())),
        }
    }
}
