//! What can be seen from where in a cloud of points: which side of a surface faces free space, and
//! where one can stand.

pub mod sides;
