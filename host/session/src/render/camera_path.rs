//! The cameras of a command: one, or several along a path.

use crate::input::clouds::Clouds;
use crate::options::PictureArguments;
use crate::options::camera::{self, Extent};
use crate::options::path::PathSpec;
use crate::render;
use crate::setup::RenderSetup;
use anyhow::ensure;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use surfelshop_api::{Camera, Projection, View};
use surfelshop_cloud::scene::{OpenedScene, SceneFile};

/// A picture of the path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// What tells it from the others: the number, and of a view its renderer. Empty where it is the
    /// only one.
    pub name: String,
    /// The view.
    pub view: View,
}

impl Frame {
    /// The number in its name; empty where it is the only one.
    #[must_use]
    pub fn number(&self) -> &str {
        self.name.split(' ').next().unwrap_or_default()
    }
}

/// All pictures of a path; one where there is none.
///
/// # Errors
/// One line where a scene lacks the cameras that the path needs.
pub fn frames(
    path: Option<PathSpec>,
    picture: &PictureArguments,
    staging: &RenderSetup,
    opened: Option<&OpenedScene>,
    clouds: &Clouds,
) -> anyhow::Result<Vec<Frame>> {
    // It looks at every surfel.
    let extent = clouds.extent(staging.scene.surface.radius_scale);
    let view = |camera: Camera| {
        let staging = RenderSetup { camera: Some(camera), ..staging.clone() };
        render::view_of(picture, &staging, clouds, &extent)
    };
    let seen = render::view_of(picture, staging, clouds, &extent);
    let of_scene = || of_views(opened.map(|opened| &opened.scene));
    let cameras: Vec<(String, View)> = match path {
        None => return Ok(vec![Frame { name: String::new(), view: seen }]),
        Some(PathSpec::Orbit(n)) => {
            orbit(&seen, &extent, n).map(|view| (String::new(), view)).collect()
        }
        Some(PathSpec::Views) => {
            of_scene().into_iter().map(|(name, camera)| (name, view(camera))).collect()
        }
        Some(PathSpec::Along(n)) => {
            let keys: Vec<Camera> = of_scene().into_iter().map(|(_, camera)| camera).collect();
            ensure!(
                keys.len() > 1,
                "--path along:{n}: expected a scene whose views have two cameras or more, found {}; \
                 try orbit:{n}",
                keys.len()
            );
            let path = path_of(&keys, n as usize).into_iter();
            path.map(|camera| (String::new(), view(camera))).collect()
        }
    };
    ensure!(
        !cameras.is_empty(),
        "--path views: expected a scene whose views have cameras, found none; try orbit:24"
    );
    let n = cameras.len();
    let digits = n.to_string().len();
    let frame = |(i, (name, view)): (usize, (String, View))| {
        let number = format!("{:0digits$}", i + 1);
        let name = if name.is_empty() { number } else { format!("{number} {name}") };
        Frame { name, view }
    };
    Ok(cameras.into_iter().enumerate().map(frame).collect())
}

/// The views of a camera that goes once around what it looks at.
pub fn orbit<'a>(seen: &'a View, extent: &'a Extent, n: u32) -> impl Iterator<Item = View> + 'a {
    // The lens has been put on already, and must not be put on again.
    (0..n).map(move |i| camera::framed_view(turned(&seen.camera, i, n), extent, seen.size_px))
}

/// Cameras evenly around the target; the last one is a step before the first.
#[must_use]
pub fn turntable(camera: Camera, n_frames: usize) -> Vec<Camera> {
    let n = u32::try_from(n_frames).unwrap_or(u32::MAX);
    (0..n).map(|i| turned(&camera, i, n)).collect()
}

