//! Takes the batches of a format and makes a table of them.

use crate::assemble::memory_estimate;
use crate::cloud::buffer::Buffer;
use crate::cloud::roles::{Misfit, misfit, role_in_file};
use crate::cloud::source::Source;
use crate::error::ReadFault;
use crate::faces;
use crate::formats::parts::{Part, grid_up, merged, move_columns, source};
use crate::memory::{self, OutOfMemory};
use crate::options::ReadOptions;
use crate::read::preview::{self, Previews};
use crate::table::{COLORS, Field, NORMALS, Table};
use glam::DQuat;
use std::collections::HashSet;
use surfelshop_api::columns::{
    AO, COLOR, Element, MATERIAL, NORMAL, POSITION, RADIUS, Role, TANGENT_U, TANGENT_V, Values,
    role_of,
};
use surfelshop_api::format::{CloudHeader, CloudSinkHost, FileColumn, Pose, check_batch};
use surfelshop_api::{Error, Result};
use surfelshop_geometry::silent;

/// Most components of a column.
const MAX_COMPONENTS: u32 = 1024;

/// Most clouds of a file: their numbers fit into 16 bits.
const MAX_CLOUDS: usize = 1 << 16;

/// Takes clouds and keeps them; also the memory that ran out, if it did.
#[derive(Default)]
pub struct TableSink {
    parts: Vec<Part>,
    warnings: Vec<String>,
    /// Bytes of values that were handed over, and how many there are when memory is asked for again.
    n_bytes: u64,
    ask_at: u64,
    /// Bytes of text in the headers.
    n_text_bytes: usize,
    /// Why no more is taken.
    out_of_memory: Option<(usize, OutOfMemory)>,
    /// Nothing is taken any more.
    closed: bool,
    /// Only headers are wanted.
    heads_only: bool,
    /// Somebody wants to see what was read so far.
    previews: Option<Previews>,
}

/// Most bytes of text in all headers of a file.
const MAX_TEXT_BYTES: usize = 64 << 20;

/// Fewer bytes of values than this are no reason to ask again.
const ASK_EVERY: u64 = 16 << 20;

/// Most warnings that are kept of a file.
const MAX_WARNINGS: usize = 100;

/// The number of components that a column with a meaning must have.
fn components_of(name: &str) -> Option<&'static [u32]> {
    Some(match name {
        POSITION | NORMAL | TANGENT_U | TANGENT_V => &[3],
        COLOR => &[3, 4],
        RADIUS | AO | MATERIAL => &[1],
        _ => return None,
    })
}

/// Refuses more points of a cloud than its header announces.
pub(crate) fn check_count(header: &CloudHeader, n: u64) -> Result<()> {
    match header.rows.filter(|most| n > *most) {
        Some(most) => Err(Error::new(format!("{most} points are announced, more came"))),
        None => Ok(()),
    }
}

/// Whether a header can be right; says what is wrong in a line.
pub(crate) fn check_header(header: &CloudHeader) -> Result<()> {
    let mut names = HashSet::new();
    for FileColumn { name, components, .. } in &header.columns {
        let printable = !name.is_empty() && !name.chars().any(char::is_control);
        if !printable || name.len() > 256 {
            let name = name.escape_debug();
            return Err(Error::new(format!(
                "column `{name}`: expected a name of 1 to 256 letters"
            )));
        }
        if !names.insert(name.to_lowercase()) {
            return Err(Error::new(format!("column `{name}` is given twice")));
        }
        let allowed = components_of(name);
        if !(1..=MAX_COMPONENTS).contains(components)
            || allowed.is_some_and(|allowed| !allowed.contains(components))
        {
            return Err(Error::new(format!(
                "column `{name}`: {components} components are not what it can have"
            )));
        }
    }
    let position = header.column(POSITION);
    if !position.is_some_and(|(_, column)| matches!(column.element, Element::F32 | Element::F64)) {
        return Err(Error::new("expected a column `position` of f32 or f64, found none"));
    }
    let (Pose { rotation, translation }, rows) = (header.pose, header.rows);
    let is_rotation = (rotation.length_squared() - 1.0).abs() < 1e-3;
    if !is_rotation || !translation.is_finite() {
        return Err(Error::new(format!(
            "expected a pose of a rotation and a place, found {rotation} and {translation}"
        )));
    }
    let is_turned = rotation != DQuat::IDENTITY;
    if let Some(Misfit { expected, found }) =
        header.columns.iter().find_map(|column| misfit(column, is_turned))
    {
        return Err(Error::new(format!("expected {expected}, found {found}")));
    }
    if rows.is_some_and(|rows| rows > u64::from(u32::MAX)) {
        let rows = rows.unwrap_or_default();
        return Err(Error::new(format!("{rows} points are more than the 2^32 that are taken")));
    }
    Ok(())
}

