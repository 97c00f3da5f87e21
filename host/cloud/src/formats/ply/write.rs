//! Writing: the header through `ply-rs-bw`, the records in bulk.

use super::header::MAX_HEADER;
use super::lists::scalar_type;
use super::properties::property_name;
use super::splats::SplatRecords;
use crate::cloud::Cloud;
use crate::cloud::buffer::{Buffer, with_vec};
use crate::cloud::column::{Column, has_fixed_type};
use crate::cloud::provenance::{self, CloudEdit};
use crate::error::WriteError;
use crate::formats::facts;
use crate::options::WriteOptions;
use glam::DVec3;
use ply_rs_bw::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType,
    Version,
};
use ply_rs_bw::writer::Writer;
use std::collections::HashSet;
use std::io::{self, Write};
use std::path::Path;
use surfelshop_api::CloudView;
use surfelshop_api::columns::{Element, POSITION};

/// One property of the file.
struct Field<'a> {
    name: String,
    source: Source<'a>,
}

enum Source<'a> {
    /// A component of a column.
    Column { values: &'a Buffer, components: usize, component: usize },
    /// A world coordinate, where the origin is not zero.
    World { cloud: &'a Cloud, axis: usize },
}

impl Source<'_> {
    fn element(&self) -> Element {
        match self {
            Self::Column { values, .. } => values.element(),
            Self::World { .. } => Element::F64,
        }
    }
}

/// Records between two questions whether to stop.
const BLOCK: usize = 4096;

/// Writes the header, all surfels and the triangles between them; `path` is for messages only.
pub(crate) fn write(
    out: &mut impl Write,
    path: &Path,
    cloud: &Cloud,
    options: &WriteOptions<'_>,
) -> Result<(), WriteError> {
    let records = Records::of(cloud);
    let properties = records.properties();
    check_names(&properties, path)?;
    let failed = |error: io::Error| WriteError::Io { path: path.to_owned(), error };
    let header = header(cloud, &records, properties, options);
    Writer::<DefaultElement>::new().write_header(out, &header).map_err(failed)?;
    let mut block = Vec::new();
    let n_records = (cloud.len() + cloud.faces().len()) as f64;
    let report = |record: usize| match (options.progress)(record as f64 / n_records).is_break() {
        true => Err(WriteError::Cancelled { path: path.to_owned() }),
        false => Ok(()),
    };
    for start in (0..cloud.len()).step_by(BLOCK) {
        report(start)?;
        block.clear();
        for surfel in start..(start + BLOCK).min(cloud.len()) {
            records.append(&mut block, surfel, options.ascii).map_err(failed)?;
        }
        out.write_all(&block).map_err(failed)?;
    }
    for (i, faces) in cloud.faces().chunks(BLOCK).enumerate() {
        report(cloud.len() + i * BLOCK)?;
        block.clear();
        faces
            .iter()
            .try_for_each(|face| face_record(&mut block, face, options.ascii))
            .map_err(failed)?;
        out.write_all(&block).map_err(failed)?;
    }
    out.flush().map_err(failed)
}

/// What is written of each surfel.
enum Records<'a> {
    /// The columns as they are.
    Columns(Vec<Field<'a>>),
    /// Gaussian splats.
    Splats(SplatRecords, CloudView<'a>),
}

impl<'a> Records<'a> {
    fn of(cloud: &'a Cloud) -> Self {
        match SplatRecords::of_cloud(cloud) {
            Some(splats) => Self::Splats(splats, cloud.view()),
            None => Self::Columns(fields(cloud)),
        }
    }

    /// Names and types of the properties.
    fn properties(&self) -> Vec<(String, Element)> {
        match self {
            Self::Columns(fields) => {
                let property = |field: &Field<'_>| (field.name.clone(), field.source.element());
                fields.iter().map(property).collect()
            }
            Self::Splats(splats, _) => {
                splats.properties().map(|(name, element)| (name.to_owned(), element)).collect()
            }
        }
    }

    /// Whether coordinates have the precision that brings the origin back.
    fn keep_origin(&self) -> bool {
        match self {
            Self::Columns(_) => true,
            Self::Splats(splats, _) => splats.are_wide,
        }
    }

    /// Whether a column of this number is written under its own name.
    fn has_column(&self, column: usize) -> bool {
        match self {
            Self::Columns(_) => true,
            Self::Splats(splats, _) => splats.is_other(column),
        }
    }

    /// The columns of which it is written who made them.
    fn noted(&self, cloud: &Cloud) -> Vec<Column> {
        let is_noted = |column: &&Column| match self {
            Self::Columns(_) => true,
            Self::Splats(..) => !SplatRecords::is_derived(column.name()),
        };
        cloud.columns().iter().filter(is_noted).cloned().collect()
    }

    /// Appends a surfel.
    fn append(&self, block: &mut Vec<u8>, surfel: usize, ascii: bool) -> io::Result<()> {
        match self {
            Self::Columns(fields) if ascii => text_record(block, fields, surfel),
            Self::Columns(fields) => {
                fields.iter().for_each(|field| binary_value(block, &field.source, surfel));
                Ok(())
            }
            Self::Splats(splats, view) => splats.append(block, view, surfel, ascii),
        }
    }
}

/// The properties in the order of the columns.
fn fields(cloud: &Cloud) -> Vec<Field<'_>> {
    let mut fields = Vec::new();
    for column in cloud.columns() {
        let components = column.components() as usize;
        for component in 0..components {
            let name = property_name(column.name(), components, component);
            let values = column.values();
            let source = if column.name() == POSITION && cloud.origin() != DVec3::ZERO {
                Source::World { cloud, axis: component }
            } else {
                Source::Column { values, components, component }
            };
            fields.push(Field { name, source });
        }
    }
    fields
}

