//! The place under the pointer: the centre of the surfel there, or where the line of sight meets its disc.

use crate::views::canvas::surfel::round_of;
use crate::views::{navigation, picking};
use glam::{DVec2, DVec3};
use surfelshop_api::{Camera, Projection};
use surfelshop_cloud::Cloud;

/// A surfel whose centre is so near to the pointer is meant itself, share of the picture's height.
const NEAR: f64 = 0.012;

/// A disc that is seen at less than this, as a cosine, does not say where it is met.
const STEEPEST: f64 = 0.05;

/// The place on a surfel that is seen at a position of a picture; `found` is about where, as far as depths of pictures are
/// exact. Numbers are f64 from the surfel on.
pub(in crate::views) fn place_of(
    camera: &Camera,
    position: DVec2,
    found: DVec3,
    (cloud, index): (&Cloud, usize),
) -> DVec3 {
    let Some(own) = cloud.positions().get(index) else { return found };
    let center = cloud.origin() + own.as_dvec3();
    let seen = picking::project(camera, center);
    if seen.is_some_and(|seen| seen.position.distance(position) <= NEAR) {
        return center;
    }
    // Round splats lie in no plane of their own.
    if round_of(cloud).get(index).is_some_and(|&is_round| is_round != 0) {
        return found;
    }
    let normal = cloud.normals().get(index).copied().unwrap_or_default().as_dvec3();
    // Both on the line of sight, which is parallel for some projections.
    let near = match camera.projection {
        Projection::Perspective { .. } => camera.eye,
        Projection::Orthographic { .. } => {
            navigation::point_at(camera, position, 0.5 * (found - camera.eye).dot(camera.forward()))
        }
    };
    let Some(sight) = (found - near).try_normalize() else { return found };
    let steep = normal.dot(sight);
    if steep.abs() < STEEPEST {
        return found;
    }
    let met = near + sight * (normal.dot(center - near) / steep);
    // Where several discs blend, the surface lies between them.
    let radius = f64::from(cloud.radii().get(index).copied().unwrap_or_default());
    if met.distance(center) <= 2.0 * radius { met } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::{Buffer, Column};

    fn cloud(origin: DVec3) -> Cloud {
        let column = |name, n, values: &[f32]| Column::new(name, n, Buffer::F32(values.to_vec()));
        let columns = vec![
            column("position", 3, &[0.25, 0.0, 0.0]),
            column("normal", 3, &[0.0, 0.6, 0.8]),
            column("radius", 1, &[1.0]),
        ];
        Cloud::new(origin, columns).unwrap()
    }

    /// Invariant: what is clicked lies on its surfel to f64, though the picture's depth is single precision
    #[test]
    fn what_is_clicked_lies_on_its_surfel() {
        let origin = DVec3::new(481_000.0, 5_456_000.0, 312.0);
        let cloud = cloud(origin);
        let center = origin + DVec3::X * 0.25;
        for projection in
            [Projection::Perspective { fov_y: 0.6 }, Projection::Orthographic { height: 4.0 }]
        {
            let eye = origin + DVec3::new(0.5, 1.0, 6.0);
            let camera = Camera { eye, target: origin, up: DVec3::Y, projection };
            let on_disc = center + DVec3::new(0.5, 0.8 * 0.3, -0.6 * 0.3);
            let position = picking::project(&camera, on_disc).unwrap().position;
            // As far off as a depth in f32 is, along the line of sight.
            let sight = match projection {
                Projection::Perspective { .. } => on_disc - eye,
                Projection::Orthographic { .. } => {
                    camera.forward() * (on_disc - eye).dot(camera.forward())
                }
            };
            let found = on_disc + sight * 1e-6;
            let place = place_of(&camera, position, found, (&cloud, 0));
            assert!(place.distance(on_disc) < 2e-8, "{}", place.distance(on_disc));
            // Near its centre the surfel itself is meant.
            let position = picking::project(&camera, center).unwrap().position + DVec2::X * 0.01;
            assert_eq!(place_of(&camera, position, center + DVec3::Y * 0.01, (&cloud, 0)), center);
            // One that is far away is not what was clicked.
            let away = center + DVec3::new(30.0, 0.0, 0.0);
            let position = picking::project(&camera, away).unwrap().position;
            assert_eq!(place_of(&camera, position, away, (&cloud, 0)), away);
        }
    }
}
