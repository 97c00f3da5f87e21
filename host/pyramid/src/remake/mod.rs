//! Makes a pyramid of another one whose surfels are changed, part by part, in bounded memory.
//!
//! A part is a node with all leaves beneath it that fits into memory. What changes it sees it with the surfels around:
//! those close by as they are, and where it asks for the whole scene merged ones for those farther away. Leaves keep
//! their places in the tree where surfels only get other values or go; a part of new surfels gets nodes of its own.
//!
//! As with an index, what is done stays in a folder beside the output until it is whole, and work that was ended goes
//! on there.

mod context;
mod part;

use crate::error::PyramidError;
use crate::index::chunk::kept_or_made;
use crate::index::finish::{self, read_back};
use crate::index::most_points;
use crate::index::nodes::{Made, NodeFile, Rule};
use crate::index::spool::OpenFiles;
use crate::index::tree::joined;
use crate::index::work::Work;
use crate::layout::Directory;
use crate::pyramid::Pyramid;
use glam::DVec3;
use part::{Part, cell};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use surfelshop_api::{ObjectFrame, Scope};
use surfelshop_cloud::{Cloud, EditedCloud, Progress};
use surfelshop_geometry::part as share;

/// How a pyramid is made of another one.
#[derive(Clone, Copy)]
pub struct RemakeOptions<'a> {
    /// What is seen of the surfels around a part; never the whole cloud.
    pub scope: Scope,
    /// What is done: the same words for the same work, which by these goes on where it was ended.
    pub what: &'a str,
    /// Files that the work depends on besides, such as the plugin's: with others it is begun anew.
    pub depends: &'a [&'a Path],
    /// Memory that it takes at most, bytes, beside the program itself.
    pub memory: u64,
    /// What stands for the surfels beneath a node.
    pub rule: Rule,
    /// Is told how far it is, and may stop it.
    pub progress: Progress<'a>,
}

/// Changes a part: its surfels first, those around it behind them, told apart by the column `context`. Nothing comes
/// back where nothing is to change; an error is a line that ends the work.
pub type Change<'a> =
    &'a mut dyn FnMut(&Cloud, Progress<'_>) -> Result<Option<EditedCloud>, String>;

/// Changes a leaf, of which surfels may go and values change and nothing else; an error is a line that ends the work.
pub type LeafChange<'a> = &'a mut dyn FnMut(Cloud) -> Result<Cloud, String>;

