//! A record of our own: which axis points up, where that is not z, as LAS has it.

use surfelshop_api::format::UpAxis;

/// Who the record is of.
pub(crate) const USER: &str = "Surfelshop";
/// Its number.
pub(crate) const ID: u16 = 1;

/// What the record holds.
pub(crate) fn body(up: UpAxis) -> &'static [u8] {
    match up {
        UpAxis::X => b"up=x",
        UpAxis::Y => b"up=y",
        UpAxis::Z => b"up=z",
        UpAxis::Unknown => b"up=unknown",
    }
}

/// The axis that a record names; `None` where it is none of these.
pub(crate) fn axis(record: &[u8]) -> Option<UpAxis> {
    let axes = [UpAxis::X, UpAxis::Y, UpAxis::Z, UpAxis::Unknown];
    axes.into_iter().find(|&axis| body(axis) == record)
}