impl TableSink {
    /// One that takes headers and no points.
    #[must_use]
    pub fn of_heads() -> Self {
        Self { heads_only: true, ..Self::default() }
    }

    /// One that shows what was read so far.
    pub(crate) fn with_previews(previews: Option<Previews>) -> Self {
        Self { previews, ..Self::default() }
    }

    /// Shows some of the points that were read so far, where it is time.
    fn show_some(&mut self) {
        let Some(previews) = self.previews.as_mut() else { return };
        if !previews.is_due() {
            return;
        }
        let n: usize = self.parts.iter().map(|part| part.n_rows).sum();
        let most = previews.n_points();
        let some = |part: &Part| {
            // Of each cloud its share, and so of all together as many as there may be.
            let rows = preview::rows(n, part.n_rows, most);
            let columns = part.header.columns.iter().zip(&part.columns);
            let column = |(column, values): (&FileColumn, &Buffer)| {
                values.gather(column.components as usize, &rows)
            };
            let columns = columns.map(column).collect::<std::result::Result<_, _>>()?;
            let header = CloudHeader { rows: None, ..part.header.clone() };
            Ok(Part { header, columns, n_rows: rows.len(), faces: Vec::new() })
        };
        let parts: std::result::Result<_, OutOfMemory> = self.parts.iter().map(some).collect();
        if let Ok(parts) = parts
            && let Ok((table, source)) = (Self { parts, ..Self::default() }).finish()
        {
            previews.show(table, source, &silent);
        }
    }

    /// Takes nothing any more: what comes later is refused.
    pub fn close(&mut self) {
        self.closed = true;
    }

    /// The headers, with the points that were counted where points were wanted.
    pub fn headers(&self) -> impl Iterator<Item = &CloudHeader> {
        self.parts.iter().map(|part| &part.header)
    }

    /// What was said of the file.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The fault of memory that ran out, in the words of reads.
    #[must_use]
    pub fn memory_fault(&self) -> Option<ReadFault> {
        let (n_points, out) = self.out_of_memory?;
        Some(ReadFault::Memory { n_points: n_points as u64, out })
    }

    /// Asks for the memory that a cloud of so many points takes besides their values, whenever they have become
    /// a quarter more: points without end are refused long before they have taken all there is.
    fn ask_for_cloud(&mut self, n_rows: usize) -> std::result::Result<(), OutOfMemory> {
        let Some(part) = self.parts.last().filter(|_| self.n_bytes >= self.ask_at) else {
            return Ok(());
        };
        self.ask_at = self.n_bytes + self.n_bytes / 4 + ASK_EVERY;
        let field = |column: &FileColumn| {
            let values = Buffer::with_capacity(column.element, 0);
            Field { names: names_of(column), values }
        };
        let fields: Vec<Field> = part.header.columns.iter().map(field).collect();
        // Radii may be given for the whole file, and then need no estimates; normals do where they are missing.
        let options = ReadOptions { radius: Some(1.0), ..ReadOptions::default() };
        memory_estimate::ask(&fields, n_rows as u64, 0, &options, 0)
    }

    fn refuse(&mut self, n_points: usize, out: OutOfMemory) -> Error {
        self.out_of_memory = Some((n_points, out));
        Error::new(out.to_string())
    }

    /// All clouds in one table, and what the file said of them.
    pub(crate) fn finish(mut self) -> std::result::Result<(Table, Source), ReadFault> {
        let mut source = source(&self.parts);
        let mut warnings = std::mem::take(&mut self.warnings);
        for part in &self.parts {
            if let Some(rows) = part.header.rows
                && (part.n_rows as u64) < rows
            {
                let found = part.n_rows;
                let said = format!("{found} of {rows} points were read");
                // The format may have said so, and why.
                if !warnings.iter().any(|line| line.contains(&said)) {
                    warnings.push(format!("{rows} points are announced, {found} were read"));
                }
            }
        }
        let comments = self.parts.iter().flat_map(|part| part.header.comments.iter().cloned());
        let mut comments: Vec<String> = comments.collect();
        comments.dedup();
        source.comments.clone_from(&comments);
        let format = match self.parts.as_slice() {
            [] => return Err(ReadFault::NoClouds),
            [only] => only.header.format.clone(),
            [first, ..] => format!("{}, {} clouds", first.header.format, self.parts.len()),
        };
        let merged = match self.parts.len() {
            1 => self.parts.remove(0),
            _ => merged(self.parts, &mut warnings)?,
        };
        let (n_rows, mut table) = (merged.n_rows, Table { format, ..Table::default() });
        let n_components = |column: &FileColumn| column.components;
        let Part { header, mut columns, faces, .. } = merged;
        if !is_identity(&header.pose) {
            move_columns(&header, &mut columns);
        }
        if let (Some(grid), Some((place, _))) = (source.grid, header.column(POSITION)) {
            source.grid_up = grid_up(grid, &columns[place]);
        }
        for (column, values) in header.columns.iter().zip(columns) {
            if n_components(column) > 1 && components_of(&column.name).is_none() {
                comments.push(format!("surfelshop column {} {}", column.name, column.components));
            }
            let role = role_in_file(column);
            if role != Role::Plain && role != role_of(&column.name) {
                table.roles.push((column.name.clone(), role));
            }
            table.fields.push(Field { names: names_of(column), values });
        }
        table.element = "point".to_owned();
        (table.n_rows, table.comments, table.warnings) = (n_rows, comments, warnings);
        let mut checked = faces::Faces::new(n_rows);
        for triangle in &faces {
            checked.polygon(&triangle.map(i64::from)).map_err(ReadFault::memory(n_rows))?;
        }
        let (triangles, warning) = checked.finish();
        table.faces = triangles;
        table.warnings.extend(warning);
        Ok((table, source))
    }
}

