use super::{file, open, written};
use crate::cloud::axis::Axis;
use crate::display::{
    Attribute, ColorBy, ColorMap, ColorSource, DisplaySettings, MapChoice, RangeEnd, Scale,
};
use crate::scene::{Backdrop, SceneCloud, SceneFile, SceneView, ToneMap, is_scene, read};
use crate::{Rotation, Transform};
use glam::{DQuat, DVec3, Vec3};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, srgb_to_linear};
use surfelshop_api::{Camera, Light, Projection, Scene, SurfaceSettings};

/// Every key there is, in another order and form than they are written in.
const FULL: &str = r##"
format = 1
background = "#dfe3e4"
tone_map = 'neutral'
exposure = -1
up = 'z'
layout = { panes = [ { size = 0.5 }, { size = 0.25 } ], "odd key" = 1979-05-27 }

camera = { eye = [0.9, 1.95, 1.9], target = [-0.02, 1.55, 0], fov = 24 }

[[views]]
renderer = "ewa-phong"
values = { shininess = 256, "rim.power" = 1.5, tint = [1, 0.5, 0.1], how = "exact", on = true }

[[views]]
renderer = "org.example.mine/flat"
output = "debug.heat"
camera.eye = [0, 0, 5e6]
camera.target = [0, 0, 0]
camera.up = [0, 0.5, 0]
camera.height = 2.5

[surface]
two_sided = false
depth_tolerance = 0.5
radius_scale = 1.25
low_pass = 0

[[lights]]
towards = [-0.6, 1.0, 0.7]
radiance = [1.0, 0.95, 0.85]

[[lights]]
towards = [0, 0, 1]
follows_camera = true

[[clouds]]
path = "snail.ply"

[[clouds]]
path = "../data/scan of \"it\".ply"
name = "Scan"
visible = false
[clouds.transform]
translation = [5e6, 0.001, -4]
rotation = [90, 0, 45.3]
scale = 0.01

[[clouds]]
path = "/data/a.ply"
transform.quaternion = [0, 0, 0, 2]

[color]
by = "column:height"
component = 2
range = ["5%", 12]
scale = "log"
map = "turbo"

[[filter]]
column = "classification"
action = "hide"
values = [7, 18]

[[filter]]
column = "height"
action = "keep"
range = [-1, inf]
"##;

/// The same as it is written.
const WRITTEN: &str = r##"# A Surfelshop scene: angles in degrees, paths from this folder.
format = 1
exposure = -1.0
tone_map = "neutral"
background = "#dfe3e4"
up = "z"

[[lights]]
towards = [-0.6, 1.0, 0.7]
radiance = [1.0, 0.95, 0.85]
follows_camera = false

[[lights]]
towards = [0.0, 0.0, 1.0]
radiance = [1.0, 1.0, 1.0]
follows_camera = true

[surface]
depth_tolerance = 0.5
two_sided = false
radius_scale = 1.25
low_pass = 0.0

[color]
by = "column:height"
component = 2
map = "turbo"
scale = "log"
range = ["5%", 12.0]

[[filter]]
column = "classification"
action = "hide"
values = [7, 18]

[[filter]]
column = "height"
action = "keep"
range = [-1.0, inf]

[camera]
eye = [0.9, 1.95, 1.9]
target = [-0.02, 1.55, 0.0]
up = [0.0, 1.0, 0.0]
fov = 24.0

[[clouds]]
path = "snail.ply"

[[clouds]]
path = "../data/scan of \"it\".ply"
name = "Scan"
visible = false

[clouds.transform]
translation = [5000000.0, 0.001, -4.0]
rotation = [90.0, 0.0, 45.3]
scale = 0.01

[[clouds]]
path = "/data/a.ply"

[clouds.transform]
translation = [0.0, 0.0, 0.0]
quaternion = [0.0, 0.0, 0.0, 2.0]
scale = 1.0

