//! The record of a surfel: which properties it has and where, codes of normals, models of colours.

pub(crate) mod color;
pub(crate) mod layout;
pub(crate) mod normal_code;
pub(crate) mod plain;
pub(crate) mod property;
