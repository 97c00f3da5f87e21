use crate::display::DisplayError;
use crate::error::CloudError;
use crate::memory::OutOfMemory;

/// Why surfels cannot be selected, or nothing be done with what is.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SelectionError {
    /// A selection is of another cloud.
    #[error("selection: expected one of {expected} surfels, found one of {found}")]
    Length {
        /// Surfels of the cloud.
        expected: usize,
        /// Surfels that the selection knows.
        found: usize,
    },
    /// There are more surfels than can be numbered.
    #[error("selection: expected at most 4294967295 surfels, found {found}")]
    TooMany {
        /// Surfels of the cloud.
        found: usize,
    },
    /// Nothing is selected.
    #[error("nothing is selected")]
    Nothing,
    /// A cloud would have no surfels.
    #[error("all {len} surfels are selected; a cloud cannot be left without any")]
    Everything {
        /// Surfels of the cloud.
        len: usize,
    },
    /// A distance is no length.
    #[error("expected a distance above 0, found {found}")]
    Distance {
        /// What was asked for.
        found: f64,
    },
    /// A tool cannot be led along a stroke.
    #[error("tool `{tool}`: {line}")]
    Tool {
        /// The tool.
        tool: String,
        /// Why not.
        line: String,
    },
    /// A number does not fit a column.
    #[error("column `{column}`: expected {expected}, found {found}")]
    Value {
        /// The column.
        column: String,
        /// What would be right.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// An attribute cannot be read.
    #[error(transparent)]
    Attribute(#[from] DisplayError),
    /// The cloud cannot be like this.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// There is no memory for it.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
}
