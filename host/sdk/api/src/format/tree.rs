//! Files whose points lie in the nodes of an octree, each of which can be read by itself.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The octree of a file. A node's points are more of those of the nodes above it: to see a cell as fine as one of its
/// level takes these, too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointTree {
    /// Smallest coordinates of the root's cube, in the cloud's own axes.
    pub low: DVec3,
    /// Its side.
    pub side: f64,
    /// Distance between the points of the root; it halves from level to level.
    pub spacing: f64,
    /// The nodes, in any order.
    pub nodes: Vec<PointNode>,
}

/// A node of a file's octree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointNode {
    /// Halvings of the root's cube.
    pub level: u32,
    /// Which of the cells of its level, from the cube's smallest coordinates on.
    pub cell: [u32; 3],
    /// Number of its points.
    pub points: u64,
    /// Where they are: the format's own numbers, such as offset and length, which the host hands back.
    pub place: [u64; 2],
}
