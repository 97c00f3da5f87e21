//! Clouds on their way out of a file, and into one: batches of columns.

use super::header::CloudHeader;
use super::tree::PointNode;
use crate::columns::{CloudView, Values};
use crate::error::{Error, Result};

/// Points of a batch that suit the caches: large enough that a call costs nothing beside it.
pub const BATCH: usize = 1 << 16;

/// Who takes the clouds of a file that is read.
pub trait CloudSinkHost {
    /// Takes the header of the next cloud; whether its points are wanted.
    ///
    /// # Errors
    /// Where the header cannot be right.
    fn begin(&mut self, header: &CloudHeader) -> Result<bool>;

    /// Takes the values of the next points, column by column as the header has them.
    ///
    /// # Errors
    /// Where columns do not fit the header, there are more points than it announces, or there is no memory.
    fn batch(&mut self, values: &[Values<'_>]) -> Result<()>;

    /// Takes triangles between the points of the cloud, counted from its first.
    ///
    /// # Errors
    /// As [`batch`](Self::batch).
    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()>;

    /// Takes a line for people, of what is doubtful in the file.
    fn warn(&mut self, line: &str);
}

/// Where a format puts the clouds that it reads, one after the other.
pub struct CloudSink<'a> {
    host: &'a mut dyn CloudSinkHost,
    columns: Option<&'a [String]>,
    nodes: Option<&'a [PointNode]>,
}

impl<'a> CloudSink<'a> {
    /// One that hands everything to `host`; only these columns are wanted, where they are named.
    pub fn new(host: &'a mut dyn CloudSinkHost, columns: Option<&'a [String]>) -> Self {
        Self { host, columns, nodes: None }
    }

    /// The same for a file whose points lie in an octree, of which these nodes are wanted.
    #[must_use]
    pub fn with_nodes(self, nodes: Option<&'a [PointNode]>) -> Self {
        Self { nodes, ..self }
    }

    /// Whether the file is to be read node by node, and the nodes whose points are wanted now. A format that knows an
    /// octree in the file then puts it into [`CloudHeader::tree`], and hands over the points of these nodes alone,
    /// in their order; any other passes over it. Came while ABI 3.8 was current.
    #[must_use]
    pub fn nodes(&self) -> Option<&[PointNode]> {
        self.nodes
    }

    /// Whether anybody reads a column: the format may leave out of its header and skip what nobody does.
    #[must_use]
    pub fn wants(&self, column: &str) -> bool {
        self.columns.is_none_or(|columns| columns.iter().any(|wanted| wanted == column))
    }

    /// Begins the next cloud. Where this is `false`, the header was all that is wanted of it: the format goes on
    /// with the next cloud, or returns.
    ///
    /// # Errors
    /// Where the header cannot be right.
    pub fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        self.host.begin(header)
    }

    /// Hands over the next points: for each column of the header its values, all components of a point
    /// together. [`BATCH`] points are a good number.
    ///
    /// # Errors
    /// Where values do not fit the header, there are more points than it announces, or there is no memory.
    pub fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        self.host.batch(values)
    }

    /// Hands over triangles between the points of the cloud, counted from its first.
    ///
    /// # Errors
    /// As [`batch`](Self::batch).
    pub fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.host.faces(triangles)
    }

    /// Says something doubtful of the file, in one line for people.
    pub fn warn(&mut self, line: &str) {
        self.host.warn(line);
    }
}

/// Who has the clouds that are written.
pub trait CloudSourceHost {
    /// The header of the next cloud.
    ///
    /// # Errors
    /// Where what makes the clouds fails, or the user asked to stop.
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>>;

    /// The next points of the cloud.
    ///
    /// # Errors
    /// As [`next_cloud`](Self::next_cloud).
    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>>;
}

/// The clouds that a format writes, one after the other.
pub struct CloudSource<'a> {
    host: &'a mut dyn CloudSourceHost,
}

impl<'a> CloudSource<'a> {
    /// One that takes everything from `host`.
    pub fn new(host: &'a mut dyn CloudSourceHost) -> Self {
        Self { host }
    }

    /// The header of the next cloud; `None` after the last. Its `rows` may be unknown: they are what the
    /// batches have.
    ///
    /// # Errors
    /// Where what makes the clouds fails, or the user asked to stop.
    pub fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        self.host.next_cloud()
    }

    /// The next points of the cloud, with the columns of its header in the same order; `None` after the last.
    /// Positions are `f64`, relative to zero. Triangles come with the last batch, which may have no points, and count from the
    /// cloud's first point.
    ///
    /// # Errors
    /// As [`next_cloud`](Self::next_cloud).
    pub fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        self.host.next_batch()
    }
}

/// Clouds in memory, as tests of formats take and give them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CollectedCloud {
    /// The header.
    pub header: CloudHeader,
    /// For each column all values, widened to `f64`.
    pub columns: Vec<Vec<f64>>,
    /// The triangles.
    pub faces: Vec<[u32; 3]>,
}

/// A sink that keeps everything, for tests of formats: positions and all other values as `f64`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Collected {
    /// The clouds in the order of the file.
    pub clouds: Vec<CollectedCloud>,
    /// What was said of the file.
    pub warnings: Vec<String>,
}

impl Collected {
    fn last(&mut self) -> Result<&mut CollectedCloud> {
        self.clouds.last_mut().ok_or_else(|| Error::new("a batch before the header of its cloud"))
    }
}

impl CloudSinkHost for Collected {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        let columns = vec![Vec::new(); header.columns.len()];
        self.clouds.push(CollectedCloud { header: header.clone(), columns, faces: Vec::new() });
        Ok(true)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        let cloud = self.last()?;
        check_batch(&cloud.header, values)?;
        for (column, values) in cloud.columns.iter_mut().zip(values) {
            column.extend(values.iter_f64());
        }
        Ok(())
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.last()?.faces.extend(triangles);
        Ok(())
    }

    fn warn(&mut self, line: &str) {
        self.warnings.push(line.to_owned());
    }
}

/// Whether values are those of a header's columns; how many points they are of.
///
/// # Errors
/// A line that names the column.
pub fn check_batch(header: &CloudHeader, values: &[Values<'_>]) -> Result<usize> {
    if values.len() != header.columns.len() {
        let (expected, found) = (header.columns.len(), values.len());
        return Err(Error::new(format!("a batch: expected {expected} columns, found {found}")));
    }
    let mut rows = None;
    for (column, values) in header.columns.iter().zip(values) {
        let name = &column.name;
        if values.element() != column.element {
            let (expected, found) = (column.element.name(), values.element().name());
            return Err(Error::new(format!(
                "column `{name}` of a batch: expected {expected}, found {found}"
            )));
        }
        let components = column.components as usize;
        let n = values.len() / components.max(1);
        if n * components != values.len() || rows.is_some_and(|rows| rows != n) {
            let expected =
                rows.map_or_else(|| "whole points".to_owned(), |n| format!("{n} points"));
            return Err(Error::new(format!(
                "column `{name}` of a batch: expected {expected} of {components}, found {} values",
                values.len()
            )));
        }
        rows = Some(n);
    }
    Ok(rows.unwrap_or(0))
}
