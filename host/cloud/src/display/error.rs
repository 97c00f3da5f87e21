//! Why clouds cannot be displayed as asked, each one line.

use crate::memory::OutOfMemory;

/// Why clouds cannot be displayed as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DisplayError {
    /// No cloud has a column of this name.
    #[error("no cloud has a column `{column}`; there are {available}, and `height`")]
    UnknownColumn {
        /// The name.
        column: String,
        /// The columns there are, separated by commas.
        available: String,
    },
    /// A column has fewer components.
    #[error("column `{column}`: expected a component below {components}, found {found}")]
    Component {
        /// The column.
        column: String,
        /// Components that it has.
        components: u32,
        /// The one that was asked for.
        found: u32,
    },
    /// Numbers cannot be told apart as categories.
    #[error(
        "`{attribute}`: expected at most {most} different whole numbers to colour as categories, found \
         {found}; choose a colour map"
    )]
    NotCategories {
        /// The attribute.
        attribute: String,
        /// How many there may be.
        most: usize,
        /// What there is.
        found: &'static str,
    },
    /// A logarithmic scale has nothing to show.
    #[error(
        "`{attribute}`: expected numbers above 0 for a logarithmic scale, found none; choose `linear`"
    )]
    NotPositive {
        /// The attribute.
        attribute: String,
    },
    /// The directions of normals were asked for where there are none.
    #[error("expected a column `normal` of 3 x f32 to colour by, found none")]
    NoNormals,
    /// There are more surfels than can be numbered.
    #[error("filters are for clouds of fewer than 2^32 surfels, found {found}")]
    TooMany {
        /// How many there are.
        found: usize,
    },
    /// There is no memory for what is displayed.
    #[error("colours and filters: {0}")]
    Memory(OutOfMemory),
}

// Its message is part of the line, so it is no `source` that a caller would print a second time.
impl From<OutOfMemory> for DisplayError {
    fn from(error: OutOfMemory) -> Self {
        Self::Memory(error)
    }
}