/// Cameras along a smooth curve through the key cameras, which are reached at equal intervals.
///
/// With fewer than two keys or frames these keys are all.
///
/// Source: Catmull & Rom 1974, the uniform spline; ends are repeated.
#[must_use]
pub fn path_of(keys: &[Camera], n_frames: usize) -> Vec<Camera> {
    if keys.len() < 2 || n_frames < 2 {
        return keys.to_vec();
    }
    let n_parts = keys.len() - 1;
    let at = |i: isize| &keys[i.clamp(0, n_parts as isize) as usize];
    let frame = |i: usize| {
        let place = n_parts as f64 * i as f64 / (n_frames - 1) as f64;
        let part = (place.floor() as usize).min(n_parts - 1);
        let t = place - part as f64;
        let key = |k: isize| at(part as isize + k);
        let spline = |value: fn(&Camera) -> DVec3| {
            let [a, b, c, d] = [-1, 0, 1, 2].map(|k| value(key(k)));
            let (t2, t3) = (t * t, t * t * t);
            0.5 * (2.0 * b
                + (c - a) * t
                + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
                + (3.0 * b - a - 3.0 * c + d) * t3)
        };
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let projection = match (key(0).projection, key(1).projection) {
            (Projection::Perspective { fov_y: a }, Projection::Perspective { fov_y: b }) => {
                Projection::Perspective { fov_y: mix(a, b) }
            }
            (Projection::Orthographic { height: a }, Projection::Orthographic { height: b }) => {
                Projection::Orthographic { height: mix(a, b) }
            }
            (projection, _) => projection,
        };
        Camera {
            eye: spline(|camera| camera.eye),
            target: spline(|camera| camera.target),
            up: spline(|camera| camera.up),
            projection,
        }
    };
    (0..n_frames).map(frame).collect()
}

/// A camera on its way once around what it looks at, about its upward direction.
fn turned(camera: &Camera, number: u32, n: u32) -> Camera {
    let angle = std::f64::consts::TAU * f64::from(number) / f64::from(n);
    let Some(axis) = camera.up.try_normalize() else { return *camera };
    let eye = camera.target + DQuat::from_axis_angle(axis, angle) * (camera.eye - camera.target);
    Camera { eye, ..*camera }
}

/// The cameras of a scene's views, each once, with their renderers' names.
fn of_views(scene: Option<&SceneFile>) -> Vec<(String, Camera)> {
    let mut all: Vec<(String, Camera)> = Vec::new();
    for (scene, view) in scene.into_iter().flat_map(|s| s.views.iter().map(move |view| (s, view))) {
        if let Some(camera) = scene.camera_of(view)
            && all.iter().all(|(_, other)| *other != camera)
        {
            all.push((view.renderer.clone(), camera));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orbit_keeps_its_distance_and_height() {
        let projection = Projection::Perspective { fov_y: 0.6 };
        let (eye, target) = (DVec3::new(3.0, 2.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
        let camera = Camera { eye, target, up: DVec3::Y * 5.0, projection };
        assert_eq!(turned(&camera, 0, 4), camera);
        let places = [[1.0, 2.0, -2.0], [-1.0, 2.0, 0.0], [1.0, 2.0, 2.0]];
        for (i, place) in places.into_iter().enumerate() {
            let found = turned(&camera, i as u32 + 1, 4).eye;
            assert!(found.distance(DVec3::from(place)) < 1e-12, "{found}");
        }
    }

    fn camera(eye: DVec3) -> Camera {
        let projection = Projection::Perspective { fov_y: 0.6 };
        Camera { eye, target: DVec3::new(1.0, 0.0, 0.0), up: DVec3::Y, projection }
    }

    #[test]
    fn a_turn_goes_once_around_and_keeps_its_distance() {
        let around = turntable(camera(DVec3::new(1.0, 2.0, 4.0)), 8);
        assert_eq!(around.len(), 8);
        for pair in around.windows(2) {
            let step = pair[0].eye.distance(pair[1].eye);
            assert!((step - 8.0 * (std::f64::consts::PI / 8.0).sin()).abs() < 1e-9);
            assert!((pair[0].eye.distance(pair[0].target) - 20f64.sqrt()).abs() < 1e-9);
        }
        let half = around[4].eye;
        assert!((half - DVec3::new(1.0, 2.0, -4.0)).length() < 1e-9, "{half}");
    }

    #[test]
    fn a_path_passes_its_cameras_at_equal_intervals() {
        let keys = [DVec3::Z, DVec3::X * 3.0, DVec3::new(2.0, 5.0, 1.0)].map(camera);
        let path = path_of(&keys, 21);
        for (frame, key) in [(0, 0), (10, 1), (20, 2)] {
            assert!((path[frame].eye - keys[key].eye).length() < 1e-12);
        }
        let longest = path.windows(2).map(|pair| pair[0].eye.distance(pair[1].eye));
        assert!(longest.fold(0.0, f64::max) < 1.0);
    }
}
