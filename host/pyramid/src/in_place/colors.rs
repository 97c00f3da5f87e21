//! Colours of 16 bits that hold values of 8, as many programs write them: no node alone tells, since it may be dark.

use super::{NodeReader, coarsest, read_with};
use std::path::Path;
use surfelshop_api::columns::{COLOR, Element};
use surfelshop_api::format::{CloudHeader, PointTree};
use surfelshop_cloud::convert::nodes_of;
use surfelshop_cloud::{Buffer, ColorBits};

/// Points that are looked at, about.
const LOOKED_AT: u64 = 10_000;

/// Whether the colours of a file hold values of 8 bits: as the options say, else as the coarsest nodes tell. What cannot be
/// read is as wide as its type; the nodes say why themselves.
pub(super) fn are_narrow(
    path: &Path,
    reader: &dyn NodeReader,
    header: &CloudHeader,
    tree: &PointTree,
) -> bool {
    let is_wide = |header: &CloudHeader| {
        let (place, column) = header.column(COLOR)?;
        (column.element == Element::U16).then_some(place)
    };
    if is_wide(header).is_none() {
        return false;
    }
    let mut bits = ColorBits::default();
    reader.with_options(&mut |read| bits = read.color_bits);
    let most = || {
        let wanted = coarsest(tree, LOOKED_AT);
        let (header, columns) = read_with(reader, |read| nodes_of(path, &wanted, read)).ok()?;
        match columns.get(is_wide(&header)?)? {
            Buffer::U16(values) => values.iter().copied().max(),
            _ => None,
        }
    };
    // As they are asked to be, or as they are.
    bits.are_eight(if bits == ColorBits::Told { most().unwrap_or(0) } else { 0 })
}
