//! The fields of a file's own reader as columns of a sink, block by block.

use crate::cloud::buffer::Buffer;
use crate::error::ReadFault;
use crate::formats::facts;
use crate::table::{COLORS, Field, NORMALS, RADII, Table};
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, RADIUS, Values};
use surfelshop_api::format::{BATCH, CloudHeader, CloudSinkHost, FileColumn};
use surfelshop_geometry::Progress;

/// Where the components of a column come from.
struct Source {
    /// The field, and which of its names.
    parts: Vec<(usize, usize)>,
    column: FileColumn,
    /// Whether a field is the column as it stands.
    whole: Option<usize>,
}

/// Which fields make which columns.
pub(crate) struct Layout(Vec<Source>);

impl Layout {
    /// The columns of these fields.
    pub(crate) fn of(fields: &[Field]) -> Self {
        let mut taken: Vec<Vec<bool>> =
            fields.iter().map(|field| vec![false; field.names.len()]).collect();
        let mut sources = Vec::new();
        let colors: Vec<&[&str]> =
            COLORS.iter().flat_map(|names| [&names[..], &names[..3]]).collect();
        let spellings = [
            (POSITION, vec![&["x", "y", "z"][..]]),
            (NORMAL, NORMALS.iter().map(|names| &names[..]).collect()),
            (COLOR, colors),
            (RADIUS, RADII.iter().map(|names| &names[..]).collect()),
        ];
        for (name, spellings) in spellings {
            let found = spellings.iter().find_map(|names| parts(fields, names));
            if let Some(parts) = found {
                parts.iter().for_each(|&(field, place)| taken[field][place] = true);
                sources.push(source(fields, name.to_owned(), parts));
            }
        }
        for (i, field) in fields.iter().enumerate() {
            for (place, name) in field.names.iter().enumerate() {
                if !taken[i][place] {
                    sources.push(source(fields, name.clone(), vec![(i, place)]));
                }
            }
        }
        Self(sources)
    }

    /// Leaves out what nobody wants; positions stay.
    pub(crate) fn wanted(mut self, columns: Option<&[String]>) -> Self {
        if let Some(columns) = columns {
            self.0.retain(|source| {
                source.column.name == POSITION || columns.contains(&source.column.name)
            });
        }
        self
    }

    /// The columns.
    pub(crate) fn columns(&self) -> Vec<FileColumn> {
        self.0.iter().map(|source| source.column.clone()).collect()
    }

    /// Hands a block of rows over.
    pub(crate) fn emit(
        &self,
        fields: &[Field],
        rows: std::ops::Range<usize>,
        sink: &mut dyn CloudSinkHost,
    ) -> surfelshop_api::Result<()> {
        let made: Vec<Option<Buffer>> = self
            .0
            .iter()
            .map(|source| source.whole.is_none().then(|| gather(source, fields, rows.clone())))
            .collect();
        let values: Vec<Values<'_>> = self
            .0
            .iter()
            .zip(&made)
            .filter_map(|(source, made)| match (made, source.whole) {
                (Some(buffer), _) => Some(buffer.as_values()),
                (None, Some(field)) => {
                    let n = source.parts.len();
                    Some(slice(&fields[field].values, rows.start * n..rows.end * n))
                }
                (None, None) => None,
            })
            .collect();
        sink.batch(&values)
    }
}

/// The fields of these names, in any case.
fn parts(fields: &[Field], names: &[&str]) -> Option<Vec<(usize, usize)>> {
    let place = |name: &str| {
        fields.iter().enumerate().find_map(|(i, field)| {
            let place = field.names.iter().position(|own| own.eq_ignore_ascii_case(name))?;
            Some((i, place))
        })
    };
    names.iter().map(|name| place(name)).collect()
}

fn source(fields: &[Field], name: String, parts: Vec<(usize, usize)>) -> Source {
    let first = fields[parts[0].0].values.element();
    let alike = parts.iter().all(|&(field, _)| fields[field].values.element() == first);
    let element = match (name.as_str(), alike) {
        (POSITION, true) if matches!(first, Element::F32 | Element::F64) => first,
        (POSITION, _) | (_, false) => Element::F64,
        _ => first,
    };
    let field = parts[0].0;
    let whole = parts.iter().enumerate().all(|(i, part)| *part == (field, i))
        && fields[field].names.len() == parts.len()
        && element == first;
    // What would disturb a terminal is written out.
    let name = match name.chars().any(char::is_control) {
        true => name.escape_debug().to_string(),
        false => name,
    };
    let column = FileColumn::new(name, parts.len() as u32, element);
    Source { parts, column, whole: whole.then_some(field) }
}

/// The values of a column whose components lie apart, or have another type.
fn gather(source: &Source, fields: &[Field], rows: std::ops::Range<usize>) -> Buffer {
    let n = source.parts.len();
    let mut made = Buffer::with_capacity(source.column.element, rows.len() * n);
    for row in rows {
        for &(field, place) in &source.parts {
            let Field { names, values } = &fields[field];
            // A wider type holds every value; where types are alike, it is the same.
            made.push(values.get_f64(row * names.len() + place).unwrap_or(f64::NAN));
        }
    }
    made
}

/// Values of a range, borrowed.
pub(crate) fn slice(values: &Buffer, range: std::ops::Range<usize>) -> Values<'_> {
    macro_rules! sliced {
        ($($variant:ident),*) => {
            match values { $(Buffer::$variant(vec) => Values::$variant(&vec[range]),)* }
        };
    }
    sliced!(I8, U8, I16, U16, I32, U32, F32, F64)
}

/// What a sink said, as a fault of the read.
pub(crate) fn refused(error: surfelshop_api::Error) -> ReadFault {
    ReadFault::Format { format: "built in".to_owned(), line: error.message().to_owned() }
}

/// Hands a table over that was read whole.
pub(crate) fn emit_table(
    table: &Table,
    columns: Option<&[String]>,
    sink: &mut dyn CloudSinkHost,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    let layout = Layout::of(&table.fields).wanted(columns);
    let header = facts::said(CloudHeader {
        format: table.format.clone(),
        rows: Some(table.n_rows as u64),
        columns: layout.columns(),
        has_faces: !table.faces.is_empty(),
        comments: table.comments.clone(),
        ..CloudHeader::default()
    });
    table.warnings.iter().for_each(|line| sink.warn(line));
    if !sink.begin(&header).map_err(refused)? {
        return Ok(());
    }
    for start in (0..table.n_rows).step_by(BATCH) {
        if progress(start as f64 / table.n_rows as f64).is_break() {
            return Err(ReadFault::Cancelled);
        }
        let end = (start + BATCH).min(table.n_rows);
        layout.emit(&table.fields, start..end, sink).map_err(refused)?;
    }
    for faces in table.faces.chunks(BATCH) {
        sink.faces(faces).map_err(refused)?;
    }
    Ok(())
}