/// Refuses names that a reader could not tell apart or would split.
fn check_names(properties: &[(String, Element)], path: &Path) -> Result<(), WriteError> {
    let mut names = HashSet::new();
    for (name, _) in properties {
        let breaks = |c: char| c.is_whitespace() || c.is_control();
        let reason = if name.is_empty() || name.contains(breaks) {
            "names in PLY files have no spaces"
        } else if names.insert(name.to_ascii_lowercase()) {
            continue;
        } else {
            "another column has a property of this name"
        };
        return Err(WriteError::ColumnName {
            path: path.to_owned(),
            column: name.escape_debug().to_string(),
            reason,
        });
    }
    Ok(())
}

/// Bytes of the notes on a cloud's edits at most: headers are read up to twice that.
const MOST_NOTES: usize = (MAX_HEADER / 2) as usize;

/// How many of a cloud's edits are too old to be noted in a header, which holds what was done last.
pub(crate) fn n_edits_left_out(cloud: &Cloud) -> usize {
    let mut n_bytes = 0;
    let fits = |edit: &&CloudEdit| {
        n_bytes += edit.to_string().len();
        n_bytes <= MOST_NOTES
    };
    cloud.history().len() - cloud.history().iter().rev().take_while(fits).count()
}

fn header(
    cloud: &Cloud,
    records: &Records<'_>,
    properties: Vec<(String, Element)>,
    options: &WriteOptions<'_>,
) -> Header {
    let mut header = Header::new();
    header.encoding = if options.ascii { Encoding::Ascii } else { Encoding::BinaryLittleEndian };
    header.version = Version { major: 1, minor: 0 };
    let lines = options.comments.iter().flat_map(|comment| comment.lines());
    header.comments.extend(lines.map(|line| line.replace('\r', " ")));
    if cloud.origin() != DVec3::ZERO && records.keep_origin() {
        let DVec3 { x, y, z } = cloud.origin();
        header.comments.push(format!("surfelshop origin {x} {y} {z}"));
    }
    header.comments.extend(facts::of_cloud(cloud));
    for (i, column) in cloud.columns().iter().enumerate() {
        let is_foreign = !has_fixed_type(column.name()) && records.has_column(i);
        if is_foreign && column.components() > 1 {
            let (name, components) = (column.name(), column.components());
            header.comments.push(format!("surfelshop column {name} {components}"));
        }
    }
    let history = &cloud.history()[n_edits_left_out(cloud)..];
    header.comments.extend(provenance::comments(&records.noted(cloud), history));
    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = cloud.len();
    for (name, element) in properties {
        let kind = PropertyType::Scalar(scalar_type(element));
        vertex.properties.add(PropertyDef::new(name, kind));
    }
    header.elements.add(vertex);
    if !cloud.faces().is_empty() {
        let mut face = ElementDef::new("face".to_owned());
        face.count = cloud.faces().len();
        // Signed, as programs expect it, unless there are more surfels than that can count.
        let signed = i32::try_from(cloud.len()).is_ok();
        let index = if signed { ScalarType::Int } else { ScalarType::UInt };
        let corners = PropertyType::List(ScalarType::UChar, index);
        face.properties.add(PropertyDef::new("vertex_indices".to_owned(), corners));
        header.elements.add(face);
    }
    header
}

/// Appends a triangle: how many corners, and which.
fn face_record(block: &mut Vec<u8>, face: &[u32; 3], ascii: bool) -> io::Result<()> {
    let [a, b, c] = face;
    if ascii {
        return writeln!(block, "3 {a} {b} {c}");
    }
    block.push(3);
    face.iter().for_each(|corner| block.extend_from_slice(&corner.to_le_bytes()));
    Ok(())
}

/// Appends a value, least significant byte first.
fn binary_value(block: &mut Vec<u8>, source: &Source<'_>, surfel: usize) {
    match *source {
        Source::Column { values, components, component } => {
            with_vec!(values, vec => {
                block.extend_from_slice(&vec[surfel * components + component].to_le_bytes());
            });
        }
        Source::World { cloud, axis } => {
            let world = cloud.world_position(surfel).unwrap_or(cloud.origin());
            block.extend_from_slice(&world[axis].to_le_bytes());
        }
    }
}

/// Appends a line; floats have as many digits as tell them from their neighbours.
fn text_record(block: &mut Vec<u8>, fields: &[Field<'_>], surfel: usize) -> io::Result<()> {
    for (i, field) in fields.iter().enumerate() {
        if i > 0 {
            block.push(b' ');
        }
        match field.source {
            Source::Column { values, components, component } => {
                with_vec!(values, vec => write!(block, "{}", vec[surfel * components + component]))?;
            }
            Source::World { cloud, axis } => {
                let world = cloud.world_position(surfel).unwrap_or(cloud.origin());
                write!(block, "{}", world[axis])?;
            }
        }
    }
    block.push(b'\n');
    Ok(())
}
