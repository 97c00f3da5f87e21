//! Clouds as a format is given them to write.

use crate::formats::stage::{Files, formats};
use glam::DVec3;
use std::path::PathBuf;
use surfelshop_api::columns::{ColumnView, NORMAL, POSITION};
use surfelshop_api::format::{CloudHeader, CloudSourceHost, FileColumn, Pose};
use surfelshop_api::{CloudView, Result};
use surfelshop_cloud::{Buffer, FormatCall, Formats as _, WriteFault, files, silent};

/// A cloud of a file: what is said of it, its columns, and triangles between its points.
#[derive(Clone, Debug, Default)]
pub(crate) struct InMemoryCloud {
    pub(crate) header: CloudHeader,
    pub(crate) columns: Vec<Buffer>,
    pub(crate) faces: Vec<[u32; 3]>,
}

impl InMemoryCloud {
    /// A cloud of these places.
    pub(crate) fn at(places: &[DVec3]) -> Self {
        let positions = places.iter().flat_map(|place| place.to_array()).collect();
        Self::default().with(POSITION, 3, Buffer::F64(positions))
    }

    /// The same with a column.
    pub(crate) fn with(mut self, name: &str, components: u32, values: Buffer) -> Self {
        self.header.columns.push(FileColumn::new(name, components, values.element()));
        self.columns.push(values);
        self
    }

    /// The same with normals.
    pub(crate) fn with_normals(self, normals: &[DVec3]) -> Self {
        let normals = normals.iter().flat_map(|normal| normal.as_vec3().to_array()).collect();
        self.with(NORMAL, 3, Buffer::F32(normals))
    }

    /// The same at a pose, under a name.
    pub(crate) fn standing(mut self, name: &str, pose: Pose) -> Self {
        (self.header.name, self.header.pose) = (name.to_owned(), pose);
        self
    }

    fn rows(&self) -> usize {
        let (column, values) = (self.header.columns.first(), self.columns.first());
        let components = column.map_or(1, |column| column.components as usize);
        values.map_or(0, Buffer::len) / components
    }
}

/// Hands clouds over, each as one batch.
pub(crate) struct InMemory {
    clouds: std::vec::IntoIter<InMemoryCloud>,
    current: InMemoryCloud,
    is_handed_over: bool,
}

impl InMemory {
    pub(crate) fn new(clouds: Vec<InMemoryCloud>) -> Self {
        Self { clouds: clouds.into_iter(), current: InMemoryCloud::default(), is_handed_over: true }
    }
}

impl CloudSourceHost for InMemory {
    fn next_cloud(&mut self) -> Result<Option<CloudHeader>> {
        let Some(next) = self.clouds.next() else { return Ok(None) };
        (self.current, self.is_handed_over) = (next, false);
        let (rows, has_faces) = (self.current.rows() as u64, !self.current.faces.is_empty());
        let header = self.current.header.clone();
        Ok(Some(CloudHeader { rows: Some(rows), has_faces, ..header }))
    }

    fn next_batch(&mut self) -> Result<Option<CloudView<'_>>> {
        if std::mem::replace(&mut self.is_handed_over, true) {
            return Ok(None);
        }
        let InMemoryCloud { header, columns, faces } = &self.current;
        let columns = header.columns.iter().zip(columns).map(|(column, values)| ColumnView {
            name: &column.name,
            components: column.components,
            generation: 0,
            values: values.as_values(),
        });
        let len = self.current.rows();
        let columns = columns.collect();
        Ok(Some(CloudView { len, columns, faces, ..CloudView::default() }))
    }
}

/// Has a format write clouds to a file; also what it says.
#[track_caller]
pub(crate) fn write(
    files: &Files,
    format: &str,
    name: &str,
    clouds: Vec<InMemoryCloud>,
) -> (PathBuf, Vec<String>) {
    let path = files.at(name);
    let said = files::replace_at(
        &path,
        |file| {
            let call = FormatCall { name, ..FormatCall::default() };
            formats().write(format, Box::new(InMemory::new(clouds)), file, call, &silent)
        },
        |error| WriteFault::Line(error.to_string()),
    );
    (path, said.unwrap_or_else(|fault| panic!("{name}: {fault:?}")))
}
