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

/// A cloud as the text of a PLY file.
pub(super) fn ply_text(cloud: &TestCloud, with_colors: bool) -> String {
    let n = cloud.positions.len() / 3;
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {n}\n");
    for name in ["x", "y", "z", "nx", "ny", "nz", "radius"] {
        text += &format!("property double {name}\n");
    }
    if with_colors {
        text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    text += "end_header\n";
    for i in 0..n {
        let place = cloud.origin + Vec3::from_slice(&cloud.positions[3 * i..]).as_dvec3();
        let normal = &cloud.normals[3 * i..3 * i + 3];
        let DVec3 { x, y, z } = place;
        let radius = cloud.radii[i];
        text += &format!("{x} {y} {z} {} {} {} {radius}", normal[0], normal[1], normal[2]);
        if with_colors {
            let [r, g, b] = [0, 1, 2].map(|c| cloud.colors[3 * i + c]);
            text += &format!(" {r} {g} {b}");
        }
        text += "\n";
    }
    text
}

/// A cloud in a file that goes with the value.
pub(super) struct TemporaryFile(pub(super) std::path::PathBuf);

impl TemporaryFile {
    pub(super) fn new(name: &str, contents: &[u8]) -> Self {
        let name = format!("pointshop-{}-{name}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, contents).unwrap();
        Self(path)
    }

    pub(super) fn path(&self) -> FilePath {
        FilePath(self.0.to_str().unwrap().to_owned())
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        drop(std::fs::remove_file(&self.0));
    }
}
