//! What is done with selected surfels.

use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::changes;
use crate::cloud::column::{Column, usual_type};
use crate::memory::ask;
use surfelshop_api::columns::{Element, RADIUS};

fn checked(cloud: &Cloud, selection: &Selection) -> Result<usize, SelectionError> {
    if selection.len() != cloud.len() {
        let (expected, found) = (cloud.len(), selection.len());
        return Err(SelectionError::Length { expected, found });
    }
    match selection.count() {
        0 => Err(SelectionError::Nothing),
        n => Ok(n),
    }
}

/// The cloud without what is selected.
///
/// # Errors
/// Where nothing is selected or everything is, or the selection is of another cloud.
pub fn deleted(cloud: &Cloud, selection: &Selection) -> Result<Cloud, SelectionError> {
    if checked(cloud, selection)? == cloud.len() {
        return Err(SelectionError::Everything { len: cloud.len() });
    }
    Ok(cloud.keep(&selection.inverted().mask())?)
}

/// The cloud of what is selected.
///
/// # Errors
/// Where nothing is selected, or the selection is of another cloud.
pub fn extracted(cloud: &Cloud, selection: &Selection) -> Result<Cloud, SelectionError> {
    checked(cloud, selection)?;
    Ok(cloud.keep(&selection.mask())?)
}

/// The cloud with these values, one for each component, in a column of what is selected. A column that is not there is
/// made: of its usual type, else of bytes where all values are whole numbers to 255, and else of f32; what is not
/// selected has neutral colours, full accessibility and else 0 in it.
///
/// # Errors
/// Where nothing is selected, a value does not fit the column, or there is no memory.
pub fn with_value(
    cloud: &Cloud,
    selection: &Selection,
    name: &str,
    values: &[f64],
) -> Result<Cloud, SelectionError> {
    checked(cloud, selection)?;
    set_column(cloud, selection, name, values)
}

/// The same where nothing may be selected; a column that is not there is made then, too.
///
/// # Errors
/// Where a value does not fit the column, or there is no memory.
pub fn set_column(
    cloud: &Cloud,
    selection: &Selection,
    name: &str,
    values: &[f64],
) -> Result<Cloud, SelectionError> {
    let wrong = |expected: String, found: String| SelectionError::Value {
        column: name.to_owned(),
        expected,
        found,
    };
    let (before, components) = match cloud.column(name) {
        Some(column) => (Some(column), column.components() as usize),
        None => (None, values.len()),
    };
    if name == RADIUS
        && let Some(found) =
            values.iter().find(|value| !(value.is_finite() && **value as f32 > 0.0))
    {
        return Err(wrong("a radius above 0".to_owned(), found.to_string()));
    }
    if values.len() != components || components == 0 {
        let plural = if components == 1 { "" } else { "s" };
        return Err(wrong(format!("{components} value{plural}"), values.len().to_string()));
    }
    let bytes = |element: Element| (cloud.len() * components * element.size()) as u64;
    let buffer = match before {
        Some(column) => {
            ask(bytes(column.values().element()))?;
            column.values().clone()
        }
        None => {
            let are_bytes = values.iter().all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(v));
            let element =
                usual_type(name).unwrap_or(if are_bytes { Element::U8 } else { Element::F32 });
            ask(bytes(element))?;
            Column::new(name, components as u32, Buffer::zeros(element, 0))
                .unsaid(cloud.len())?
                .values()
                .clone()
        }
    };
    let element = buffer.element();
    let mut buffer = buffer;
    for (component, value) in values.iter().enumerate() {
        let fits = buffer.set_all(selection.indices().map(|i| i * components + component), *value);
        if !fits {
            return Err(wrong(format!("a number of type {}", element.name()), value.to_string()));
        }
    }
    let column = match before {
        Some(column) => {
            let changed = column.with_values(buffer);
            let rows = selection.indices().filter_map(|i| u32::try_from(i).ok()).collect();
            changes::note(column.generation(), changed.generation(), rows);
            changed
        }
        None => Column::new(name, components as u32, buffer),
    };
    Ok(cloud.with_columns(vec![column])?)
}