/// The names that a table has for a column.
pub(crate) fn names_of(column: &FileColumn) -> Vec<String> {
    let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    let name = &column.name;
    match (name.as_str(), column.components) {
        (POSITION, _) => owned(&["x", "y", "z"]),
        (NORMAL, _) => owned(&NORMALS[0]),
        (COLOR, 4) => owned(&COLORS[0]),
        (COLOR, _) => owned(&COLORS[0][..3]),
        (TANGENT_U | TANGENT_V, _) => ["x", "y", "z"].map(|axis| format!("{name}_{axis}")).to_vec(),
        (_, 1) => vec![name.clone()],
        (_, n) => (0..n).map(|component| format!("{name}_{component}")).collect(),
    }
}

fn is_identity(pose: &Pose) -> bool {
    *pose == Pose::default()
}

impl CloudSinkHost for TableSink {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        if self.closed {
            return Err(Error::new("nothing is taken any more"));
        }
        check_header(header)?;
        if self.parts.len() >= MAX_CLOUDS {
            return Err(Error::new(format!("at most {MAX_CLOUDS} clouds of a file are taken")));
        }
        let texts = header.columns.iter().flat_map(|column| [&column.unit, &column.description]);
        let texts = texts.chain(&header.comments).chain([&header.coordinate_system]);
        self.n_text_bytes += texts.map(String::len).sum::<usize>();
        if self.n_text_bytes > MAX_TEXT_BYTES {
            let most = MAX_TEXT_BYTES;
            return Err(Error::new(format!("at most {most} bytes of text in headers are taken")));
        }
        let columns = header.columns.iter().map(|column| Buffer::with_capacity(column.element, 0));
        let columns = columns.collect();
        self.parts.push(Part { header: header.clone(), columns, n_rows: 0, faces: Vec::new() });
        Ok(!self.heads_only)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        if self.closed || self.heads_only {
            return Err(Error::new("nothing is taken any more"));
        }
        let n_before: usize = self.parts.iter().map(|part| part.n_rows).sum();
        let Some(part) = self.parts.last_mut() else {
            return Err(Error::new("a batch came before the header of its cloud"));
        };
        let rows = check_batch(&part.header, values)?;
        let most = part.header.rows.unwrap_or(u64::from(u32::MAX));
        if (part.n_rows + rows) as u64 > most {
            return Err(Error::new(format!("{most} points are announced, more came")));
        }
        let point_bytes: usize = part.header.columns.iter().map(FileColumn::point_bytes).sum();
        self.n_bytes = self.n_bytes.saturating_add(rows as u64 * point_bytes as u64);
        if let Err(out) = self.ask_for_cloud(n_before + rows) {
            return Err(self.refuse(n_before + rows, out));
        }
        let Some(part) = self.parts.last_mut() else { return Ok(()) };
        let mut out = None;
        for (column, values) in part.columns.iter_mut().zip(values) {
            if let Err(refused) = column.append(values) {
                out = Some(refused);
                break;
            }
        }
        part.n_rows += rows;
        match out {
            None => {
                self.show_some();
                Ok(())
            }
            Some(out) => Err(self.refuse(n_before + rows, out)),
        }
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        if self.closed || self.heads_only {
            return Err(Error::new("nothing is taken any more"));
        }
        let Some(part) = self.parts.last_mut() else {
            return Err(Error::new("triangles came before the header of their cloud"));
        };
        if let Err(out) = memory::grow(&mut part.faces, triangles.len()) {
            let n_rows = part.n_rows;
            return Err(self.refuse(n_rows, out));
        }
        part.faces.extend(triangles);
        Ok(())
    }

    fn warn(&mut self, line: &str) {
        if self.warnings.len() < MAX_WARNINGS {
            self.warnings.push(line.to_owned());
        }
    }
}
