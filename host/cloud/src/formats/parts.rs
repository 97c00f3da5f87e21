//! Clouds of a file as far as they were read, and all of them as one.

use crate::cloud::buffer::Buffer;
use crate::cloud::roles::{Motion, role_in_file};
use crate::cloud::source::Source;
use crate::error::ReadFault;
use crate::memory;
use glam::{DQuat, DVec3};
use std::collections::HashSet;
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, Role, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudHeader, FileColumn, SCAN};

/// One cloud of a file as far as it was read.
pub(super) struct Part {
    pub(super) header: CloudHeader,
    pub(super) columns: Vec<Buffer>,
    pub(super) n_rows: usize,
    pub(super) faces: Vec<[u32; 3]>,
}

/// What the headers say of all clouds together, and the grid of a cloud that is alone.
pub(super) fn source(parts: &[Part]) -> Source {
    let grid = match parts {
        [only] => {
            only.header.grid.filter(|[w, h]| u64::from(*w) * u64::from(*h) == only.n_rows as u64)
        }
        _ => None,
    };
    Source { grid, ..Source::of_headers(parts.iter().map(|part| &part.header)) }
}

/// The direction from rows to those above them, in the mean over the grid.
pub(super) fn grid_up([width, height]: [u32; 2], positions: &Buffer) -> Option<DVec3> {
    // Rows that are compared, far enough apart that noise does not count.
    let step = (height / 16).max(1) as usize;
    let (width, height) = (width as usize, height as usize);
    let point = |row: usize, column: usize| {
        let start = 3 * (row * width + column);
        let number = |axis: usize| positions.get_f64(start + axis).unwrap_or(f64::NAN);
        DVec3::new(number(0), number(1), number(2))
    };
    let mut sum = DVec3::ZERO;
    for row in (step..height).step_by(step) {
        for column in (0..width).step_by((width / 64).max(1)) {
            let up = (point(row - step, column) - point(row, column)).normalize_or_zero();
            // What has no number, and what lies in one place, does not count.
            sum += if up.is_finite() { up } else { DVec3::ZERO };
        }
    }
    sum.try_normalize()
}

/// Moves positions and directions by the pose.
pub(super) fn move_columns(header: &CloudHeader, columns: &mut [Buffer]) {
    let motion = Motion::new(header.pose.rotation, 1.0);
    for (column, values) in header.columns.iter().zip(columns) {
        match column.name.as_str() {
            POSITION => {
                let wide: Vec<f64> = values.iter_f64().collect();
                let (points, _) = wide.as_chunks::<3>();
                let moved = points.iter().map(|p| header.pose.place(DVec3::from_array(*p)));
                *values = Buffer::F64(moved.flat_map(|point| point.to_array()).collect());
            }
            NORMAL | TANGENT_U | TANGENT_V => turn(values, header.pose.rotation),
            _ => turn_by_role(column, values, &motion),
        }
    }
}

/// Turns what its role says; a header whose columns cannot be turned was refused.
pub(crate) fn turn_by_role(column: &FileColumn, values: &mut Buffer, motion: &Motion) {
    let what = (column.name.as_str(), role_in_file(column), column.components);
    if let Ok(Some(turned)) = motion.moved(what, values) {
        *values = turned;
    }
}

pub(crate) fn turn(values: &mut Buffer, rotation: DQuat) {
    if rotation == DQuat::IDENTITY {
        return;
    }
    let mut turned = Buffer::F32(values.to_f32());
    if let Buffer::F32(values) = &mut turned {
        for direction in values.as_chunks_mut::<3>().0 {
            let turned = rotation * DVec3::from_array(direction.map(f64::from));
            *direction = turned.as_vec3().to_array();
        }
    }
    *values = turned;
}

