//! A named typed column, shared between clouds and counted by generations.

use crate::cloud::buffer::Buffer;
use crate::cloud::provenance::ToolRun;
use crate::cloud::roles::natural_role;
use crate::error::CloudError;
use crate::memory::OutOfMemory;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use surfelshop_api::ColumnView;
use surfelshop_api::columns::{self, Element, OPACITY, Role, role_of};

/// The generation the next column gets; one counter for the whole process, so that equal generations
/// mean equal values whatever clouds they are found in.
static NEXT_GENERATION: AtomicU64 = AtomicU64::new(1);

/// A named typed column; clones share its values.
#[derive(Clone, Debug)]
pub struct Column {
    name: Arc<str>,
    components: u32,
    generation: u64,
    values: Arc<Buffer>,
    made: Option<Arc<ToolRun>>,
    role: Role,
}

impl Column {
    /// A column of new values, under a generation of its own. It has the role of its name, where that goes with the
    /// type of the values.
    #[must_use]
    pub fn new(name: impl Into<Arc<str>>, components: u32, values: Buffer) -> Self {
        let generation = NEXT_GENERATION.fetch_add(1, Ordering::Relaxed);
        let name = name.into();
        let role = natural_role(&name, values.element(), components);
        Self { name, components, generation, values: Arc::new(values), made: None, role }
    }

    /// The column with another role; the values are shared.
    #[must_use]
    pub fn with_role(&self, role: Role) -> Self {
        Self { role, ..self.clone() }
    }

    /// The column with new values of as many components, under a generation of its own.
    pub(crate) fn with_values(&self, values: Buffer) -> Self {
        let made = self.made.clone();
        Self::new(Arc::clone(&self.name), self.components, values)
            .made_by(made)
            .with_role(self.role)
    }

    /// What becomes of the values where the cloud is scaled or turned.
    #[must_use]
    pub fn role(&self) -> Role {
        self.role
    }

    /// The column as the work of a tool, or of nobody known; the values are shared.
    #[must_use]
    pub fn made_by(&self, made: Option<Arc<ToolRun>>) -> Self {
        Self { made, ..self.clone() }
    }

    /// The run of a tool that made the column, where one did.
    #[must_use]
    pub fn made(&self) -> Option<&Arc<ToolRun>> {
        self.made.as_ref()
    }

    /// The column's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Elements per surfel.
    #[must_use]
    pub fn components(&self) -> u32 {
        self.components
    }

    /// Equal generations mean equal values.
    #[must_use]
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The values, all components of a surfel together.
    #[must_use]
    pub fn values(&self) -> &Buffer {
        &self.values
    }

