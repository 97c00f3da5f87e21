//! What formats put their clouds into: headers and batches of bytes are checked, and passed on as typed columns.

use super::MAX_ERROR_BYTES;
use super::outputs::one_line;
use surfelshop_api::columns::{Element, Values as ColumnValues};
use surfelshop_api::format::{CloudHeader, CloudSinkHost};

/// Most bytes of the header of a cloud; coordinate systems and comments take a few thousand.
const MAX_HEADER_BYTES: usize = 128 << 20;

/// Columns of a cloud that are taken.
pub(super) const MAX_COLUMNS: usize = 4096;

/// A sink of clouds as it is lent to a format.
pub(crate) struct LentSink<'a> {
    host: &'a mut dyn CloudSinkHost,
    header: Option<CloudHeader>,
    /// Columns whose bytes a plugin passed at an address that is none of their type.
    aligned: Vec<Vec<u64>>,
}

impl<'a> LentSink<'a> {
    pub(crate) fn new(host: &'a mut dyn CloudSinkHost) -> Self {
        Self { host, header: None, aligned: Vec::new() }
    }

    pub(super) fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        if header.len() > MAX_HEADER_BYTES {
            let found = header.len();
            return Err(format!(
                "a header has {found} bytes, at most {MAX_HEADER_BYTES} are taken"
            ));
        }
        let header: CloudHeader = rmp_serde::from_slice(header)
            .map_err(|error| format!("the header of a cloud is unreadable: {error}"))?;
        if header.columns.len() > MAX_COLUMNS {
            let found = header.columns.len();
            return Err(format!("a cloud has {found} columns, at most {MAX_COLUMNS} are taken"));
        }
        let wanted = self.host.begin(&header).map_err(|error| error.to_string())?;
        self.header = Some(header);
        Ok(wanted)
    }

    pub(super) fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        let Some(header) = &self.header else {
            return Err("a batch came before the header of its cloud".to_owned());
        };
        if columns.len() != header.columns.len() {
            let (expected, found) = (header.columns.len(), columns.len());
            return Err(format!("a batch: expected {expected} columns, found {found}"));
        }
        self.aligned.clear();
        self.aligned.resize_with(columns.len(), Vec::new);
        let mut values = Vec::with_capacity(columns.len());
        for ((column, &bytes), aligned) in header.columns.iter().zip(columns).zip(&mut self.aligned)
        {
            let size = column.element.size();
            if !bytes.len().is_multiple_of(size) {
                return Err(format!(
                    "column `{}` of a batch: expected whole values of {size} bytes, found {} bytes",
                    column.name,
                    bytes.len()
                ));
            }
            values.push(typed(column.element, bytes, aligned));
        }
        self.host.batch(&values).map_err(|error| error.to_string())
    }

    pub(super) fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        self.host.faces(triangles).map_err(|error| error.to_string())
    }

    pub(super) fn warn(&mut self, line: &[u8]) {
        let text = String::from_utf8_lossy(&line[..line.len().min(MAX_ERROR_BYTES)]);
        self.host.warn(&one_line(&text));
    }
}

/// Bytes as values of a type; copied where their address is none of its.
fn typed<'a>(element: Element, bytes: &'a [u8], aligned: &'a mut Vec<u64>) -> ColumnValues<'a> {
    let bytes = if bytes.as_ptr().align_offset(element.size()) == 0 {
        bytes
    } else {
        aligned.resize(bytes.len().div_ceil(8), 0);
        let copy = bytemuck::cast_slice_mut(aligned.as_mut_slice());
        let copy: &mut [u8] = &mut copy[..bytes.len()];
        copy.copy_from_slice(bytes);
        &*copy
    };
    of_aligned(element, bytes)
}

/// Bytes at an address that is a multiple of 8, as values of a type.
pub(crate) fn of_aligned(element: Element, bytes: &[u8]) -> ColumnValues<'_> {
    match element {
        Element::I8 => ColumnValues::I8(bytemuck::cast_slice(bytes)),
        Element::U8 => ColumnValues::U8(bytes),
        Element::I16 => ColumnValues::I16(bytemuck::cast_slice(bytes)),
        Element::U16 => ColumnValues::U16(bytemuck::cast_slice(bytes)),
        Element::I32 => ColumnValues::I32(bytemuck::cast_slice(bytes)),
        Element::U32 => ColumnValues::U32(bytemuck::cast_slice(bytes)),
        Element::F32 => ColumnValues::F32(bytemuck::cast_slice(bytes)),
        Element::F64 => ColumnValues::F64(bytemuck::cast_slice(bytes)),
    }
}
