//! What can be seen from where in a cloud of points: which side of a surface faces free space, and
//! where one can stand.

mod frame;
pub mod free_space;
#[cfg(test)]
mod scenes;
pub mod sides;
mod strays;
mod surfels;
