//! What is in a scene, for `surfelshop info`; its clouds are looked for and not read.

use serde_json::{Value, json};
use std::fmt::{self, Write as _};
use surfelshop_api::{Camera, Light, Projection, SurfaceSettings};
use surfelshop_cloud::display::ColorSource;
use surfelshop_cloud::scene::{
    Backdrop, EyeDomeLighting, FORMAT, OpenedScene, SceneCloud, SceneEnvironment, SceneFile,
    SceneView, ToneMap,
};
use surfelshop_cloud::{Rotation, Transform};
use surfelshop_session::input::environment_map;
use surfelshop_session::output::json::plain;

/// A scene in JSON; angles are radians, as everywhere in JSON.
pub(crate) fn object(opened: &OpenedScene) -> Value {
    let scene = &opened.scene;
    let cloud = |(cloud, line): (&SceneCloud, &usize)| {
        let path = scene.path_of(cloud);
        let transform = cloud.transform.as_ref().map(|t| {
            json!({
                "translation": t.translation,
                "quaternion": t.rotation.quaternion(),
                "scale": t.scale,
            })
        });
        json!({
            "path": path.display().to_string(),
            "line": line,
            "name": cloud.name,
            "visible": cloud.visible,
            "found": path.exists(),
            "transform": transform,
        })
    };
    let view = |(view, line): (&SceneView, &usize)| {
        let values: serde_json::Map<String, Value> =
            view.values.iter().map(|(id, value)| (id.clone(), plain(value))).collect();
        json!({
            "renderer": view.renderer,
            "line": line,
            "output": view.output.name(),
            "parameters": values,
            "camera": scene.camera_of(view),
            "own_camera": view.camera.is_some(),
        })
    };
    let clouds = scene.clouds.iter().map(|cloud| &cloud.known).zip(&opened.cloud_lines);
    let views = scene.views.iter().map(|view| &view.known).zip(&opened.view_lines);
    json!({
        "file": opened.path.display().to_string(),
        "format": FORMAT,
        "clouds": clouds.map(cloud).collect::<Vec<_>>(),
        "views": views.map(view).collect::<Vec<_>>(),
        "camera": scene.camera.as_ref().map(|camera| camera.known),
        "scene": scene.scene(),
        "environment": environment_map::of_scene(scene).map(|environment| json!({
            "probe": environment_map::name(&environment.source),
            "mapping": environment.mapping.map(|mapping| mapping.name()),
            "forward": environment.forward.name(),
            "up": environment.up.name(),
            "rotation": environment.rotation,
            "exposure": environment.stops,
        })),
        "up": scene.up.map(|up| up.name()),
        "color": scene.color.known.to_string(),
        "filters": scene.filters.iter().map(|filter| filter.known.to_string()).collect::<Vec<_>>(),
        "tone_map": tone_map(scene),
        "antialias": scene.antialias,
        "eye_dome_lighting": scene.eye_dome.when.name(),
        "eye_dome_strength": scene.eye_dome.strength,
        "eye_dome_radius": scene.eye_dome.radius,
        "background": match scene.background {
            Backdrop::Transparent => None,
            Backdrop::Color(linear) => Some(json!(linear)),
            Backdrop::Gradient { top, bottom } => Some(json!([top, bottom])),
        },
        "warnings": opened.warnings,
    })
}

fn tone_map(scene: &SceneFile) -> &'static str {
    match scene.tone_map {
        ToneMap::Clamp => "clamp",
        ToneMap::Neutral => "neutral",
    }
}

/// A row for each thing to know.
pub(crate) fn text(opened: &OpenedScene) -> Result<String, fmt::Error> {
    let scene = &opened.scene;
    let mut text = opened.path.display().to_string();
    let mut row = |name: &str, value: String| {
        // Names in a scene must not steer the terminal.
        let value: String = value.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        write!(text, "\n  {name:<9} {value}")
    };
    row("format", format!("scene, version {FORMAT}"))?;
    for (i, cloud) in scene.clouds.iter().enumerate() {
        row(if i == 0 { "clouds" } else { "" }, cloud_line(scene, cloud))?;
    }
    for (i, view) in scene.views.iter().enumerate() {
        row(if i == 0 { "views" } else { "" }, view_line(view))?;
    }
    row("camera", scene.camera.as_ref().map_or("none".to_owned(), |camera| camera_line(camera)))?;
    let stops = scene.exposure_stops;
    let lights = lights_line(scene);
    let tone_map = tone_map(scene);
    row("light", format!("{lights}, exposure {stops} stops, tone map {tone_map}"))?;
    if let Some(environment) = environment_map::of_scene(scene) {
        row("around", environment_line(&environment))?;
    }
    if scene.antialias > 1 {
        row("edges", format!("antialiased, {} samples", scene.antialias))?;
    }
    if scene.eye_dome != EyeDomeLighting::default() {
        row("eye dome", scene.eye_dome.to_string())?;
    }
    let splats = scene.splats.known.to_string();
    let splats = if splats.is_empty() { splats } else { format!(", drawn as {splats}") };
    row("surface", surface_line(&scene.surface) + &splats)?;
    if scene.color.known != ColorSource::default() {
        row("colours", scene.color.known.to_string())?;
    }
    for (i, filter) in scene.filters.iter().enumerate() {
        row(if i == 0 { "filters" } else { "" }, filter.known.to_string())?;
    }
    for warning in &opened.warnings {
        row("warning", warning.clone())?;
    }
    Ok(text)
}

