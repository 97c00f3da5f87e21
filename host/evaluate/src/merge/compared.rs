//! Parts of a comparison: each frame is from one part, with the machine that drew it.

use super::{MergeArguments, make, note_parts, put_file};
use crate::compare::compared::{FrameNumbers, Target};
use crate::compare::part::{ComparePart, files_of};
use crate::compare::report::{frame_folder, pictures_again};
use crate::compare::verdict;
use anyhow::{Context as _, bail};
use std::path::{Path, PathBuf};
use surfelshop_session::output::part_file::PartFile;

/// Merges them.
pub(super) fn merge(
    arguments: &MergeArguments,
    mut parts: Vec<(PathBuf, PartFile<ComparePart>)>,
) -> anyhow::Result<()> {
    let Some((_, first)) = parts.first() else { return Ok(()) };
    let mut compared = first.of.compared.clone();
    let (names, limits) = (first.of.frames.clone(), first.of.limits.clone());
    for (folder, part) in &parts {
        let found = files_of(folder, &part.of.compared)
            .with_context(|| format!("{}; run it again", part.part))?;
        let lost = part.of.files.iter().find(|(place, file)| found.get(*place) != Some(*file));
        if let Some((place, _)) = lost {
            bail!(
                "{}: {} wrote another file than is there now; run it again",
                folder.join(place).display(),
                part.part
            );
        }
    }
    note_parts(arguments, &parts)?;
    compared.frames.clear();
    let mut places = Vec::new();
    for name in &names {
        let found = parts.iter_mut().find_map(|(folder, part)| {
            let frames = &mut part.of.compared.frames;
            let at = frames.iter().position(|told| told.frame.name == *name)?;
            Some((folder.clone(), frames.remove(at), part.machine.clone()))
        });
        let Some((folder, frame, machine)) = found else { bail!("frame {name} is in no part") };
        compared.frames.push(FrameNumbers { machine: Some(machine), ..frame });
        places.push(folder);
    }
    let worst = compared.frames.iter().enumerate().skip(1).fold(
        (0, compared.frames.first().map_or(0.0, |frame| compared.worst_rmse(frame))),
        |(at, most), (i, frame)| match compared.worst_rmse(frame) {
            error if error > most => (i, error),
            _ => (at, most),
        },
    );
    let mut shown = vec![0, worst.0];
    shown.dedup();
    let mut pictures = Vec::new();
    for i in shown {
        pictures.extend(pictures_again(&places[i], &compared, &compared.frames[i])?);
    }
    make(&arguments.out)?;
    for (folder, told) in places.iter().zip(&compared.frames) {
        put_folder(&frame_folder(folder, &told.frame), &frame_folder(&arguments.out, &told.frame))?;
    }
    compared.write(&Target { folder: &arguments.out, json: arguments.report.json }, pictures)?;
    verdict(&limits, &compared)
}

/// Puts all files of a folder, and those in folders of it, to another place.
fn put_folder(from: &Path, to: &Path) -> anyhow::Result<()> {
    make(to)?;
    let entries = std::fs::read_dir(from).with_context(|| from.display().to_string())?;
    for entry in entries {
        let entry = entry.with_context(|| from.display().to_string())?;
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        match path.is_dir() {
            true => put_folder(&path, &target)?,
            false => put_file(&path, &target)?,
        }
    }
    Ok(())
}