    /// The column as a plugin sees it.
    #[must_use]
    pub fn view(&self) -> ColumnView<'_> {
        ColumnView {
            name: &self.name,
            components: self.components,
            generation: self.generation,
            values: self.values.as_values(),
        }
    }

    /// The column with the surfels whose entry in `mask` is true.
    pub(crate) fn select(&self, mask: &[bool]) -> Self {
        self.with_values(self.values.select(self.components as usize, mask))
    }

    /// The column with the surfels of these indices, each of which must be there.
    pub(crate) fn gather(&self, rows: &[u32]) -> Result<Self, OutOfMemory> {
        Ok(self.with_values(self.values.gather(self.components as usize, rows)?))
    }

    /// The column without its values.
    pub(crate) fn emptied(&self) -> Self {
        Self { values: Arc::new(Buffer::U8(Vec::new())), ..self.clone() }
    }

    /// An emptied column with the values that another one of its generation has.
    pub(crate) fn refilled(&self, other: &Self) -> Self {
        Self { values: Arc::clone(&other.values), ..self.clone() }
    }

    /// An emptied column with its values made again.
    pub(crate) fn filled(&self, values: Buffer) -> Self {
        Self { values: Arc::new(values), ..self.clone() }
    }

    /// The column for as long as somebody else holds it.
    pub(crate) fn downgrade(&self) -> WeakColumn {
        let column = self.emptied();
        WeakColumn { column, values: Arc::downgrade(&self.values) }
    }

    /// Checks the column against the cloud's length and the rules of well-known names.
    pub(crate) fn check(&self, len: usize) -> Result<(), CloudError> {
        let column = || self.name.to_string();
        if self.name.is_empty() || self.components == 0 {
            return Err(CloudError::Shape { column: column() });
        }
        let expected = (len as u64).saturating_mul(u64::from(self.components));
        if self.values.len() as u64 != expected {
            let found = self.values.len();
            return Err(CloudError::Length { column: column(), expected, found });
        }
        let found = format!("{} x {}", self.components, self.values.element().name());
        if let Some(expected) = well_known_type(&self.name)
            && !expected.iter().any(|&(element, components)| {
                element == self.values.element() && components == self.components
            })
        {
            let expected = expected.iter().map(|(e, c)| format!("{c} x {}", e.name()));
            let expected = expected.collect::<Vec<_>>().join(" or ");
            return Err(CloudError::Type { column: column(), expected, found });
        }
        if let (Some(_), Buffer::F32(values)) = (well_known_type(&self.name), &*self.values)
            && let Some(i) = first_not_finite(values)
        {
            let surfel = i / self.components as usize;
            return Err(CloudError::NotFinite { column: column(), surfel });
        }
        Ok(())
    }
}

/// A column that lives for as long as somebody else holds it.
#[derive(Clone, Debug)]
pub(crate) struct WeakColumn {
    /// All but the values.
    column: Column,
    values: Weak<Buffer>,
}

impl WeakColumn {
    /// The column; `None` where nobody holds it any more.
    pub(crate) fn upgrade(&self) -> Option<Column> {
        Some(Column { values: self.values.upgrade()?, ..self.column.clone() })
    }

    /// Whether somebody holds it.
    pub(crate) fn lives(&self) -> bool {
        self.values.strong_count() > 0
    }
}

/// The place of the first number that is not finite.
fn first_not_finite(values: &[f32]) -> Option<usize> {
    const BLOCK: usize = 4096;
    // Blocks without a way out of the loop are tested several numbers at a time.
    let all_finite = |block: &[f32]| block.iter().fold(true, |all, value| all & value.is_finite());
    let block = values.chunks(BLOCK).position(|block| !all_finite(block))?;
    let within = values[block * BLOCK..].iter().position(|value| !value.is_finite())?;
    Some(block * BLOCK + within)
}

/// The types a well-known column may have, as element and components; `None` for other names.
fn well_known_type(name: &str) -> Option<&'static [(Element, u32)]> {
    Some(match name {
        columns::POSITION | columns::NORMAL | columns::TANGENT_U | columns::TANGENT_V => {
            &[(Element::F32, 3)]
        }
        columns::RADIUS | columns::AO => &[(Element::F32, 1)],
        columns::MATERIAL => &[(Element::U32, 1)],
        columns::COLOR => &[
            (Element::U8, 3),
            (Element::U8, 4),
            (Element::U16, 3),
            (Element::U16, 4),
            (Element::F32, 3),
            (Element::F32, 4),
        ],
        _ => return None,
    })
}

/// The element type that a column of this name has where it is made anew; `None` where any will do.
pub(crate) fn usual_type(name: &str) -> Option<Element> {
    well_known_type(name).and_then(|types| types.first()).map(|(element, _)| *element)
}

/// Whether a name stands for a column that the host gives a meaning. Those of Gaussian splats have it only with their
/// types: see [`splat_columns`](crate::splat_columns).
#[must_use]
pub fn is_well_known(name: &str) -> bool {
    has_fixed_type(name) || name == OPACITY || role_of(name) != Role::Plain
}

/// Whether a column of this name must have one of the types that its meaning allows.
pub(crate) fn has_fixed_type(name: &str) -> bool {
    well_known_type(name).is_some()
}
