//! Clouds in a module's memory: copied in, since a module sees no other memory than its own.

use crate::instance::Instance;
use crate::layout::{CLOUD_LEN, COLUMN_LEN, Written};
use crate::stop::Stop;
use surfelshop_api::CloudView;
use surfelshop_api::columns::Values;

const _: () = assert!(cfg!(target_endian = "little"), "columns are copied as they lie in memory");

/// Where parts of a cloud begin: at multiples of the largest element.
const ALIGNMENT: usize = 8;

/// The elements of a column as bytes.
fn bytes<'a>(values: &Values<'a>) -> &'a [u8] {
    match *values {
        Values::I8(values) => bytemuck::cast_slice(values),
        Values::U8(values) => values,
        Values::I16(values) => bytemuck::cast_slice(values),
        Values::U16(values) => bytemuck::cast_slice(values),
        Values::I32(values) => bytemuck::cast_slice(values),
        Values::U32(values) => bytemuck::cast_slice(values),
        Values::F32(values) => bytemuck::cast_slice(values),
        Values::F64(values) => bytemuck::cast_slice(values),
    }
}

/// How many bytes a cloud takes in a module's memory, the structure that names it left out.
pub(crate) fn len_of(cloud: &CloudView<'_>) -> usize {
    let column = |values: &[u8], name: &str| {
        COLUMN_LEN
            + values.len().next_multiple_of(ALIGNMENT)
            + name.len().next_multiple_of(ALIGNMENT)
    };
    let columns = cloud.columns.iter().map(|c| column(bytes(&c.values), c.name)).sum::<usize>();
    columns + size_of_val(cloud.faces)
}

/// A length or an address, which a module's memory has as 32 bits.
fn word(value: usize) -> Result<u32, Stop> {
    u32::try_from(value).map_err(|_beyond| {
        Stop::Impossible(format!("{value} is more than a sandboxed plugin can count to"))
    })
}

impl Instance {
    /// Copies a cloud to an address with room for it, and returns the structure that names it.
    pub(crate) fn put_cloud(&mut self, cloud: &CloudView<'_>, at: u32) -> Result<Vec<u8>, Stop> {
        let mut free = at as usize + cloud.columns.len() * COLUMN_LEN;
        let mut columns = Written::default();
        let mut put = |instance: &mut Self, part: &[u8]| -> Result<u32, Stop> {
            let address = word(free)?;
            instance.put(address, part)?;
            free += part.len().next_multiple_of(ALIGNMENT);
            Ok(address)
        };
        for column in &cloud.columns {
            let name = put(self, column.name.as_bytes())?;
            let values = put(self, bytes(&column.values))?;
            columns = columns
                .u32s([name, word(column.name.len())?])
                .u32s([column.values.element() as u32, column.components])
                .u64(column.generation)
                .u32s([values, word(column.values.len())?]);
        }
        let faces = put(self, bytemuck::cast_slice(cloud.faces))?;
        self.put(at, &columns.bytes())?;
        let object = &cloud.object;
        let written = Written::default()
            .f64s(cloud.origin.to_array())
            .u32s([word(cloud.len)?, at, word(cloud.columns.len())?])
            .u32s([faces, word(cloud.faces.len())?, 0])
            .f64s(object.center.to_array())
            .f64s([object.size])
            .f64s(object.rotation.to_array());
        let bytes = written.bytes();
        debug_assert_eq!(bytes.len(), CLOUD_LEN, "the structure as C lays it out");
        Ok(bytes)
    }
}