[[views]]
renderer = "ewa-phong"

[views.values]
how = "exact"
on = true
"rim.power" = 1.5
shininess = 256
tint = [1.0, 0.5, 0.1]

[[views]]
renderer = "org.example.mine/flat"
output = "debug.heat"

[views.camera]
eye = [0.0, 0.0, 5000000.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 0.5, 0.0]
height = 2.5

[layout]
"odd key" = 1979-05-27

[[layout.panes]]
size = 0.5

[[layout.panes]]
size = 0.25
"##;

#[test]
fn everything_in_a_scene_is_read() {
    let opened = open(FULL);
    assert_eq!(opened.warnings, [""; 0]);
    let scene = &opened.scene;
    assert_eq!((scene.exposure_stops, scene.tone_map), (-1.0, ToneMap::Neutral));
    let encoded = [0xdf, 0xe3, 0xe4].map(|code| srgb_to_linear(code as f32 / 255.0));
    assert_eq!(scene.background, Backdrop::Color(encoded));
    let camera = Camera {
        eye: DVec3::new(0.9, 1.95, 1.9),
        target: DVec3::new(-0.02, 1.55, 0.0),
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 24f64.to_radians() },
    };
    assert_eq!(scene.camera_of(&scene.views[0]), Some(camera));
    let own = scene.camera_of(&scene.views[1]).unwrap();
    assert_eq!(own.projection, Projection::Orthographic { height: 2.5 });
    assert_eq!((own.eye, own.up), (DVec3::Z * 5e6, DVec3::Y * 0.5));
    let values = &scene.views[0].values;
    assert_eq!(values["shininess"], Value::Int(256));
    assert_eq!(values["rim.power"], Value::Float(1.5));
    assert_eq!(values["tint"], Value::Color([1.0, 0.5, 0.1]));
    assert_eq!(values["how"], Value::Text("exact".to_owned()));
    assert_eq!(values["on"], Value::Bool(true));
    assert_eq!(scene.views[1].output, Output::Debug("heat".to_owned()));
    let api_scene = scene.scene();
    assert_eq!(api_scene.exposure_stops, -1.0);
    let towards = DVec3::new(-0.6, 1.0, 0.7);
    let radiance = Vec3::new(1.0, 0.95, 0.85);
    let light = Light::Directional { towards, radiance, follows_camera: false };
    assert_eq!((api_scene.lights.len(), api_scene.lights[0]), (2, light));
    let expected = SurfaceSettings {
        depth_tolerance: 0.5,
        two_sided: false,
        radius_scale: 1.25,
        low_pass: 0.0,
    };
    assert_eq!(api_scene.surface, expected);
    let clouds = &scene.clouds;
    assert_eq!((clouds[1].name.as_deref(), clouds[1].visible), (Some("Scan"), false));
    let transform = Transform {
        translation: DVec3::new(5e6, 0.001, -4.0),
        rotation: Rotation::Euler(DVec3::new(90.0, 0.0, 45.3).map(f64::to_radians)),
        scale: 0.01,
    };
    assert_eq!(clouds[1].transform.as_ref().unwrap().known, transform);
    let turned = clouds[2].transform.as_ref().unwrap().rotation;
    assert_eq!(turned, Rotation::Quaternion(DQuat::from_xyzw(0.0, 0.0, 0.0, 2.0)));
    let display = scene.display();
    assert_eq!(display.up, Axis::PlusZ);
    let by = ColorBy::Attribute(Attribute::column("height").with_component(2));
    let range = [RangeEnd::Percent(5.0), RangeEnd::Value(12.0)];
    let (map, scale) = (MapChoice::Map(ColorMap::Turbo), Scale::Logarithmic);
    assert_eq!(display.color, ColorSource { by, map, scale, range });
    let filters = display.filters.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert_eq!(filters, ["hide classification=7,18", "keep height=-1.."]);
    assert_eq!(opened.cloud_lines, [38, 41, 50]);
    assert_eq!(opened.view_lines, [12, 16]);
}

