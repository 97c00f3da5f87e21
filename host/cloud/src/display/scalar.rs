//! The numbers of an attribute, read in blocks as f64 whatever type they have.

use super::error::DisplayError;
use super::keys::ScalarKey;
use super::settings::Attribute;
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::buffer::{Buffer, with_vec};
use rayon::prelude::*;
use surfelshop_api::columns::{Element, POSITION};

/// Numbers read at a time.
pub(super) const BLOCK: usize = 4096;

/// A number for each surfel of a cloud.
pub(super) struct Scalar<'a> {
    values: &'a Buffer,
    components: usize,
    component: usize,
    /// What is added to each.
    offset: f64,
    /// What each is multiplied by then: 1 or -1.
    sign: f64,
    generation: u64,
}

impl<'a> Scalar<'a> {
    /// The numbers of an attribute; `None` where the cloud lacks it.
    ///
    /// # Errors
    /// Where the column has fewer components.
    pub(super) fn of(
        cloud: &'a Cloud,
        attribute: &Attribute,
        up: Axis,
    ) -> Result<Option<Self>, DisplayError> {
        let (name, component, offset, sign) = match attribute {
            Attribute::Height => {
                let axis = up.index();
                (POSITION, axis as u32, cloud.origin()[axis], up.sign())
            }
            Attribute::Column { name, component } => (name.as_str(), *component, 0.0, 1.0),
        };
        let Some(column) = cloud.column(name) else { return Ok(None) };
        let (column_name, components) = (name.to_owned(), column.components());
        if component >= components {
            return Err(DisplayError::Component {
                column: column_name,
                components,
                found: component,
            });
        }
        let (components, component) = (components as usize, component as usize);
        let generation = column.generation();
        let values = column.values();
        Ok(Some(Self { values, components, component, offset, sign, generation }))
    }

    /// Tells them from others.
    pub(super) fn key(&self) -> ScalarKey {
        let (generation, component) = (self.generation, self.component as u32);
        let is_reversed = self.sign < 0.0;
        ScalarKey { generation, component, offset: self.offset.to_bits(), is_reversed }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.values.len() / self.components
    }

    /// Whether they are stored as whole numbers.
    pub(super) fn is_integer(&self) -> bool {
        !matches!(self.values.element(), Element::F32 | Element::F64)
    }

    /// Reads the numbers from `start` on, as many as fit and there are.
    pub(super) fn read(&self, start: usize, out: &mut [f64]) {
        let (components, component, offset) = (self.components, self.component, self.offset);
        with_vec!(self.values, vec => fill(out, vec, [start, components, component], offset));
        if self.sign < 0.0 {
            out.iter_mut().for_each(|value| *value = -*value);
        }
    }

    /// The number of a surfel; NaN where there is none.
    pub(super) fn value(&self, index: usize) -> f64 {
        let mut value = [f64::NAN];
        self.read(index, &mut value);
        value[0]
    }

    /// Adds up something of all blocks, in parallel; `merge` must not depend on the order.
    pub(super) fn fold<T: Send>(
        &self,
        identity: impl Fn() -> T + Sync + Send,
        add: impl Fn(&mut T, &[f64]) + Sync + Send,
        merge: impl Fn(T, T) -> T + Sync + Send,
    ) -> T {
        let len = self.len();
        let begun = || (identity(), vec![0.0; BLOCK]);
        let blocks = (0..len.div_ceil(BLOCK)).into_par_iter();
        let folded = blocks.fold(begun, |(mut sum, mut block), i| {
            let start = i * BLOCK;
            let n = BLOCK.min(len - start);
            self.read(start, &mut block[..n]);
            add(&mut sum, &block[..n]);
            (sum, block)
        });
        folded.map(|(sum, _)| sum).reduce(&identity, merge)
    }
}

/// Reads numbers of one component from a row on.
fn fill<T: Copy + Into<f64>>(
    out: &mut [f64],
    values: &[T],
    [start, components, component]: [usize; 3],
    offset: f64,
) {
    let rows = values.get(start * components..).unwrap_or_default();
    if components == 1 {
        for (out, value) in out.iter_mut().zip(rows) {
            *out = (*value).into() + offset;
        }
    } else {
        for (out, row) in out.iter_mut().zip(rows.chunks_exact(components)) {
            *out = row[component].into() + offset;
        }
    }
}
