//! Properties of points: what components of columns are called, and how values are written.

use std::io::{self, Write as _};
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, TANGENT_U, TANGENT_V, Values};

/// What a component of a column is called in a PLY file.
pub(super) fn property_name(column: &str, components: usize, component: usize) -> String {
    let axis = ["x", "y", "z"].get(component).copied().unwrap_or_default();
    match column {
        POSITION => axis.to_owned(),
        NORMAL => format!("n{axis}"),
        COLOR => ["red", "green", "blue", "alpha"][component.min(3)].to_owned(),
        TANGENT_U | TANGENT_V => format!("{column}_{axis}"),
        _ if components == 1 => column.to_owned(),
        _ => format!("{column}_{component}"),
    }
}

/// Least significant byte first.
pub(super) fn binary_value(block: &mut Vec<u8>, values: &Values<'_>, index: usize) {
    macro_rules! append {
        ($($variant:ident),*) => {
            match values {
                $(Values::$variant(values) => {
                    block.extend_from_slice(&values[index].to_le_bytes());
                })*
            }
        };
    }
    append!(I8, U8, I16, U16, I32, U32, F32, F64);
}

/// Floats have as many digits as tell them from their neighbours.
pub(super) fn text_value(block: &mut Vec<u8>, values: &Values<'_>, index: usize) -> io::Result<()> {
    macro_rules! append {
        ($($variant:ident),*) => {
            match values { $(Values::$variant(values) => write!(block, "{}", values[index]),)* }
        };
    }
    append!(I8, U8, I16, U16, I32, U32, F32, F64)
}