/// All clouds as one in common coordinates, with a column of their numbers.
pub(super) fn merged(parts: Vec<Part>, warnings: &mut Vec<String>) -> Result<Part, ReadFault> {
    let n_rows: usize = parts.iter().map(|part| part.n_rows).sum();
    if n_rows > u32::MAX as usize {
        return Err(ReadFault::TooMany { found: n_rows as u64 });
    }
    let mut columns: Vec<FileColumn> = Vec::new();
    for part in &parts {
        // Numbers of scans that a file has by itself give way to those of its clouds.
        for column in part.header.columns.iter().filter(|column| column.name != SCAN) {
            match columns.iter_mut().find(|known| known.name == column.name) {
                None => columns.push(column.clone()),
                Some(known) => *known = common(known, column),
            }
        }
    }
    // Positions have f64 once they are moved.
    for column in columns.iter_mut().filter(|column| column.name == POSITION) {
        column.element = Element::F64;
    }
    let bytes: usize = columns.iter().map(FileColumn::point_bytes).sum();
    memory::ask((n_rows as u64).saturating_mul(bytes as u64)).map_err(ReadFault::memory(n_rows))?;
    let out = ReadFault::memory;
    let mut values = Vec::with_capacity(columns.len());
    for column in &columns {
        let n = n_rows.saturating_mul(column.components as usize);
        values.push(Buffer::with_room(column.element, n).map_err(out(n_rows))?);
    }
    let mut scan: Vec<u16> = memory::with_room(n_rows).map_err(out(n_rows))?;
    let (mut faces, mut before, mut filled) = (Vec::new(), 0u32, HashSet::new());
    let format = parts.first().map(|part| part.header.format.clone()).unwrap_or_default();
    for (number, mut part) in parts.into_iter().enumerate() {
        move_columns(&part.header, &mut part.columns);
        for (column, values) in columns.iter().zip(&mut values) {
            let found = part.header.column(&column.name).map(|(place, _)| &part.columns[place]);
            let n = part.n_rows * column.components as usize;
            let fits = found.is_some_and(|found| found.len() == n && push_all(values, found));
            if !fits {
                let missing = n * usize::from(found.is_none());
                (0..missing).for_each(|_| {
                    values.push(absent(column));
                });
                filled.insert(column.name.clone());
            }
        }
        scan.extend(std::iter::repeat_n(number as u16, part.n_rows));
        faces.extend(part.faces.iter().map(|face| face.map(|i| i.saturating_add(before))));
        before = before.saturating_add(part.n_rows as u32);
    }
    let mut filled: Vec<String> = filled.into_iter().collect();
    filled.sort();
    if !filled.is_empty() {
        warnings.push(format!("not every cloud of the file has {}", filled.join(", ")));
    }
    columns.push(FileColumn::new(SCAN, 1, Element::U16));
    values.push(Buffer::U16(scan));
    let header = CloudHeader { format, columns, ..CloudHeader::default() };
    Ok(Part { header, columns: values, n_rows, faces })
}

/// Appends all values; whether each fits.
fn push_all(values: &mut Buffer, found: &Buffer) -> bool {
    let mut fits = true;
    for value in found.iter_f64() {
        fits &= values.push(value);
    }
    fits
}

/// A column that holds the values of both.
fn common(a: &FileColumn, b: &FileColumn) -> FileColumn {
    let element = if a.element == b.element { a.element } else { Element::F64 };
    let role = if a.role == b.role { a.role } else { Role::Plain };
    FileColumn { element, components: a.components.max(b.components), role, ..a.clone() }
}

/// What stands where a cloud does not have a column: no number, or zero of whole ones and of spherical harmonics, which
/// vanish beyond a cloud's order; white of colours.
pub(crate) fn absent(column: &FileColumn) -> f64 {
    match (column.name.as_str(), column.element) {
        (COLOR, Element::U8) => 188.0,
        (COLOR, Element::U16) => 48_316.0,
        (COLOR, _) => 0.5,
        _ if matches!(column.role, Role::SphericalHarmonics(_)) => 0.0,
        (_, Element::F32 | Element::F64) => f64::NAN,
        _ => 0.0,
    }
}
