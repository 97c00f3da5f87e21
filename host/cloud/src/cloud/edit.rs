//! What a tool stages in one run: checked edit by edit, committed whole.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::patch::{added, patched};
use crate::cloud::provenance::{CloudEdit, How, ToolRun};
use crate::cloud::roles::can_have;
use crate::error::CloudError;
use glam::DVec3;
use std::sync::Arc;
use surfelshop_api::tool::{ColumnHeader, EditHeader};

/// A cloud and what a run has staged for it so far.
///
/// A run stages columns as often as it likes, a later one of a name in the place of an earlier,
/// then at most one mask; or it stages one new cloud and nothing else. Lengths are those of the
/// cloud that the tool sees. The cloud itself stays as it was.
#[derive(Clone, Debug)]
pub struct StagedEdits {
    source: Cloud,
    cloud: Cloud,
    /// Names of the columns staged.
    columns: Vec<String>,
    whole: Option<How>,
    kept: Option<Vec<bool>>,
    n_added: usize,
}

/// A cloud after a run.
#[derive(Clone, Debug)]
pub struct EditedCloud {
    /// The cloud; what the run did not touch is shared with the one before.
    pub cloud: Cloud,
    /// Names of the columns it made, in the order of the cloud; all where it made the cloud.
    pub columns: Vec<String>,
    /// What it did to the cloud as a whole.
    pub whole: Option<How>,
    /// Which surfels of the cloud before are still there, where some are gone.
    pub kept: Option<Vec<bool>>,
    /// How many surfels were added, behind the others.
    pub n_added: usize,
}

impl StagedEdits {
    /// Nothing yet.
    #[must_use]
    pub fn new(cloud: Cloud) -> Self {
        let (columns, whole, kept, n_added) = Default::default();
        Self { source: cloud.clone(), cloud, columns, whole, kept, n_added }
    }

    /// The cloud that the tool sees.
    #[must_use]
    pub fn source(&self) -> &Cloud {
        &self.source
    }

    /// Takes an edit as it crosses the boundary; the values are little-endian, one slice per
    /// column, or a byte of 0 or 1 per surfel for a mask.
    ///
    /// # Errors
    /// Where it does not fit the cloud or what was staged before; nothing is staged then.
    pub fn stage(&mut self, header: &EditHeader, values: &[&[u8]]) -> Result<(), CloudError> {
        if let Some(whole) = self.whole {
            let before = match whole {
                How::Derived => "a new cloud",
                How::Enlarged => "new surfels",
                How::Kept | How::Stroked => "a mask",
            };
            return Err(wrong("no further edit in this run", format!("one after {before}")));
        }
        match header {
            EditHeader::Columns(headers) => {
                let columns = columns(headers, values)?;
                let columns = columns.iter().map(|column| in_role(column, &self.cloud)).collect();
                self.cloud = self.cloud.with_columns(columns)?;
                self.columns.extend(headers.iter().map(|header| header.name.clone()));
            }
            EditHeader::Keep => {
                let mask = mask(self.source.len(), values)?;
                if mask.contains(&false) {
                    self.cloud = self.cloud.keep(&mask)?;
                    self.whole = Some(How::Kept);
                    self.kept = Some(mask);
                }
            }
            EditHeader::Values(headers) => {
                let (rows, columns) = rows_and_columns(headers, values, self.source.len())?;
                self.cloud = patched(&self.cloud, &rows, &columns)?;
                self.columns.extend(headers.iter().map(|header| header.name.clone()));
            }
            EditHeader::Add(headers) => {
                let (like, columns) = rows_and_columns(headers, values, self.source.len())?;
                if !like.is_empty() {
                    self.cloud = added(&self.cloud, &like, &columns)?;
                    (self.whole, self.n_added) = (Some(How::Enlarged), like.len());
                }
            }
            EditHeader::NewCloud { .. } if !self.columns.is_empty() => {
                let expected = "a new cloud alone, with all its columns";
                return Err(wrong(expected, "one after columns of this cloud".to_owned()));
            }
            EditHeader::NewCloud { origin, columns: headers } => {
                self.cloud = new_cloud(*origin, headers, values, &self.source)?;
                self.whole = Some(How::Derived);
            }
        }
        Ok(())
    }

