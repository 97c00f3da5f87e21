//! Tags of directory entries that are read or written.

/// There is no sibling more.
pub(crate) const UPLINK: u16 = 0x0000;
/// The next sibling of a directory without children.
pub(crate) const LINK: u16 = 0x0001;
/// The next sibling and the first child.
pub(crate) const DOWNLINK: u16 = 0x0002;
/// Children, and one for the directory that closes their list.
pub(crate) const N_CHILDREN: u16 = 0x0003;

/// Title of the scene.
pub(crate) const TITLE: u16 = 0x0100;
/// Author.
pub(crate) const AUTHOR: u16 = 0x0101;
/// Program that wrote the file.
pub(crate) const APPLICATION: u16 = 0x0102;
/// Description.
pub(crate) const DESCRIPTION: u16 = 0x0103;
/// Version of the scene, a number.
pub(crate) const VERSION: u16 = 0x0104;
/// Date.
pub(crate) const DATE: u16 = 0x0105;
/// Direction to the right, of the file's coordinates.
pub(crate) const RIGHT: u16 = 0x0110;
/// Direction upwards.
pub(crate) const UP: u16 = 0x0111;
/// Direction towards the eye.
pub(crate) const BACK: u16 = 0x0112;
/// Length of a unit.
pub(crate) const DEFAULT_UNITS: u16 = 0x0113;
/// Camera of the scene, a matrix.
pub(crate) const CAMERA_TRANSFORM: u16 = 0x0115;
/// Bounding box: two corners.
pub(crate) const BOUNDS: u16 = 0x0118;
/// Which child of the root is the list of surfel sets.
pub(crate) const SET_LIST_INDEX: u16 = 0x0120;
/// Surfel sets of the list.
pub(crate) const N_SETS: u16 = 0x0130;
/// Resolutions of a set, from coarse to fine.
pub(crate) const N_RESOLUTIONS: u16 = 0x0140;
/// Which resolution is the full one.
pub(crate) const FULL_RESOLUTION: u16 = 0x0141;
/// Version of the records of surfels.
pub(crate) const SURFEL_FORMAT: u16 = 0x0150;
/// Bytes of a record.
pub(crate) const SURFEL_BYTES: u16 = 0x0151;
/// Which properties surfels have, bit by bit.
pub(crate) const PROPERTY_BITS: u16 = 0x0152;
/// Properties of a record, by number.
pub(crate) const PROPERTY_IDS: u16 = 0x0153;
/// Where they lie in a record, in the same order.
pub(crate) const PROPERTY_OFFSETS: u16 = 0x0154;
/// From the set's coordinates to those of the file, a matrix.
pub(crate) const TRANSFORM: u16 = 0x0161;
/// Name of the set.
pub(crate) const IDENTIFIER: u16 = 0x0162;
/// Marked surfels.
pub(crate) const MARKERS: u16 = 0x0163;
/// Pairs of surfels that make features.
pub(crate) const RELATIONS: u16 = 0x0166;
/// Surfels of a resolution.
pub(crate) const N_SURFELS: u16 = 0x0170;
/// Their records.
pub(crate) const SURFELS: u16 = 0x0171;
