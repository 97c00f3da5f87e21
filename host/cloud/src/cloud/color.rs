//! Albedos: the colours of a cloud decoded to linear light.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use rayon::prelude::*;
use std::sync::OnceLock;
use surfelshop_api::columns::{COLOR, NEUTRAL_ALBEDO};
use surfelshop_api::params::srgb_to_linear;

/// Linear values of all 8-bit codes.
fn table_u8() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0)))
}

/// Linear values of all 16-bit codes.
fn table_u16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| {
        (0..=u16::MAX).map(|code| srgb_to_linear(f32::from(code) / 65535.0)).collect()
    })
}

/// Whether a linear colour can be shaded with.
pub(crate) fn is_usable(color: &[f32]) -> bool {
    color.iter().all(|channel| channel.is_finite() && *channel >= 0.0)
}

/// The first three of a surfel's linear channels, or neutral where they cannot be shaded with.
fn from_linear(surfel: &[f32]) -> [f32; 3] {
    match surfel {
        [r, g, b, ..] if is_usable(&surfel[..3]) => [*r, *g, *b],
        _ => NEUTRAL_ALBEDO,
    }
}

impl Cloud {
    /// The linear Rec. 709 albedo of every surfel; `None` where there is no `color` column.
    ///
    /// 8 and 16-bit colours are decoded from sRGB; float colours that are negative or not finite
    /// become [`NEUTRAL_ALBEDO`]. Opacity is left out.
    #[must_use]
    pub fn linear_colors(&self) -> Option<Vec<[f32; 3]>> {
        let column = self.column(COLOR)?;
        let components = column.components() as usize;
        Some(match column.values() {
            Buffer::U8(values) => {
                let table = table_u8();
                let decode = |c: &[u8]| std::array::from_fn(|i| table[usize::from(c[i])]);
                values.par_chunks_exact(components).map(decode).collect()
            }
            Buffer::U16(values) => {
                let table = table_u16();
                let decode = |c: &[u16]| std::array::from_fn(|i| table[usize::from(c[i])]);
                values.par_chunks_exact(components).map(decode).collect()
            }
            Buffer::F32(values) => values.par_chunks_exact(components).map(from_linear).collect(),
            _ => return None,
        })
    }

    /// The linear Rec. 709 albedo of one surfel, as in [`Cloud::linear_colors`]; `None` where there
    /// is no `color` column or the index is out of range.
    #[must_use]
    pub fn color_linear(&self, index: usize) -> Option<[f32; 3]> {
        let column = self.column(COLOR)?;
        let components = column.components() as usize;
        let range =
            index.checked_mul(components)?..index.checked_add(1)?.checked_mul(components)?;
        match column.values() {
            Buffer::U8(values) => {
                let color = values.get(range)?;
                Some(std::array::from_fn(|i| table_u8()[usize::from(color[i])]))
            }
            Buffer::U16(values) => {
                let color = values.get(range)?;
                Some(std::array::from_fn(|i| table_u16()[usize::from(color[i])]))
            }
            Buffer::F32(values) => values.get(range).map(from_linear),
            _ => None,
        }
    }
}
