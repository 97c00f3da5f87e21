//! Cameras of a graph besides the view's own.

use crate::graph::resources::Span;
use crate::scene::camera::{Camera, Projection, View};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A camera of a graph. Its size is part of the structure, all else travels with the frame's data, so
/// that a camera may move without anything being planned anew. ABI 3.5.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SeenFrom {
    /// Name in messages and lists.
    #[serde(default)]
    pub label: String,
    /// Width and height of its picture in pixels, each at least 1.
    pub size_px: [u32; 2],
    /// Where its numbers lie in the frame's data.
    pub view: Span,
}

/// Numbers of a camera as it travels, each 8 bytes, little endian.
const N_NUMBERS: usize = 13;
/// Bytes of a camera as it travels.
const N_BYTES: usize = 8 * N_NUMBERS;

/// A view's camera and depth range as they travel: eye, target, up, 0 for central and 1 for parallel
/// projection, its angle or height, near and far.
pub(super) fn bytes_of(view: &View) -> Vec<u8> {
    let Camera { eye, target, up, projection } = view.camera;
    let (kind, extent) = match projection {
        Projection::Perspective { fov_y } => (0.0, fov_y),
        Projection::Orthographic { height } => (1.0, height),
    };
    let vectors = [eye, target, up].into_iter().flat_map(|vector| vector.to_array());
    let numbers = vectors.chain([kind, extent, view.near, view.far]);
    numbers.flat_map(f64::to_le_bytes).collect()
}

impl SeenFrom {
    /// The view that a frame's data give it; `None` where they hold no such camera: too few bytes,
    /// numbers that are not finite, an angle outside 0 to pi, a height or near plane of 0 or less.
    #[must_use]
    pub fn view(&self, data: &[u8]) -> Option<View> {
        let first = usize::try_from(self.view.offset).ok()?;
        let bytes = data.get(first..)?.get(..N_BYTES)?;
        let mut numbers = [0.0; N_NUMBERS];
        for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(8)) {
            *number = f64::from_le_bytes(bytes.try_into().ok()?);
        }
        let is_right = numbers.iter().all(|number| number.is_finite())
            && self.view.len == N_BYTES as u64
            && self.size_px.iter().all(|side| *side > 0);
        let [kind, extent, near, far] = [9, 10, 11, 12].map(|i| numbers[i]);
        let projection = match kind {
            0.0 if extent > 0.0 && extent < std::f64::consts::PI => {
                Projection::Perspective { fov_y: extent }
            }
            1.0 if extent > 0.0 && far > near => Projection::Orthographic { height: extent },
            _ => return None,
        };
        let vector = |i: usize| DVec3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
        let camera = Camera { eye: vector(0), target: vector(3), up: vector(6), projection };
        let view = View { camera, size_px: self.size_px, near, far };
        (is_right && near > 0.0).then_some(view)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Graph;

    fn view(projection: Projection) -> View {
        let camera = Camera { eye: DVec3::X, target: DVec3::ZERO, up: DVec3::Y, projection };
        View { camera, size_px: [8, 4], near: 0.1, far: 9.0 }
    }

    #[test]
    fn a_camera_arrives_as_it_was_given() {
        let mut graph = Graph::new();
        for projection in
            [Projection::Perspective { fov_y: 1.5 }, Projection::Orthographic { height: 2.0 }]
        {
            let given = view(projection);
            let id = graph.camera("lamp", &given);
            let slot = &graph.structure().cameras[id.index()];
            assert_eq!(slot.view(graph.data()), Some(given));
            assert_eq!(slot.view(&graph.data()[..N_BYTES - 1]), None);
        }
    }

    #[test]
    fn what_is_no_camera_is_none() {
        let wrong = [
            view(Projection::Perspective { fov_y: 0.0 }),
            view(Projection::Perspective { fov_y: 4.0 }),
            view(Projection::Orthographic { height: -1.0 }),
            View { near: 0.0, ..view(Projection::Perspective { fov_y: 1.0 }) },
            View { near: f64::NAN, ..view(Projection::Perspective { fov_y: 1.0 }) },
            View { size_px: [0, 4], ..view(Projection::Perspective { fov_y: 1.0 }) },
            View { far: 0.05, ..view(Projection::Orthographic { height: 1.0 }) },
        ];
        for view in wrong {
            let mut graph = Graph::new();
            let id = graph.camera("lamp", &view);
            assert_eq!(graph.structure().cameras[id.index()].view(graph.data()), None, "{view:?}");
        }
    }
}
