//! Numbers as text.

use std::fmt::{self, Display, LowerExp, Write};
use surfelshop_api::columns::Values;
use surfelshop_api::params::linear_to_srgb;

/// How a number is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// With the fewest digits that are read as the same number.
    Shortest,
    /// As that, always with a point or an exponent.
    Pointed,
    /// As a colour of 8 bits.
    Color,
    /// Whole numbers as fractions of the largest of their type.
    Fraction,
}

/// Writes element `i`, which must be there.
pub(super) fn push(text: &mut String, values: &Values<'_>, i: usize, form: Form) -> fmt::Result {
    match form {
        Form::Color => write!(text, "{}", color(values, i)),
        Form::Fraction => match values {
            Values::U8(all) => float(text, f32::from(all[i]) / 255.0),
            Values::U16(all) => float(text, f32::from(all[i]) / 65_535.0),
            _ => shortest(text, values, i),
        },
        Form::Pointed => match values {
            Values::F32(all) => write!(text, "{:?}", all[i]),
            Values::F64(all) => write!(text, "{:?}", all[i]),
            _ => shortest(text, values, i),
        },
        Form::Shortest => shortest(text, values, i),
    }
}

fn shortest(text: &mut String, values: &Values<'_>, i: usize) -> fmt::Result {
    match values {
        Values::I8(all) => write!(text, "{}", all[i]),
        Values::U8(all) => write!(text, "{}", all[i]),
        Values::I16(all) => write!(text, "{}", all[i]),
        Values::U16(all) => write!(text, "{}", all[i]),
        Values::I32(all) => write!(text, "{}", all[i]),
        Values::U32(all) => write!(text, "{}", all[i]),
        Values::F32(all) => float(text, all[i]),
        Values::F64(all) => float(text, all[i]),
    }
}

/// A float; very large and very small ones with an exponent, which would have hundreds of digits.
pub(super) fn float<T: Into<f64> + Copy + Display + LowerExp>(
    text: &mut String,
    value: T,
) -> fmt::Result {
    let size = value.into().abs();
    if size == 0.0 || !size.is_finite() || (1e-7..1e17).contains(&size) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    }
}

/// A component of a colour as 8 bits: whole numbers are encoded, floats are linear.
fn color(values: &Values<'_>, i: usize) -> u8 {
    let encoded = |linear: f32| (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8;
    match values {
        Values::U8(all) => all[i],
        Values::I8(all) => u8::try_from(all[i]).unwrap_or(0),
        Values::U16(all) => ((u32::from(all[i]) + 128) / 257) as u8,
        Values::I16(all) => all[i].clamp(0, 255) as u8,
        Values::I32(all) => all[i].clamp(0, 255) as u8,
        Values::U32(all) => all[i].min(255) as u8,
        Values::F32(all) => encoded(all[i]),
        Values::F64(all) => encoded(all[i] as f32),
    }
}