/// What is done to parts.
enum Remaking<'a> {
    Parts(Change<'a>),
    Leaves(LeafChange<'a>),
}

/// What was made.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct RemakeSummary {
    /// Surfels of the leaves before.
    pub n_before: u64,
    /// Surfels of the leaves.
    pub n_surfels: u64,
    /// Nodes, and leaves among them.
    pub n_nodes: u64,
    /// See there.
    pub n_leaves: u64,
    /// Parts that were changed by themselves.
    pub n_parts: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Names of the columns that were made.
    pub columns: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// What became of a part.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
struct Counts {
    /// Centres of new surfels that reach over the border of the part.
    at_border: Vec<DVec3>,
    n_surfels: u64,
    largest_radius: f32,
    columns: Vec<String>,
}

/// New surfels at the borders of parts that are made: where a neighbouring part has the same, one of both is enough.
struct Known {
    places: HashSet<[i64; 3]>,
    /// Two are the same where they are so close, scene units: positions are rounded differently from part to part.
    step: f64,
}

impl Known {
    fn new(object: &ObjectFrame) -> Self {
        Self { places: HashSet::new(), step: 1e-6 * object.size }
    }

    /// The steps that a place lies in, and those that it may be rounded to.
    fn keys(&self, place: DVec3) -> [[i64; 3]; 2] {
        let steps = place / self.step;
        [steps.floor(), (steps + 0.5).floor() + 0.5]
            .map(|steps| (2.0 * steps).to_array().map(|x| x as i64))
    }

    fn add(&mut self, places: &[DVec3]) {
        for &place in places {
            self.places.extend(self.keys(place));
        }
    }

    fn has(&self, place: DVec3) -> bool {
        !self.places.is_empty() && self.keys(place).iter().any(|key| self.places.contains(key))
    }
}

/// Makes a pyramid of another one.
///
/// # Errors
/// One line; what was done until then stays in the folder `NAME.index` beside the output. Where nothing is left of the
/// surfels, too.
pub fn remake(
    pyramid: &Pyramid,
    output: &Path,
    options: &RemakeOptions<'_>,
    change: Change<'_>,
) -> Result<RemakeSummary, PyramidError> {
    made_of(pyramid, output, options, &mut Remaking::Parts(change))
}

/// Makes a pyramid of another one, each of whose leaves is changed by itself as it is in the file.
///
/// # Errors
/// As [`remake`].
pub fn remake_leaves(
    pyramid: &Pyramid,
    output: &Path,
    options: &RemakeOptions<'_>,
    change: LeafChange<'_>,
) -> Result<RemakeSummary, PyramidError> {
    made_of(pyramid, output, options, &mut Remaking::Leaves(change))
}

fn made_of(
    pyramid: &Pyramid,
    output: &Path,
    options: &RemakeOptions<'_>,
    remaking: &mut Remaking<'_>,
) -> Result<RemakeSummary, PyramidError> {
    let what = format!("{} {:?} {:?}", options.what, options.scope, options.rule);
    let inputs: Vec<&Path> =
        [pyramid.path()].into_iter().chain(options.depends.iter().copied()).collect();
    let mut work = Work::find(output, &inputs, what, most_points(options.memory))?;
    work.begin()?;
    let parts = parts(pyramid, work.most);
    let directory = pyramid.directory();
    let mut summary = RemakeSummary {
        n_before: directory.n_surfels,
        n_parts: parts.len() as u64,
        warnings: work.warning.iter().cloned().collect(),
        ..RemakeSummary::default()
    };
    let (mut made, mut largest_radius, mut done) = (HashMap::new(), 0f32, 0);
    let mut known = Known::new(&pyramid.object());
    for (number, &node) in parts.iter().enumerate() {
        let n_beneath = pyramid.nodes()[node as usize].n_beneath;
        let at = |done: u64| 0.95 * done as f64 / directory.n_surfels.max(1) as f64;
        let progress = share(options.progress, at(done)..at(done + n_beneath));
        let stopped = || PyramidError::Cancelled(work.folder.clone());
        if progress(0.0).is_break() {
            return Err(stopped());
        }
        let path = work.folder.join(format!("part-{number}.bin"));
        let part = Part { pyramid, node, scope: options.scope, rule: options.rule };
        let found = kept_or_made(&path, |path| part.changed(path, &progress, &known, remaking));
        let (top, counts) = match found {
            // Whatever it says when it is stopped.
            Err(_) if progress(0.0).is_break() => return Err(stopped()),
            // What cannot even begin leaves nothing behind.
            Err(error @ PyramidError::Points(_)) if made.is_empty() => {
                work.remove();
                return Err(error);
            }
            found => found?,
        };
        made.insert(node, top);
        known.add(&counts.at_border);
        summary.n_surfels += counts.n_surfels;
        largest_radius = largest_radius.max(counts.largest_radius);
        for column in counts.columns {
            if !summary.columns.contains(&column) {
                summary.columns.push(column);
            }
        }
        done += n_beneath;
    }
    let top = work.folder.join("top.bin");
    let (mut file, mut files) = (NodeFile::create(&top)?, OpenFiles::default());
    file.rule = options.rule;
    let root = above(pyramid, 0, &mut made, (&mut file, &mut files))?;
    file.finish()?;
    let Some(root) = root else {
        work.remove();
        return Err(PyramidError::Points(
            "expected surfels to stay, found none left; ask the tool to remove fewer".to_owned(),
        ));
    };
    let mut notes = directory.notes.clone();
    notes.push(format!(
        "{} made {} surfels of {}",
        options.what, summary.n_surfels, summary.n_before
    ));
    let directory = Directory {
        n_surfels: summary.n_surfels,
        largest_radius,
        source: directory.source.clone(),
        notes,
        ..Directory::default()
    };
    (summary.n_nodes, summary.n_leaves, summary.bytes) = finish::write(&root, directory, output)?;
    work.remove();
    Ok(summary)
}

/// The highest nodes with at most so many surfels in the leaves beneath, in the order of the leaves.
fn parts(pyramid: &Pyramid, most: u64) -> Vec<u32> {
    let (mut parts, mut open) = (Vec::new(), vec![0u32]);
    while let Some(node) = open.pop() {
        let record = &pyramid.nodes()[node as usize];
        if record.n_beneath <= most || record.is_leaf() {
            parts.push(node);
        } else {
            let [first, count] = record.children;
            open.extend((first..first + count).rev());
        }
    }
    parts
}

/// A node above the parts, merged anew; nothing where nothing is left beneath it.
fn above(
    pyramid: &Pyramid,
    node: u32,
    made: &mut HashMap<u32, Option<Made>>,
    (file, files): (&mut NodeFile, &mut OpenFiles),
) -> Result<Option<Made>, PyramidError> {
    if let Some(part) = made.remove(&node) {
        return Ok(part);
    }
    let record = &pyramid.nodes()[node as usize];
    let [first, count] = record.children;
    let mut children = Vec::new();
    for child in first..first + count {
        children.extend(above(pyramid, child, made, (file, files))?);
    }
    if children.len() < 2 {
        return Ok(children.pop());
    }
    let nodes = children.into_iter().map(|made| read_back(made, files));
    let nodes = nodes.collect::<Result<Vec<_>, _>>()?;
    Ok(Some(joined(cell(record.level), nodes, file)?.made))
}
