//! The colours of what is selected.

use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::changes;
use crate::cloud::column::Column;
use crate::memory::ask;
use std::sync::Arc;
use surfelshop_api::columns::{COLOR, NEUTRAL_ALBEDO};
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};

/// How strongly what is selected is tinted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tint {
    /// So that it is told from everything else.
    #[default]
    Full,
    /// So that colours that are being painted are told from each other.
    Faint,
}

impl Tint {
    /// How much of the tint there is in a colour.
    fn share(self) -> f32 {
        match self {
            Self::Full => 0.7,
            Self::Faint => 0.25,
        }
    }
}

/// The tint: an orange that few scans have, sRGB-encoded.
const TINT: [f32; 3] = [1.0, 0.48, 0.05];

/// A cloud with its selected surfels tinted; `rows` says where its surfels are in the cloud that the selection is of,
/// and is `None` where that is itself. What is not selected stays as it is, bit by bit.
///
/// # Errors
/// Where there is no memory.
pub fn tinted(
    cloud: &Cloud,
    selection: &Selection,
    rows: Option<&[u32]>,
    tint: Tint,
) -> Result<Cloud, SelectionError> {
    let is_selected = |i: usize| {
        selection
            .contains(rows.map_or(i, |rows| rows.get(i).map_or(usize::MAX, |row| *row as usize)))
    };
    let chosen: Arc<[u32]> = (0..cloud.len())
        .filter(|&i| is_selected(i))
        .filter_map(|i| u32::try_from(i).ok())
        .collect();
    if chosen.is_empty() {
        return Ok(cloud.clone());
    }
    let before = match cloud.column(COLOR) {
        Some(column) => column.clone(),
        None => {
            ask((cloud.len() as u64).saturating_mul(3))?;
            let neutral =
                NEUTRAL_ALBEDO.map(|albedo| (255.0 * linear_to_srgb(albedo)).round() as u8);
            let neutral = neutral.repeat(cloud.len());
            Column::new(COLOR, 3, Buffer::U8(neutral))
        }
    };
    ask((before.values().len() * before.values().element().size()) as u64)?;
    let mut values = before.values().clone();
    let components = before.components() as usize;
    let mixed = |old: f32, channel: usize| old + tint.share() * (TINT[channel] - old);
    for &row in chosen.iter() {
        for channel in 0..components.min(3) {
            let at = row as usize * components + channel;
            match &mut values {
                Buffer::U8(values) => {
                    values[at] =
                        (255.0 * mixed(f32::from(values[at]) / 255.0, channel)).round() as u8;
                }
                Buffer::U16(values) => {
                    let code = mixed(f32::from(values[at]) / 65535.0, channel);
                    values[at] = (65535.0 * code).round() as u16;
                }
                Buffer::F32(values) => {
                    let code = linear_to_srgb(values[at].clamp(0.0, 1.0));
                    values[at] = srgb_to_linear(mixed(code, channel));
                }
                _ => {}
            }
        }
    }
    let color = before.with_values(values);
    changes::note(before.generation(), color.generation(), chosen);
    Ok(cloud.recolored(color))
}
