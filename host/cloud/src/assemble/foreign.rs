//! Columns that the host gives no meaning: kept under their own names and types.

use crate::buffer::interleave;
use crate::column::{Column, is_well_known};
use crate::summary::Summary;
use crate::table::Table;
use std::collections::HashSet;

/// Takes all columns that are left. Those of several components, which a file can only hold apart,
/// are put together as the notes of this program's writer say.
pub(super) fn take(table: &mut Table, summary: &mut Summary) -> Vec<Column> {
    let mut columns = Vec::new();
    let notes: Vec<(String, u32)> = table
        .notes("column")
        .filter_map(|words| match words[..] {
            [name, components] => Some((name.to_owned(), components.parse().ok()?)),
            _ => None,
        })
        .collect();
    for (name, components) in notes {
        if let Some(column) = grouped(table, &name, components) {
            columns.push(column);
        }
    }
    let mut names: HashSet<String> = columns.iter().map(|c| c.name().to_owned()).collect();
    for (own_name, buffer) in std::mem::take(&mut table.columns) {
        let mut name = own_name.clone();
        while is_well_known(&name) || names.contains(&name) {
            name.push('_');
        }
        if name != own_name {
            summary.warnings.push(format!(
                "property `{own_name}` does not have the form of the column of that name and was \
                 kept as `{name}`"
            ));
        }
        names.insert(name.clone());
        columns.push(Column::new(name, 1, buffer));
    }
    columns
}

/// A column of several components from the properties `name_0`, `name_1` and so on.
fn grouped(table: &mut Table, name: &str, components: u32) -> Option<Column> {
    let is_part = |own: &str| own.strip_prefix(name).is_some_and(|rest| rest.starts_with('_'));
    let n_candidates = table.columns.iter().filter(|(own, _)| is_part(own)).count();
    if is_well_known(name) || components < 2 || components as usize > n_candidates {
        return None;
    }
    let mut parts = Vec::new();
    let mut places = Vec::new();
    for component in 0..components {
        let wanted = format!("{name}_{component}");
        let place = table.columns.iter().position(|(own, _)| *own == wanted)?;
        parts.push(table.columns[place].1.clone());
        places.push(place);
    }
    let values = interleave(&parts)?;
    let mut index = 0;
    table.columns.retain(|_| {
        index += 1;
        !places.contains(&(index - 1))
    });
    Some(Column::new(name, components, values))
}