    /// The cloud with everything that was staged, noted as the work of this run; `None` where
    /// nothing was.
    #[must_use]
    pub fn commit(self, made: ToolRun) -> Option<EditedCloud> {
        let Self { source, cloud, columns, whole, kept, n_added } = self;
        if columns.is_empty() && whole.is_none() {
            return None;
        }
        let made = Arc::new(made);
        let is_new =
            |name: &str| whole == Some(How::Derived) || columns.iter().any(|column| column == name);
        let note = |column: &Column| match is_new(column.name()) {
            true => column.made_by(Some(made.clone())),
            false => column.clone(),
        };
        let noted = cloud.with_origin(cloud.origin(), cloud.columns().iter().map(note).collect());
        let names = cloud.columns().iter().map(Column::name).filter(|name| is_new(name));
        let columns = names.map(str::to_owned).collect();
        let mut history = source.history().to_vec();
        history.extend(whole.map(|how| {
            let (n_surfels, n_before) = (cloud.len() as u64, source.len() as u64);
            CloudEdit { how, n_surfels, n_before, made: made.clone() }
        }));
        Some(EditedCloud { cloud: noted.with_history(history), columns, whole, kept, n_added })
    }
}

fn wrong(expected: impl Into<String>, found: String) -> CloudError {
    CloudError::Edit { expected: expected.into(), found }
}

/// The columns of an edit.
fn columns(headers: &[ColumnHeader], values: &[&[u8]]) -> Result<Vec<Column>, CloudError> {
    if headers.len() != values.len() {
        let found = format!("{} for {} columns", values.len(), headers.len());
        return Err(wrong("as many arrays of values as columns", found));
    }
    let column = |(header, bytes): (&ColumnHeader, &&[u8])| {
        let ColumnHeader { name, components, element } = header;
        if bytes.len() % element.size() != 0 {
            let expected = format!("whole numbers of type {} for `{name}`", element.name());
            return Err(wrong(expected, format!("{} bytes", bytes.len())));
        }
        let values = Buffer::from_little_endian(*element, bytes);
        Ok(Column::new(name.as_str(), *components, values))
    };
    let columns: Vec<Column> = headers.iter().zip(values).map(column).collect::<Result<_, _>>()?;
    let twice = |(i, column): &(usize, &Column)| {
        columns[..*i].iter().any(|earlier| earlier.name() == column.name())
    };
    match columns.iter().enumerate().find(twice) {
        Some((_, column)) => Err(CloudError::Twice { column: column.name().to_owned() }),
        None => Ok(columns),
    }
}

/// Places of surfels that a tool was given, and the columns of these.
fn rows_and_columns(
    headers: &[ColumnHeader],
    values: &[&[u8]],
    n_given: usize,
) -> Result<(Vec<u32>, Vec<Column>), CloudError> {
    let Some((rows, values)) = values.split_first() else {
        return Err(wrong("places of surfels before their values", "none".to_owned()));
    };
    let (words, rest) = rows.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(wrong("places of four bytes each", format!("{} bytes", rows.len())));
    }
    let rows: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    if let Some(row) = rows.iter().find(|row| **row as usize >= n_given) {
        let expected = format!("answers for the {n_given} surfels that it was given");
        return Err(wrong(expected, format!("one for surfel {row}")));
    }
    let columns = columns(headers, values)?;
    for column in &columns {
        let expected = rows.len() as u64 * u64::from(column.components());
        let found = column.values().len();
        if found as u64 != expected {
            let column = column.name().to_owned();
            return Err(CloudError::Length { column, expected, found });
        }
    }
    Ok((rows, columns))
}

/// A mask with an entry for each surfel.
fn mask(n_surfels: usize, values: &[&[u8]]) -> Result<Vec<bool>, CloudError> {
    let [bytes] = values else {
        return Err(wrong("one array of bytes for a mask", values.len().to_string()));
    };
    if bytes.len() != n_surfels {
        return Err(CloudError::Mask { expected: n_surfels, found: bytes.len() });
    }
    if let Some((surfel, byte)) = bytes.iter().enumerate().find(|(_, byte)| **byte > 1) {
        return Err(wrong("0 or 1 in a mask", format!("{byte} for surfel {surfel}")));
    }
    Ok(bytes.iter().map(|&byte| byte == 1).collect())
}

fn new_cloud(
    origin: DVec3,
    headers: &[ColumnHeader],
    values: &[&[u8]],
    source: &Cloud,
) -> Result<Cloud, CloudError> {
    let columns = columns(headers, values)?;
    Cloud::new(origin, columns.iter().map(|column| in_role(column, source)).collect())
}

/// A new column in the role of one of its name that is there, where it can have it.
fn in_role(column: &Column, cloud: &Cloud) -> Column {
    let (element, components) = (column.values().element(), column.components());
    let known = cloud.column(column.name());
    let known = known.filter(|known| can_have(known.role(), element, components));
    known.map_or_else(|| column.clone(), |known| column.with_role(known.role()))
}