/// How many lights there are of each kind.
fn lights_line(scene: &SceneFile) -> String {
    let mut n = [0; 3];
    for light in &scene.lights {
        n[match light.known {
            Light::Directional { .. } => 0,
            Light::Point { .. } => 1,
            Light::Spot { .. } => 2,
        }] += 1;
    }
    let kinds = n.into_iter().zip(["directional", "point", "spot"]);
    let known = kinds.filter(|(n, _)| *n > 0).map(|(n, kind)| format!("{n} {kind}"));
    let line = known.collect::<Vec<_>>().join(", ");
    if line.is_empty() { "none".to_owned() } else { line }
}

fn cloud_line(scene: &SceneFile, cloud: &SceneCloud) -> String {
    let mut line = cloud.path.display().to_string();
    if let Some(name) = &cloud.name {
        line += &format!(" ({name})");
    }
    if let Some(transform) = &cloud.transform {
        line += &transform_words(transform);
    }
    line += if cloud.visible { "" } else { ", hidden" };
    line += if scene.path_of(cloud).exists() { "" } else { ", not found" };
    line
}

fn transform_words(transform: &Transform) -> String {
    let usual = Transform::default();
    let mut words = String::new();
    if transform.scale.to_bits() != usual.scale.to_bits() {
        words += &format!(", scaled by {}", transform.scale);
    }
    words += &match transform.rotation {
        rotation if rotation == usual.rotation => String::new(),
        Rotation::Euler(angles) => {
            format!(", turned by {} degrees", spaced(angles.to_array().map(degrees)))
        }
        Rotation::Quaternion(_) => ", turned".to_owned(),
    };
    if transform.translation != usual.translation {
        words += &format!(", moved by {}", spaced(transform.translation.to_array()));
    }
    words
}

/// Degrees with as many decimals as can be seen.
fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e4).round() / 1e4
}

fn spaced(numbers: [f64; 3]) -> String {
    numbers.map(|number| number.to_string()).join(" ")
}

fn view_line(view: &SceneView) -> String {
    let mut line = format!("{}: {}", view.renderer, view.output.name());
    for (id, value) in &view.values {
        line += &format!(", {id} = {}", plain(value));
    }
    line += if view.camera.is_some() { ", a camera of its own" } else { "" };
    line
}

fn camera_line(camera: &Camera) -> String {
    let lens = match camera.projection {
        Projection::Perspective { fov_y } => format!("{} degrees", degrees(fov_y)),
        Projection::Orthographic { height } => format!("parallel, height {height}"),
    };
    let [eye, target] = [camera.eye, camera.target].map(|place| spaced(place.to_array()));
    format!("at {eye}, towards {target}, {lens}")
}

fn environment_line(environment: &SceneEnvironment) -> String {
    let mut line = environment_map::name(&environment.source);
    if let Some(mapping) = environment.mapping {
        line += &format!(", {}", mapping.name());
    }
    let (forward, up) = (environment.forward.name(), environment.up.name());
    let (turn, stops) = (degrees(environment.rotation), environment.stops);
    line + &format!(", centre at {forward}, up at {up}, turned by {turn} degrees, {stops} stops")
}

fn surface_line(surface: &SurfaceSettings) -> String {
    let SurfaceSettings { depth_tolerance, two_sided, radius_scale, low_pass } = surface;
    let sides = if *two_sided { "two-sided" } else { "one-sided" };
    format!(
        "{sides}, radii x {radius_scale}, depth tolerance {depth_tolerance} radii, low-pass \
         {low_pass} px"
    )
}
