//! Surfels that are hidden one by one, which no filter tells from others.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::selection::{Selection, SelectionError};
use crate::memory::with_room;

/// The column that says which surfels are hidden, one byte each. It belongs to a scene, and no file of a cloud has it.
pub const HIDDEN: &str = "hidden_surfels";

/// The cloud with other surfels hidden; with none where the selection is empty. Nothing else of it changes, and its
/// columns are shared.
///
/// # Errors
/// Where the selection is of another number of surfels, all would be hidden, or there is no memory.
pub fn hiding(cloud: &Cloud, hidden: &Selection) -> Result<Cloud, SelectionError> {
    let (expected, found) = (cloud.len(), hidden.len());
    if expected != found {
        return Err(SelectionError::Length { expected, found });
    }
    if hidden.is_empty() {
        return Ok(cloud.displayed_without(HIDDEN));
    }
    if hidden.count() == cloud.len() {
        return Err(SelectionError::Everything { len: cloud.len() });
    }
    let mut values = with_room(cloud.len())?;
    values.extend((0..cloud.len()).map(|index| u8::from(hidden.contains(index))));
    Ok(cloud.displayed_with(Column::new(HIDDEN, 1, Buffer::U8(values))))
}

/// The cloud as its file has it: all surfels are shown.
#[must_use]
pub fn unhidden(cloud: &Cloud) -> Cloud {
    cloud.displayed_without(HIDDEN)
}

/// Which surfels of a cloud are hidden; `None` where none is.
///
/// # Errors
/// Where there is no memory.
pub fn hidden(cloud: &Cloud) -> Result<Option<Selection>, SelectionError> {
    let Some(values) = values(cloud) else { return Ok(None) };
    Selection::of(cloud.len(), |index| values[index] != 0).map(Some)
}

/// The bytes of the column, where it is what it should be.
pub(super) fn values(cloud: &Cloud) -> Option<&[u8]> {
    let column = cloud.column(HIDDEN)?;
    match column.values() {
        Buffer::U8(values) if values.len() == cloud.len() => Some(values),
        _ => None,
    }
}
