//! Makes one picture of natural light on points, like figures 15 to 25 and 32 to 35 of the thesis:
//! `contact_sheet OUT.png [FOLDER]`.
//!
//! The folder holds `points/igea_points.ply`, `points/bun_zipper_points.ply`, `points/dragon_vrip_points.ply`,
//! `points/mannequin_points.ply` and `probes/rnl_probe.hdr`, `probes/derived/uffizi_angular_from_latlong.hdr`;
//! without it the sample cloud and the built-in lights take the places of all of them.

use glam::DVec3;
use image::{Rgba, RgbaImage, imageops};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::{self, Probe};
use surfelshop_cloud::scene::{Axis, ProbeSource, SceneEnvironment};
use surfelshop_image::display_transform::{
    Background, DisplayTransform, ToneMap, develop_to_8_bit,
};
use surfelshop_render::{Engine, RenderRequest};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::stage;

/// Width and height of one picture, pixels.
const SIDE: u32 = 400;
const COLUMNS: u32 = 4;

struct Sheet {
    engine: Engine,
    pictures: Vec<RgbaImage>,
}

/// One picture.
struct SheetImage<'a> {
    what: &'a str,
    renderer: [&'a str; 2],
    cloud: &'a Cloud,
    probe: &'a Probe,
    values: Vec<(&'a str, Value)>,
    /// Whether z points upwards in the model, and its front along -y.
    z_up: bool,
    two_sided: bool,
}

impl Sheet {
    fn add(&mut self, shot: SheetImage<'_>) -> anyhow::Result<()> {
        let [library, unit] = shot.renderer;
        let mut renderer = stage::built_renderer(&self.engine, library, unit);
        let mut environment = around(shot.probe);
        if shot.z_up {
            let source = ProbeSource::Studio;
            let (forward, up) = (Axis::PlusY, Axis::PlusZ);
            let turned = SceneEnvironment { forward, up, ..SceneEnvironment::new(source) };
            environment.probe_from_world = turned.probe_from_world();
        }
        let list = shot.values.into_iter();
        let values: Values = list.map(|(id, value)| (id.to_owned(), value)).collect();
        // The scans are closed: seen from both sides they would have bright dots of their far side
        // along their outlines.
        let mut scene = Scene::default();
        scene.surface.two_sided = shot.two_sided;
        let rendered = self.engine.render(
            &mut renderer,
            &RenderRequest {
                clouds: &[shot.cloud.view()],
                facts: shot.cloud.facts(),
                scene: &scene,
                view: view(shot.cloud, shot.z_up),
                values: &values,
                outputs: &[Output::Color],
                frame_index: 0,
                environment: Some(view_of(&environment, shot.probe)),
                stride: 1,
                detail_px: 0.0,
                parts: None,
                eye_dome: None,
            },
        )?;
        let color = rendered.image(&Output::Color).ok_or_else(|| anyhow::anyhow!("no picture"))?;
        let how = DisplayTransform {
            exposure_stops: 0.0,
            tone_map: ToneMap::Neutral,
            background: Background::Color([0.2; 3]),
        };
        let levels = develop_to_8_bit(color, &how);
        let picture = RgbaImage::from_raw(SIDE, SIDE, levels);
        self.pictures.extend(picture);
        println!("{:2}  {} (light of {})", self.pictures.len(), shot.what, shot.probe.name);
        Ok(())
    }

    fn save(&self, path: &Path) -> anyhow::Result<()> {
        let rows = (self.pictures.len() as u32).div_ceil(COLUMNS);
        let mut sheet = RgbaImage::from_pixel(COLUMNS * SIDE, rows * SIDE, Rgba([51, 51, 51, 255]));
        for (i, picture) in self.pictures.iter().enumerate() {
            let (x, y) = (i as u32 % COLUMNS * SIDE, i as u32 / COLUMNS * SIDE);
            imageops::replace(&mut sheet, picture, i64::from(x), i64::from(y));
        }
        sheet.save(path)?;
        Ok(())
    }
}

/// From the front, a little to the side and above.
fn view(cloud: &Cloud, z_up: bool) -> View {
    let facts = cloud.facts();
    let target = 0.5 * (facts.bounds_min + facts.bounds_max);
    let reach = (facts.bounds_max - facts.bounds_min).length();
    let (away, up) = match z_up {
        true => (DVec3::new(0.35, -1.0, 0.2), DVec3::Z),
        false => (DVec3::new(0.35, 0.2, 1.0), DVec3::Y),
    };
    let away = away.normalize_or(DVec3::Z);
    let camera = Camera {
        eye: target + 1.9 * reach * away,
        target,
        up,
        projection: Projection::Perspective { fov_y: 0.5 },
    };
    View { camera, size_px: [SIDE; 2], near: 1e-3 * reach, far: 10.0 * reach }
}

fn cloud(path: &Path) -> anyhow::Result<Cloud> {
    Ok(surfelshop_cloud::read(path, &Default::default())?.cloud)
}

pub(crate) fn run() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(2).map(PathBuf::from);
    let out = arguments.next().ok_or_else(|| anyhow::anyhow!("contact_sheet OUT.png [FOLDER]"))?;
    let folder = arguments.next();
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/sample.ply");
    let model = |name: &str| match &folder {
        Some(folder) => cloud(&folder.join("points").join(format!("{name}_points.ply"))),
        None => cloud(&sample),
    };
    let (rnl, uffizi) = match &folder {
        Some(folder) => {
            let probes = folder.join("probes");
            let uffizi = probes.join("derived/uffizi_angular_from_latlong.hdr");
            (
                environment_map::read(probes.join("rnl_probe.hdr"), None)?,
                environment_map::read(uffizi, None)?,
            )
        }
        None => (Probe::studio(), Probe::sky()),
    };
    let (igea, bunny) = (model("igea")?, model("bun_zipper")?);
    let (dragon, mannequin) = (model("dragon_vrip")?, model("mannequin")?);
    let mut sheet = Sheet { engine: stage::fresh_engine(), pictures: Vec::new() };
    let natural = ["surfelshop-environment", "environment"];
    let (number, text) = (Value::Float, |text: &str| Value::Text(text.to_owned()));
    let matte = || vec![("ks", number(0.0)), ("background", text("sharp"))];
    let thesis = |kd: f64, ks: f64, c: f64| {
        vec![("model", text("thesis")), ("kd", number(kd)), ("ks", number(ks)), ("c", number(c))]
    };
    let mut add = |what: &'static str, renderer, cloud, probe, values| {
        let two_sided = folder.is_none();
        let z_up = what.contains("mannequin") && folder.is_some();
        sheet.add(SheetImage { what, renderer, cloud, probe, values, z_up, two_sided })
    };
    add("figure 15: Igea, matte, rnl", natural, &igea, &rnl, matte())?;
    add("figure 17: Igea, matte, uffizi", natural, &igea, &uffizi, matte())?;
    add("figure 20: matte alone", natural, &bunny, &rnl, thesis(1.0, 0.0, 0.5))?;
    add("figure 21: little gloss", natural, &bunny, &rnl, thesis(0.8, 1.0, 0.6))?;
    add("figure 22: medium gloss", natural, &bunny, &rnl, thesis(0.8, 1.0, 0.3))?;
    add("figure 23: high gloss", natural, &bunny, &rnl, thesis(0.6, 1.0, 0.05))?;
    let phong = ["surfelshop-ewa-phong", "ewa-phong"];
    add("figure 24: the baseline", phong, &dragon, &rnl, Vec::new())?;
    add("figure 25: natural light", natural, &dragon, &rnl, thesis(0.8, 0.2, 0.3))?;
    add("figure 32: mannequin, rnl", natural, &mannequin, &rnl, thesis(0.7, 0.3, 0.3))?;
    add("figure 34: mannequin, uffizi", natural, &mannequin, &uffizi, thesis(0.7, 0.3, 0.3))?;
    for (what, roughness) in [("mirror of metal", 0.0), ("brushed metal", 0.35)] {
        let metal = vec![
            ("kd", number(0.0)),
            ("metallic", number(1.0)),
            ("roughness", number(roughness)),
            ("background", text("blurred")),
        ];
        add(what, natural, &dragon, &uffizi, metal)?;
    }
    sheet.save(&out)
}
