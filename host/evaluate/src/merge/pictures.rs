//! Parts of a film: each picture is from one part, with the machine that drew it.

use super::{MergeArguments, machines, make, note_parts, put_file};
use crate::compare::put;
use crate::csv;
use anyhow::ensure;
use serde_json::json;
use std::path::PathBuf;
use surfelshop_session::output::digest::FileDigest;
use surfelshop_session::output::part_file::PartFile;
use surfelshop_session::output::terminal;
use surfelshop_session::render::path_pictures::{DrawnFrame, PathPart};

/// Merges them.
pub(super) fn merge(
    arguments: &MergeArguments,
    parts: Vec<(PathBuf, PartFile<PathPart>)>,
) -> anyhow::Result<()> {
    let Some((_, first)) = parts.first() else { return Ok(()) };
    let n_frames = first.of.n_frames;
    let of_part = |(folder, part): &(PathBuf, PartFile<PathPart>)| {
        let (folder, part, frames) = (folder.clone(), part.part, part.of.frames.clone());
        frames.into_iter().map(move |frame| (folder.clone(), part, frame))
    };
    let mut all: Vec<_> = parts.iter().flat_map(of_part).collect();
    all.sort_by(|(.., a), (.., b)| a.number.cmp(&b.number));
    ensure!(all.len() == n_frames, "expected {n_frames} pictures, found {}", all.len());
    for (folder, part, frame) in &all {
        for file in &frame.files {
            let path = folder.join(&file.name);
            ensure!(
                FileDigest::of(&path).is_ok_and(|found| found == *file),
                "{}: {part} wrote another file than is there now; run it again",
                path.display()
            );
        }
    }
    make(&arguments.out)?;
    note_parts(arguments, &parts)?;
    for (folder, _, frame) in &all {
        for file in &frame.files {
            put_file(&folder.join(&file.name), &arguments.out.join(&file.name))?;
        }
    }
    let head = ["picture", "part", "files", "drawing, ms", "machine"];
    let row =
        |(_, part, frame): &(PathBuf, surfelshop_session::options::part::Part, DrawnFrame)| {
            let names: Vec<&str> = frame.files.iter().map(|file| file.name.as_str()).collect();
            let machine = frame.machine.to_string();
            vec![
                json!(frame.number),
                json!(part.number),
                json!(names.join(" ")),
                json!(frame.render_ms),
                json!(machine),
            ]
        };
    let rows: Vec<_> = all.iter().map(row).collect();
    put(&arguments.out, "pictures.csv", csv::table(&head, &rows).as_bytes())?;
    let frames: Vec<&DrawnFrame> = all.iter().map(|(.., frame)| frame).collect();
    let object = json!({
        "command": "merge",
        "version": env!("CARGO_PKG_VERSION"),
        "of": first.command,
        "frames": frames,
        "machines": machines(&parts),
    });
    put(&arguments.out, "pictures.json", serde_json::to_string_pretty(&object)?.as_bytes())?;
    match arguments.report.json {
        true => terminal::json(&object),
        false => terminal::line(format!("{}: {n_frames} pictures", arguments.out.display())),
    }
}