#[test]
fn a_scene_is_written_for_people() {
    let (_folder, _, text) = written(&open(FULL).scene);
    assert_eq!(text, WRITTEN);
}

#[test]
fn the_shortest_scene_has_the_usual_light_and_nothing_else() {
    let scene = open("format = 1").scene;
    assert_eq!(scene.scene(), Scene::default());
    assert_eq!(scene.display(), DisplaySettings::default());
    assert!(scene.display().is_plain(std::iter::empty()));
    let uniform = open("format = 1\ncolor = { by = 'uniform', color = '#ff8000' }").scene;
    assert_eq!(uniform.color.by, ColorBy::Uniform([255, 128, 0]));
    assert!(scene.clouds.is_empty() && scene.views.is_empty() && scene.camera.is_none());
    assert!(open("format = 1\nlights = []").scene.lights.is_empty());
    let opened = open(
        "format = 1\n[[lights]]\nposition = [1, 2, 3]\nintensity = [4, 5, 6]\n[[lights]]\n\
         position = [1, 2, 3]\ntarget = [0, 0, 0]\n[[lights]]\nposition = [1, 2, 3]\n\
         target = [0, 0, 0]\nangle = 45\nsoftness = 0.5\nAngle = 3\n",
    );
    let (position, target) = (DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO);
    let spot = |degrees: f64, softness| Light::Spot {
        position,
        target,
        intensity: Vec3::ONE,
        angle: degrees.to_radians(),
        softness,
    };
    let point = Light::Point { position, intensity: Vec3::new(4.0, 5.0, 6.0) };
    let found: Vec<Light> = opened.scene.lights.iter().map(|light| light.known).collect();
    assert_eq!(found, [point, spot(30.0, 0.2), spot(45.0, 0.5)]);
    assert!(opened.warnings[0].contains("unknown key `lights[3].Angle`, did you mean `angle`?"));
    let camera = "camera = { eye = [0, 0, 1], target = [0, 0, 0] }";
    let camera = open(&format!("format = 1\n{camera}")).scene.camera.unwrap();
    assert_eq!(camera.projection, Projection::Perspective { fov_y: 35f64.to_radians() });
}

/// Invariant: keys of a scene that nobody knows are reported and kept
#[test]
fn unknown_keys_anywhere_are_kept_and_reported() {
    let text = r#"format = 1
camra = { eye = [0.0, 0.0, 1.0] }
lights = [{ towards = [0.0, 1.0, 0.0], Radiance = [2.0, 2.0, 2.0], shadow = "soft" }]
[environment]
probe = "uffizi.exr"
rotaton = 90.0
[surface]
smooth = inf
[camera]
eye = [0.0, 0.0, 1.0]
target = [0.0, 0.0, 0.0]
aperture = 0.1
[[clouds]]
path = "a.ply"
note = [[1, 2.5], { "a b" = "c" }]
[clouds.transform]
skew = -1
[[views]]
renderer = "flat"
quality.best = true
camera = { eye = [0.0, 0.0, 1.0], target = [0.0, 0.0, 0.0], fow = 3.0 }
[color]
by = "file"
rnge = [0.0, 1.0]
[[filter]]
column = "a"
action = "hide"
values = [1]
soft = true
"#;
    let opened = open(text);
    let warnings: Vec<&str> =
        opened.warnings.iter().map(|line| line.split_once(".scene.toml:").unwrap().1).collect();
    let expected = [
        "2:1: unknown key `camra`, did you mean `camera`?",
        "3:40: unknown key `lights[1].Radiance`, did you mean `radiance`?",
        "3:68: unknown key `lights[1].shadow` is kept and has no effect",
        "6:1: unknown key `environment.rotaton`, did you mean `rotation`?",
        "8:1: unknown key `surface.smooth` is kept and has no effect",
        "12:1: unknown key `camera.aperture` is kept and has no effect",
        "15:1: unknown key `clouds[1].note` is kept and has no effect",
        "17:1: unknown key `clouds[1].transform.skew` is kept and has no effect",
        "20:1: unknown key `views[1].quality` is kept and has no effect",
        "21:61: unknown key `views[1].camera.fow`, did you mean `fov`?",
        "24:1: unknown key `color.rnge`, did you mean `range`?",
        "29:1: unknown key `filter[1].soft` is kept and has no effect",
    ];
    assert_eq!(warnings, expected);
    let (_folder, path, text) = written(&opened.scene);
    let again = read(path).unwrap();
    assert_eq!(again.warnings.len(), expected.len());
    for kept in [
        "[camra]\neye = [0.0, 0.0, 1.0]\n",
        "Radiance = [2.0, 2.0, 2.0]\nshadow = \"soft\"\n",
        "rotaton = 90.0\n",
        "smooth = inf\n",
        "aperture = 0.1\n",
        "note = [[1, 2.5], { \"a b\" = \"c\" }]\n",
        "skew = -1\n",
        "[views.quality]\nbest = true\n",
        "fow = 3.0\n",
        "rnge = [0.0, 1.0]\n",
        "soft = true\n",
    ] {
        assert!(text.contains(kept), "`{kept}` is missing in:\n{text}");
    }
}

