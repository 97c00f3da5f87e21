//! The pair that is begun, and what it is for.

use super::picture::PictureLoad;
use glam::DVec3;

/// Pairs that are clicked for a parameter of a tool.
pub(crate) struct Pairing {
    /// The tool, by its name in the registry.
    pub(crate) tool: String,
    /// The parameter, by its id.
    pub(super) parameter: String,
    /// A choice of the tool that is to name the parameter, so that pairs are heeded.
    pub(super) choice: Option<String>,
    /// The picture that places are of; where there is none they are those of another cloud.
    pub(super) picture: Option<PictureLoad>,
    /// A place of the cloud that has no partner yet.
    pub(super) place: Option<DVec3>,
    /// A place of the picture that has none, shares from its left and top.
    pub(super) share: Option<[f64; 2]>,
}

impl Pairing {
    /// Numbers of a pair.
    pub(super) fn n_numbers(&self) -> usize {
        if self.picture.is_some() { 5 } else { 6 }
    }

    /// Whether a place waits for its partner.
    pub(super) fn is_begun(&self) -> bool {
        self.place.is_some() || self.share.is_some()
    }

    /// Takes the place back that has no partner; whether there was one.
    pub(in crate::views::hands) fn forget_place(&mut self) -> bool {
        self.place.take().is_some() | self.share.take().is_some()
    }
}
