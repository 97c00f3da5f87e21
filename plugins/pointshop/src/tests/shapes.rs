//! Shapes of surfels.

use super::*;

/// A box of surfels on a grid of each side, none of them on an edge.
pub(super) fn cuboid(min: Vec3, max: Vec3, step: f32) -> TestCloud {
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let size = max - min;
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = |axis: usize| (size[axis] / step).round().max(1.0) as u32;
        for (side, sign) in [(min[axis], -1.0), (max[axis], 1.0)] {
            for i in 0..count(u) * count(v) {
                let mut place = Vec3::ZERO;
                let share = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
                place[axis] = side;
                place[u] = min[u] + size[u] * share(i % count(u), count(u));
                place[v] = min[v] + size[v] * share(i / count(u), count(v));
                let mut normal = Vec3::ZERO;
                normal[axis] = sign;
                positions.push(place);
                normals.push(normal);
            }
        }
    }
    TestCloud::new(&positions, &normals, 0.75 * step)
}