#[test]
fn thousands_of_unknown_keys_are_reported_in_a_few_lines() {
    let keys: String = (0..5000).map(|i| format!("key{i} = {i}\n")).collect();
    let opened = open(&format!("format = 1\n{keys}"));
    assert_eq!(opened.warnings.len(), 21);
    assert!(opened.warnings[20].ends_with("4980 more unknown keys are kept and have no effect"));
    assert_eq!(opened.scene.unknown.len(), 5000);
}

#[test]
fn clouds_are_found_from_the_folder_of_the_scene() {
    let (folder, path) =
        file("format = 1\n[[clouds]]\npath = 'x/a.ply'\n[[clouds]]\npath = '/b.ply'");
    let scene = read(&path).unwrap().scene;
    assert_eq!(scene.path_of(&scene.clouds[0]), folder.path().join("x/a.ply"));
    assert_eq!(scene.path_of(&scene.clouds[1]), Path::new("/b.ply"));
    assert_eq!(scene.path_in_scene(&folder.path().join("c.ply")), Path::new("c.ply"));
    // A new scene is where the program runs.
    let new = SceneFile::default();
    assert_eq!(new.path_in_scene(Path::new("no-such/c.ply")), Path::new("no-such/c.ply"));
    assert_eq!(new.path_of(&SceneCloud::new("c.ply")), Path::new("c.ply"));
}

#[test]
fn a_scene_saved_elsewhere_finds_its_clouds() {
    let (folder, path) =
        file("format = 1\n[[clouds]]\npath = 'x/a.ply'\n[[clouds]]\npath = '/b.ply'");
    std::fs::create_dir(folder.path().join("deep")).unwrap();
    let scene = read(&path).unwrap().scene;
    let elsewhere = folder.path().join("deep/b.scene.toml");
    scene.write(&elsewhere).unwrap();
    let moved = read(&elsewhere).unwrap().scene;
    assert_eq!(moved.clouds[0].path, Path::new("../x/a.ply"));
    assert_eq!(moved.clouds[1].path, Path::new("/b.ply"));
    moved.write(&path).unwrap();
    assert_eq!(read(&path).unwrap().scene, scene);
}

#[test]
fn scenes_are_told_by_their_names() {
    assert!(is_scene(Path::new("a.scene.toml")) && is_scene(Path::new("x/room.TOML")));
    assert!(!is_scene(Path::new("toml")) && !is_scene(Path::new("a.toml.ply")));
    assert_eq!(SceneView::new("flat").output, Output::Color);
}
