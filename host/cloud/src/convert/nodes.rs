//! Files whose points lie in an octree, read node by node.

use super::ConvertError;
use crate::cloud::buffer::Buffer;
use crate::cloud::source::Source;
use crate::error::{ReadError, ReadFault};
use crate::formats::plugins::SharedSink;
use crate::inspect::{heads_of, send};
use crate::options::ReadOptions;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost, PointNode, check_batch};
use surfelshop_api::{Error, Result};

/// The head of a file whose points lie in an octree, with that octree; nothing where they do not.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn tree_of(
    path: &Path,
    options: &ReadOptions<'_>,
) -> std::result::Result<Option<(CloudHeader, Source)>, ConvertError> {
    let mut heads = heads_of(path, options, Some(&[]))?;
    let source = Source::of_headers(heads.iter());
    match (heads.pop(), heads.is_empty()) {
        (Some(head), true) if head.tree.is_some() => Ok(Some((head, source))),
        _ => Ok(None),
    }
}

/// The points of nodes in their order, with the header that their columns go by.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn nodes_of(
    path: &Path,
    nodes: &[PointNode],
    options: &ReadOptions<'_>,
) -> std::result::Result<(CloudHeader, Vec<Buffer>), ConvertError> {
    let sink = Arc::new(Mutex::new(NodeSink::default()));
    let shared: SharedSink = sink.clone();
    let fault = |fault: ReadFault| ReadError { path: path.to_owned(), fault };
    send(path, options, (None, Some(nodes)), &shared, options.progress).map_err(fault)?;
    let taken = std::mem::take(&mut *sink.lock().unwrap_or_else(PoisonError::into_inner));
    let header = taken.header.ok_or_else(|| fault(ReadFault::NoClouds))?;
    Ok((header, taken.columns))
}

/// The points of one cloud as they come.
#[derive(Default)]
struct NodeSink {
    header: Option<CloudHeader>,
    columns: Vec<Buffer>,
}

impl CloudSinkHost for NodeSink {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        if self.header.is_some() {
            return Err(Error::new("expected one cloud in an octree, found another"));
        }
        let empty =
            |column: &surfelshop_api::format::FileColumn| Buffer::with_capacity(column.element, 0);
        self.columns = header.columns.iter().map(empty).collect();
        self.header = Some(header.clone());
        Ok(true)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        let Some(header) = &self.header else {
            return Err(Error::new("a batch before the header of its cloud"));
        };
        check_batch(header, values)?;
        for (column, values) in self.columns.iter_mut().zip(values) {
            column.append(values).map_err(|out| Error::new(out.to_string()))?;
        }
        Ok(())
    }

    fn faces(&mut self, _triangles: &[[u32; 3]]) -> Result<()> {
        Ok(())
    }

    fn warn(&mut self, _line: &str) {}
}
