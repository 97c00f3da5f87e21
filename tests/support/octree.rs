//! Octrees of Potree 2 with some thousand points, as its converter writes them without compression.

use glam::DVec3;
use std::path::{Path, PathBuf};

/// Steps along the cube of an octree.
const STEPS: f64 = 65536.0;

/// Writes points into a folder as an octree of three levels: of every eight points one is in the root, three are in its
/// eighths, and four in theirs. Colours are shades of grey of 8 bits in 16, brighter with x.
///
/// # Panics
/// Where there are no points, or the folder cannot be written to.
#[must_use]
pub fn write_octree(folder: &Path, points: &[DVec3]) -> PathBuf {
    let low = points.iter().fold(points[0], |low, point| low.min(*point));
    let high = points.iter().fold(points[0], |high, point| high.max(*point));
    let side = (high - low).max_element().max(f64::MIN_POSITIVE);
    let step = side / STEPS;
    let stored = |point: &DVec3| ((*point - low) / step).round().to_array().map(|x| x as i32);
    // Paths of octants from the root, x the highest bit of each.
    let path = |point: &DVec3, depth: u32| -> String {
        let cell = |level: u32| {
            let bit = |x: i32| x.min(STEPS as i32 - 1) >> (16 - level) & 1;
            let [x, y, z] = stored(point).map(bit);
            4 * x + 2 * y + z
        };
        (1..=depth).map(|level| cell(level).to_string()).collect()
    };
    let mut nodes = std::collections::BTreeMap::<(usize, String), Vec<DVec3>>::new();
    for (i, point) in points.iter().enumerate() {
        let depth = match i % 8 {
            0 => 0,
            1..4 => 1,
            _ => 2,
        };
        for level in 0..=depth {
            let name = path(point, level);
            let node = nodes.entry((name.len(), name)).or_default();
            if level == depth {
                node.push(*point);
            }
        }
    }
    let (mut hierarchy, mut octree) = (Vec::new(), Vec::new());
    for ((len, name), points) in &nodes {
        let is_child =
            |key: &&(usize, String)| key.0 == len + 1 && key.1.starts_with(name.as_str());
        let bit = |key: &(usize, String)| 1u8 << (key.1.as_bytes()[*len] - b'0');
        let mask = nodes.keys().filter(is_child).map(bit).fold(0, |all, bit| all | bit);
        let at = octree.len() as u64;
        for point in points {
            octree.extend(stored(point).into_iter().flat_map(i32::to_le_bytes));
            // As many programs write them.
            let grey = ((point.x - low.x) / side * 255.0).round() as u16;
            octree.extend([grey; 3].into_iter().flat_map(u16::to_le_bytes));
        }
        hierarchy.extend([u8::from(mask == 0), mask]);
        hierarchy.extend((points.len() as u32).to_le_bytes());
        hierarchy.extend([at, octree.len() as u64 - at].into_iter().flat_map(u64::to_le_bytes));
    }
    let (min, max) = (low.to_array(), (low + side).to_array());
    let metadata = format!(
        r#"{{"version": "2.0", "name": "made", "points": {}, "hierarchy": {{"firstChunkSize": {}}},
        "offset": {min:?}, "scale": [{step}, {step}, {step}], "spacing": {},
        "boundingBox": {{"min": {min:?}, "max": {max:?}}}, "encoding": "DEFAULT", "attributes": [
        {{"name": "position", "size": 12, "numElements": 3, "elementSize": 4, "type": "int32",
          "min": {min:?}, "max": {:?}}},
        {{"name": "rgb", "size": 6, "numElements": 3, "elementSize": 2, "type": "uint16"}}]}}"#,
        points.len(),
        hierarchy.len(),
        // As far apart as the root's points of a surface are.
        side * (3.0 / (points.len() as f64 / 8.0)).sqrt(),
        high.to_array(),
    );
    std::fs::create_dir_all(folder).expect("a folder");
    let index = folder.join("metadata.json");
    for (path, bytes) in [
        (index.clone(), metadata.into_bytes()),
        (folder.join("hierarchy.bin"), hierarchy),
        (folder.join("octree.bin"), octree),
    ] {
        std::fs::write(path, bytes).expect("a file");
    }
    index
}
