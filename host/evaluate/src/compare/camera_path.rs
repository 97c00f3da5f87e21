//! The cameras of a comparison: one, or several along a path.

use crate::compare::CompareArguments;
use anyhow::bail;
use glam::DQuat;
use surfelshop_api::{Camera, View};
use surfelshop_cloud::scene::{OpenedScene, SceneFile};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::options::camera::{self, Extent};
use surfelshop_session::render;
use surfelshop_session::setup::RenderSetup;

/// Most frames of a path.
const MOST_FRAMES: u32 = 3600;

/// Where the camera goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathSpec {
    /// Once around what it looks at, in so many frames.
    Orbit(u32),
    /// To the cameras of the scene's views, in their order.
    Views,
}

impl PathSpec {
    /// Reads `orbit:N` or `views`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let orbit = text.strip_prefix("orbit:").and_then(|n| n.trim().parse().ok());
        match (text, orbit) {
            ("views", _) => Ok(Self::Views),
            (_, Some(n)) if (1..=MOST_FRAMES).contains(&n) => Ok(Self::Orbit(n)),
            _ => Err(format!("expected orbit:N with N from 1 to {MOST_FRAMES}, or views")),
        }
    }
}

/// A picture of the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// What tells it from the others: the number, and of a view its renderer. Empty where it is the
    /// only one.
    pub name: String,
    /// The view.
    pub view: View,
}

/// All pictures of the path.
pub(super) fn frames(
    arguments: &CompareArguments,
    staging: &RenderSetup,
    opened: Option<&OpenedScene>,
    clouds: &Clouds,
) -> anyhow::Result<Vec<Frame>> {
    let view = |camera: Camera| {
        let staging = RenderSetup { camera: Some(camera), ..staging.clone() };
        render::view(&arguments.picture, &staging, clouds)
    };
    let seen = render::view(&arguments.picture, staging, clouds);
    let cameras: Vec<(String, View)> = match arguments.path {
        None => return Ok(vec![Frame { name: String::new(), view: seen }]),
        Some(PathSpec::Orbit(n)) => {
            let extent = clouds.extent(staging.scene.surface.radius_scale);
            orbit(&seen, &extent, n).map(|view| (String::new(), view)).collect()
        }
        Some(PathSpec::Views) => {
            let views = of_views(opened.map(|opened| &opened.scene));
            views.into_iter().map(|(name, camera)| (name, view(camera))).collect()
        }
    };
    if cameras.is_empty() {
        bail!("--path views: expected a scene whose views have cameras, found none; try orbit:24");
    }
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
    use glam::DVec3;
    use surfelshop_api::Projection;

    #[test]
    fn paths_are_read_or_refused() {
        assert_eq!(PathSpec::parse("orbit:24"), Ok(PathSpec::Orbit(24)));
        assert_eq!(PathSpec::parse("views"), Ok(PathSpec::Views));
        for text in ["orbit", "orbit:0", "orbit:3601", "orbit:-1", "views:2", ""] {
            assert!(PathSpec::parse(text).is_err(), "{text}");
        }
    }

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
}
