//! Values of some surfels in the place of others, and surfels behind those that are there.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::changes;
use crate::cloud::column::Column;
use crate::error::CloudError;
use crate::memory::ask;
use std::collections::HashSet;
use surfelshop_api::columns::{AO, COLOR, Element, NEUTRAL_ALBEDO};
use surfelshop_api::params::linear_to_srgb;

impl Buffer {
    /// So many zeros.
    pub(crate) fn zeros(element: Element, len: usize) -> Self {
        match element {
            Element::I8 => Self::I8(vec![0; len]),
            Element::U8 => Self::U8(vec![0; len]),
            Element::I16 => Self::I16(vec![0; len]),
            Element::U16 => Self::U16(vec![0; len]),
            Element::I32 => Self::I32(vec![0; len]),
            Element::U32 => Self::U32(vec![0; len]),
            Element::F32 => Self::F32(vec![0.0; len]),
            Element::F64 => Self::F64(vec![0.0; len]),
        }
    }

    /// Sets elements, each of which must be there, to a number; whether it fits the type, and is finite.
    pub(crate) fn set_all(&mut self, places: impl Iterator<Item = usize>, value: f64) -> bool {
        let mut one = Self::with_capacity(self.element(), 1);
        if !one.push(value) || !value.is_finite() {
            return false;
        }
        macro_rules! set {
            ($($variant:ident),*) => {
                match (self, one) {
                    $((Self::$variant(values), Self::$variant(one)) => {
                        places.for_each(|place| values[place] = one[0]);
                        true
                    })*
                    _ => false,
                }
            };
        }
        set!(I8, U8, I16, U16, I32, U32, F32, F64)
    }

    /// Puts values of as many surfels as there are rows in the place of theirs, and returns the rows whose values
    /// differ from before, bit by bit. Both are of one type; each row must be there.
    pub(crate) fn scatter(&mut self, components: usize, rows: &[u32], new: &Self) -> Vec<u32> {
        let mut changed = Vec::new();
        macro_rules! scatter {
            ($($variant:ident),*) => {
                match (self, new) {
                    $((Self::$variant(values), Self::$variant(new)) => {
                        for (row, new) in rows.iter().zip(new.chunks_exact(components)) {
                            let first = *row as usize * components;
                            let old = &mut values[first..first + components];
                            let same = |(a, b): (&_, &_)| bytemuck::bytes_of(a) == bytemuck::bytes_of(b);
                            if !old.iter().zip(new).all(same) {
                                old.copy_from_slice(new);
                                changed.push(*row);
                            }
                        }
                    })*
                    _ => {}
                }
            };
        }
        scatter!(I8, U8, I16, U16, I32, U32, F32, F64);
        changed
    }
}

impl Column {
    /// The column with the values of another one, of its type and with as many surfels as there are rows, in these
    /// rows, each of which must be there; itself where nothing differs.
    pub(crate) fn patched(&self, rows: &[u32], new: &Self) -> Result<Self, CloudError> {
        same_type(self, new)?;
        let bytes = self.values().len() * self.values().element().size();
        ask(bytes as u64).map_err(CloudError::Memory)?;
        let mut values = self.values().clone();
        let mut changed = values.scatter(self.components() as usize, rows, new.values());
        if changed.is_empty() {
            return Ok(self.clone());
        }
        let patched = self.with_values(values);
        changed.sort_unstable();
        changes::note(self.generation(), patched.generation(), changed.into());
        Ok(patched)
    }

    /// The column with the values of another one behind its own.
    pub(crate) fn followed_by(&self, more: &Self) -> Result<Self, CloudError> {
        same_type(self, more)?;
        let len = self.values().len() + more.values().len();
        let mut values =
            Buffer::with_room(self.values().element(), len).map_err(CloudError::Memory)?;
        for part in [self, more] {
            values.append(&part.values().as_values()).map_err(CloudError::Memory)?;
        }
        Ok(self.with_values(values))
    }

