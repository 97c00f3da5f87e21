//! Clouds of Gaussian splats: which columns make one, and how files of trained splats hold their harmonics.

use serde::Serialize;
use std::fmt;
use surfelshop_api::columns::{Element, NORMAL, OPACITY, RADIUS, SH, SPLAT_ROTATION, SPLAT_SCALE};

/// What a cloud of Gaussian splats has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SplatKind {
    /// Axes along which a splat has an extent: 2 of flat ones, else 3.
    pub dimensions: u8,
    /// The highest order of the spherical harmonics, without a gap from 0 on; `None` where there are none.
    pub order: Option<u8>,
}

impl fmt::Display for SplatKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Gaussian splats ({}D)", self.dimensions)?;
        match self.order {
            Some(order) => write!(out, ", spherical harmonics of order {order}"),
            None => write!(out, ", without spherical harmonics"),
        }
    }
}

/// What kind of Gaussian splats columns are, which are found by their names; `None` where not all are there with their
/// types.
pub(crate) fn splat_kind(column: impl Fn(&str) -> Option<(Element, u32)>) -> Option<SplatKind> {
    let fits = |name: &str| {
        let (element, components) = column(name)?;
        let fits = element == Element::F32 && components_of(name)?.contains(&components);
        fits.then_some(components)
    };
    let dimensions = fits(SPLAT_SCALE)? as u8;
    fits(OPACITY)?;
    fits(SPLAT_ROTATION)?;
    let n_orders = SH.iter().take_while(|name| fits(name).is_some()).count();
    Some(SplatKind { dimensions, order: (n_orders as u8).checked_sub(1) })
}

/// How many components a column may have that gets a role by its name; `None` for other names.
pub(crate) fn components_of(name: &str) -> Option<&'static [u32]> {
    Some(match name {
        OPACITY | RADIUS => &[1],
        NORMAL => &[3],
        SPLAT_SCALE => &[2, 3],
        SPLAT_ROTATION => &[4],
        _ => match SH.iter().position(|known| *known == name)? {
            0 => &[3],
            1 => &[9],
            2 => &[15],
            _ => &[21],
        },
    })
}

/// Which of so many properties `f_rest_*` holds a coefficient of an order from 1 on: all of red come first, then of
/// green, then of blue.
pub(crate) fn rest_index(n_rest: usize, order: usize, coefficient: usize, channel: usize) -> usize {
    channel * (n_rest / 3) + order * order - 1 + coefficient
}

/// The number of properties `f_rest_*` up to an order.
pub(crate) const fn n_rest(order: usize) -> usize {
    3 * ((order + 1) * (order + 1) - 1)
}

/// Whether files of trained splats have a coefficient, counted from m = -l, with the other sign: their basis has the
/// Condon-Shortley sign.
///
/// Source: the constants of the trainer's renderer, -C1 y, C1 z, -C1 x for order 1.
pub(crate) const fn is_flipped(order: usize, coefficient: usize) -> bool {
    (order + coefficient) % 2 == 1
}
