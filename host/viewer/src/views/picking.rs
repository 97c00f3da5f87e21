//! Points of the scene are projected into a picture and dragged in it.
//!
//! As in `navigation`, positions in the picture are fractions of its height, y downwards, from its middle.

use crate::views::navigation;
use glam::{DVec2, DVec3};
use surfelshop_api::{Camera, View};
pub(crate) use surfelshop_session::output::measures::{ScreenPoint, project, project_line};

/// A drag along the line of sight by this fraction of the picture's height multiplies the distance by e.
const PER_E: f64 = 0.5;

/// Whether a position lies within the picture of a view.
pub(crate) fn is_in_view(view: &View, position: DVec2) -> bool {
    position.x.abs() <= 0.5 * view.aspect() && position.y.abs() <= 0.5
}

/// Moves a point parallel to the picture plane, to where it projects to `position`.
pub(crate) fn drag_across(camera: &Camera, place: DVec3, position: DVec2) -> Option<DVec3> {
    let moved = navigation::point_at(camera, position, project(camera, place)?.depth);
    moved.is_finite().then_some(moved)
}

/// Moves a point along its line of sight, away for a drag upwards; `upwards` in picture heights. The
/// distance is multiplied, so that the point never gets behind the camera.
pub(crate) fn drag_along(camera: &Camera, place: DVec3, upwards: f64) -> Option<DVec3> {
    let ScreenPoint { position, depth } = project(camera, place)?;
    let moved = navigation::point_at(camera, position, depth * (upwards / PER_E).exp());
    // A point that is too near or too far to be projected stays.
    project(camera, moved).and(moved.is_finite().then_some(moved))
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::Projection;

    const BOTH: [Projection; 2] =
        [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 3.0 }];

    /// A view far from the origin, twice as wide as high.
    fn view(projection: Projection) -> View {
        let (eye, target) = (DVec3::new(103.0, 2.0, 5.0), DVec3::new(101.0, 0.5, 0.0));
        let camera = Camera { eye, target, up: DVec3::Y, projection };
        View { camera, size_px: [640, 320], near: 0.1, far: 100.0 }
    }

    #[test]
    fn places_are_seen_where_the_view_puts_them() {
        for projection in BOTH {
            let view = view(projection);
            for place in
                [view.camera.target, DVec3::new(100.3, 1.1, -0.7), DVec3::new(102.0, 0.0, 2.0)]
            {
                let ScreenPoint { position, depth } = project(&view.camera, place).unwrap();
                let in_view = view.view_from_offset(DVec3::ZERO).transform_point3(place);
                let clip = view.clip_from_view() * in_view.as_vec3().extend(1.0);
                let expected = DVec2::new(
                    f64::from(clip.x / clip.w) * 0.5 * view.aspect(),
                    f64::from(-clip.y / clip.w) * 0.5,
                );
                assert!(position.distance(expected) < 1e-5, "{position} for {expected}");
                assert!((depth + in_view.z).abs() < 1e-12);
            }
            assert!(project(&view.camera, view.camera.target).unwrap().position.length() < 1e-12);
            let behind = 2.0 * view.camera.eye - view.camera.target;
            assert_eq!(project(&view.camera, behind), None);
            assert_eq!(project(&view.camera, DVec3::NAN), None);
        }
        let wide = view(BOTH[0]);
        assert!(
            is_in_view(&wide, DVec2::new(-0.99, 0.49)) && !is_in_view(&wide, DVec2::new(0.0, 0.51))
        );
        assert!(!is_in_view(&wide, DVec2::new(1.01, 0.0)));
    }

    #[test]
    fn what_is_moved_across_stays_under_the_pointer_and_in_its_plane() {
        for projection in BOTH {
            let camera = view(projection).camera;
            let mut place = DVec3::new(100.3, 1.1, -0.7);
            let depth = project(&camera, place).unwrap().depth;
            for position in [DVec2::new(0.4, -0.3), DVec2::new(-0.9, 0.5), DVec2::new(3.0, 0.0)] {
                place = drag_across(&camera, place, position).unwrap();
                let now = project(&camera, place).unwrap();
                assert!(now.position.distance(position) < 1e-9, "{now:?}");
                assert!((now.depth - depth).abs() < 1e-9 * depth, "{now:?}");
            }
        }
    }

    #[test]
    fn what_is_moved_along_stays_where_it_is_seen() {
        for projection in BOTH {
            let camera = view(projection).camera;
            let place = DVec3::new(100.3, 1.1, -0.7);
            let before = project(&camera, place).unwrap();
            for upwards in [0.25, -0.25, 1.0, -2.0] {
                let moved = drag_along(&camera, place, upwards).unwrap();
                let now = project(&camera, moved).unwrap();
                assert!(now.position.distance(before.position) < 1e-9, "{now:?}");
                assert!(((now.depth / before.depth).ln() / upwards - 2.0).abs() < 1e-6, "{now:?}");
                // And back.
                let back = drag_along(&camera, moved, -upwards).unwrap();
                assert!(back.distance(place) < 1e-9);
            }
            assert_eq!(drag_along(&camera, place, f64::MAX), None);
        }
    }

    #[test]
    fn a_line_ends_at_the_camera() {
        for projection in BOTH {
            let camera = view(projection).camera;
            let (near, far) = (camera.target, camera.target + camera.forward() + DVec3::Y);
            let place = |share: f64| far.lerp(camera.eye, share);
            let whole = project_line(&camera, [near, far]).unwrap();
            let ends = [near, far].map(|end| project(&camera, end).unwrap().position);
            assert_eq!(whole, ends);
            let beyond = project_line(&camera, [far, 2.0 * camera.eye - near]).unwrap();
            assert_eq!(beyond[0], ends[1]);
            assert!(beyond[1].is_finite());
            let other_way = project_line(&camera, [2.0 * camera.eye - near, far]).unwrap();
            assert!(other_way[0].distance(beyond[1]) < 1e-9 && other_way[1] == beyond[0]);
            assert_eq!(project_line(&camera, [place(1.5), place(2.0)]), None);
        }
    }
}
