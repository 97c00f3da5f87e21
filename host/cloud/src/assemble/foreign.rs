//! Custom columns, which the host gives no meaning: kept under their own names and types.

use crate::cloud::buffer::{Buffer, interleave};
use crate::cloud::column::{Column, has_fixed_type};
use crate::summary::Summary;
use crate::table::Table;
use std::collections::{HashMap, HashSet};

/// Takes all columns that are left. Those of several components, which a file can only hold apart,
/// are put together as the notes of this program's writer say.
///
/// Names that are `taken` are given to none of them.
pub(super) fn take(table: &mut Table, taken: &[Column], summary: &mut Summary) -> Vec<Column> {
    let notes: Vec<(String, u32)> = table
        .notes("column")
        .filter_map(|words| match words[..] {
            [name, components] => Some((name.to_owned(), components.parse().ok()?)),
            _ => None,
        })
        .collect();
    table.split(|_| true);
    let mut names: HashSet<String> = taken.iter().map(|c| c.name().to_owned()).collect();
    let mut columns = grouped(table, &notes, &names);
    names.extend(columns.iter().map(|c| c.name().to_owned()));
    for mut field in std::mem::take(&mut table.fields) {
        let Some(own_name) = field.names.pop() else { continue };
        let mut name = own_name.clone();
        while has_fixed_type(&name) || names.contains(&name) {
            name.push('_');
        }
        if name != own_name {
            summary.warnings.push(format!(
                "property `{own_name}` does not have the form of the column of that name and was \
                 kept as `{name}`"
            ));
        }
        names.insert(name.clone());
        columns.push(table.in_role(Column::new(name, 1, field.values)));
    }
    columns
}

/// Columns of several components from properties `name_0`, `name_1` and so on.
///
/// No field is woven any more. A property belongs to one name only and each name is looked up once, so that a header full of
/// notes takes no more time than a header full of properties.
fn grouped(
    table: &mut Table,
    notes: &[(String, u32)],
    taken_names: &HashSet<String>,
) -> Vec<Column> {
    let places: HashMap<String, usize> =
        table.names().enumerate().map(|(place, name)| (name.to_owned(), place)).collect();
    let mut taken = vec![false; table.fields.len()];
    let mut seen = HashSet::new();
    let mut columns = Vec::new();
    for (name, components) in notes {
        let is_usable = !has_fixed_type(name) && !taken_names.contains(name);
        if !is_usable || *components < 2 || !seen.insert(name.as_str()) {
            continue;
        }
        let parts: Option<Vec<usize>> = (0..*components)
            .map(|component| places.get(&format!("{name}_{component}")).copied())
            .collect();
        let Some(parts) = parts else { continue };
        let values: Vec<Buffer> = parts.iter().map(|&p| table.fields[p].values.clone()).collect();
        if let Some(values) = interleave(&values) {
            parts.iter().for_each(|&place| taken[place] = true);
            columns.push(table.in_role(Column::new(name.as_str(), *components, values)));
        }
    }
    let mut taken = taken.into_iter();
    table.fields.retain(|_| !taken.next().unwrap_or(false));
    columns
}