    /// A column of this name and type for so many surfels of which nobody said anything: neutral colours, surfels that
    /// nothing hides, and else zeros.
    pub(crate) fn unsaid(&self, len: usize) -> Result<Self, CloudError> {
        let components = self.components() as usize;
        let (n, element) = (len * components, self.values().element());
        ask((n * element.size()) as u64).map_err(CloudError::Memory)?;
        let mut values = Buffer::zeros(element, n);
        let mut fill = |component: usize, value: f64| {
            values.set_all((component..n).step_by(components), value);
        };
        match (self.name(), element) {
            (AO, _) => fill(0, 1.0),
            (COLOR, Element::F32) => {
                (0..3).for_each(|i| fill(i, f64::from(NEUTRAL_ALBEDO[i])));
                (3..components).for_each(|i| fill(i, 1.0));
            }
            (COLOR, _) => {
                let most = if element == Element::U8 { 255.0 } else { 65535.0 };
                let code = |i: usize| (most * f64::from(linear_to_srgb(NEUTRAL_ALBEDO[i]))).round();
                (0..3).for_each(|i| fill(i, code(i)));
                (3..components).for_each(|i| fill(i, most));
            }
            _ => {}
        }
        Ok(self.with_values(values))
    }
}

fn same_type(column: &Column, new: &Column) -> Result<(), CloudError> {
    let of = |column: &Column| (column.components(), column.values().element());
    if of(column) == of(new) {
        return Ok(());
    }
    let words =
        |(components, element): (u32, Element)| format!("{components} x {}", element.name());
    let (expected, found) = (words(of(column)), words(of(new)));
    Err(CloudError::Type { column: column.name().to_owned(), expected, found })
}

fn there<'a>(cloud: &'a Cloud, name: &str) -> Result<&'a Column, CloudError> {
    cloud.column(name).ok_or_else(|| CloudError::Edit {
        expected: "values of columns that are there".to_owned(),
        found: format!("some of `{name}`"),
    })
}

/// The cloud with other values in some rows, each of which is there.
pub(super) fn patched(cloud: &Cloud, rows: &[u32], new: &[Column]) -> Result<Cloud, CloudError> {
    let mut known = HashSet::with_capacity(rows.len());
    if let Some(row) = rows.iter().find(|row| !known.insert(**row)) {
        let expected = "one answer for each surfel".to_owned();
        return Err(CloudError::Edit { expected, found: format!("two for surfel {row}") });
    }
    let column = |new: &Column| there(cloud, new.name())?.patched(rows, new);
    cloud.with_columns(new.iter().map(column).collect::<Result<_, _>>()?)
}

/// The cloud with surfels behind its own: each like one of it but for some columns.
pub(super) fn added(cloud: &Cloud, like: &[u32], new: &[Column]) -> Result<Cloud, CloudError> {
    if let Some(unknown) = new.iter().find(|new| cloud.column(new.name()).is_none()) {
        there(cloud, unknown.name())?;
    }
    let longer = |column: &Column| match new.iter().find(|new| new.name() == column.name()) {
        Some(new) => column.followed_by(new),
        None => column.followed_by(&column.gather(like).map_err(CloudError::Memory)?),
    };
    let columns: Vec<Column> = cloud.columns().iter().map(longer).collect::<Result<_, _>>()?;
    enlarged(cloud, columns)
}

/// The cloud with columns that have its surfels and others behind them.
pub(super) fn enlarged(cloud: &Cloud, columns: Vec<Column>) -> Result<Cloud, CloudError> {
    let position = columns.iter().find(|column| column.name() == surfelshop_api::columns::POSITION);
    let len = position.ok_or(CloudError::NoPosition)?.values().len() / 3;
    columns.iter().try_for_each(|column| column.check(len))?;
    Ok(cloud.with_rows(columns, len, cloud.faces().to_vec()))
}
