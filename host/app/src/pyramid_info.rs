//! What is in a pyramid, as its directory says it, for `surfelshop info`.

use crate::contents_info;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use surfelshop_api::format::CloudHeader;
use surfelshop_pyramid::{Directory, Pyramid};

/// What is in a pyramid, for programs.
pub(crate) fn object(file: &Path) -> anyhow::Result<Value> {
    let directory = Pyramid::directory_of(file)?;
    Ok(json!({ "file": file.display().to_string(), "pyramid": directory }))
}

/// A row for each thing to know of a pyramid.
pub(crate) fn text(file: &Path) -> anyhow::Result<String> {
    let directory = Pyramid::directory_of(file)?;
    let Directory { generator, n_surfels, n_leaves, n_nodes, bounds, notes, .. } = &directory;
    let mut text = file.display().to_string();
    let mut row = |name: &str, value: String| write!(text, "\n  {name:<9} {value}");
    row("format", format!("pyramid, made by {generator}"))?;
    row("surfels", format!("{n_surfels} in {n_leaves} leaves; {n_nodes} nodes in all"))?;
    row("bounds", contents_info::bounds(bounds[0], bounds[1]))?;
    let columns = directory.columns.clone();
    row("columns", contents_info::columns(&CloudHeader { columns, ..CloudHeader::default() }))?;
    contents_info::source_rows(&directory.source.of_cloud(), &mut row)?;
    for note in notes {
        row("note", note.split_whitespace().collect::<Vec<_>>().join(" "))?;
    }
    Ok(text)
}
