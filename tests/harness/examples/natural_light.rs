//! Prints how far the renderer `environment` is from sums over all texels of light probes, by order
//! of its spherical harmonics and by roughness, with what a frame takes; then how long probes take
//! to be read and filtered: `natural_light [PROBE...]`.

#![allow(clippy::print_stdout, reason = "a program that prints a table")]

use glam::DVec3;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::probe::{self, Probe};
use surfelshop_engine::{Engine, PassState, RenderRequest, Rendered, RendererView};
use surfelshop_tests::natural_light::{NaturalLight, around, lone_sun, view_of};
use surfelshop_tests::{clouds, stage};

/// Frames that are timed.
const N_FRAMES: usize = 15;

struct Lab {
    engine: Engine,
    renderer: RendererView,
    cloud: Cloud,
    view: View,
}

impl Lab {
    fn new(size: u32) -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-environment", "environment");
        let mut sphere = clouds::sphere(40_000, 1.0);
        sphere.colors = vec![[255; 3]; sphere.positions.len()];
        let camera = Camera {
            eye: DVec3::new(0.0, 0.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Orthographic { height: 2.1 },
        };
        let view = View { camera, size_px: [size; 2], near: 0.1, far: 10.0 };
        Self { engine, renderer, cloud: sphere.cloud(), view }
    }

    /// Covered pixels from two opposite sides, which show all normals: normals, directions to the
    /// eye and colours.
    fn all_around(&mut self, probe: &Probe, values: &Values) -> anyhow::Result<Vec<Seen>> {
        let mut all = Vec::new();
        for _ in 0..2 {
            let to_eye = self.view.camera.eye.normalize_or(DVec3::Z);
            all.extend(pixels(&self.frame(probe, values)?, to_eye));
            self.view.camera.eye = -self.view.camera.eye;
        }
        Ok(all)
    }

    fn frame(&mut self, probe: &Probe, values: &Values) -> anyhow::Result<Rendered> {
        let environment = around(probe);
        Ok(self.engine.render(
            &mut self.renderer,
            &RenderRequest {
                clouds: &[self.cloud.view()],
                facts: self.cloud.facts(),
                scene: &Scene::default(),
                view: self.view,
                values,
                outputs: &[Output::Color, Output::Normal],
                frame_index: 0,
                environment: Some(view_of(&environment, probe)),
                stride: 1,
            },
        )?)
    }

    /// Median milliseconds of the shading pass.
    fn shading_ms(&mut self, probe: &Probe, values: &Values) -> anyhow::Result<f64> {
        let mut times = Vec::new();
        for _ in 0..N_FRAMES {
            let frame = self.frame(probe, values)?;
            let pass = frame.passes.iter().find(|pass| pass.name == "environment");
            times.extend(pass.and_then(|pass| pass.gpu_ms));
        }
        times.sort_by(f64::total_cmp);
        Ok(times.get(times.len() / 2).copied().unwrap_or(f64::NAN))
    }
}

/// A pixel.
struct Seen {
    normal: DVec3,
    to_eye: DVec3,
    color: [f64; 3],
}

/// The covered pixels.
fn pixels(frame: &Rendered, to_eye: DVec3) -> Vec<Seen> {
    let (Some(color), Some(normal)) = (frame.image(&Output::Color), frame.image(&Output::Normal))
    else {
        return Vec::new();
    };
    let vector = |texel: &[f32]| [0, 1, 2].map(|k| f64::from(texel[k]));
    let pairs = color.data.chunks_exact(4).zip(normal.data.chunks_exact(4));
    pairs
        .filter(|(_, normal)| normal[3] > 0.0)
        .map(|(color, normal)| Seen {
            normal: DVec3::from(vector(normal)).normalize_or(DVec3::Z),
            to_eye,
            color: vector(color),
        })
        .collect()
}

/// Mean and largest error as shares of the mean reference, and the smallest value found.
fn errors(pixels: &[Seen], reference: impl Fn(&Seen) -> [f64; 3]) -> [f64; 3] {
    let (mut sum, mut largest, mut scale, mut least) = (0.0, 0.0f64, 0.0, f64::INFINITY);
    for seen in pixels {
        for (found, expected) in seen.color.iter().zip(reference(seen)) {
            sum += (found - expected).abs();
            largest = largest.max((found - expected).abs());
            scale += expected;
            least = least.min(*found);
        }
    }
    [sum / scale, largest * 3.0 * pixels.len() as f64 / scale, least]
}

fn main() -> anyhow::Result<()> {
    let mut probes = vec![
        Probe::constant([1.0; 3]),
        Probe::studio(),
        Probe::from_picture("a lone sun of 1e5", lone_sun(1e5), None)?,
    ];
    let files: Vec<String> = std::env::args().skip(1).collect();
    for file in &files {
        probes.push(probe::read(file, None)?);
    }
    let (mut small, mut large) = (Lab::new(48), Lab::new(512));
    println!("{}\n", small.engine.gpu().describe());
    matte(&mut small, &mut large, &probes)?;
    shiny(&mut small, &probes)?;
    reading(&files)
}

fn matte(small: &mut Lab, large: &mut Lab, probes: &[Probe]) -> anyhow::Result<()> {
    println!("Matte: errors as shares of the mean; shading of 512 x 512 pixels.\n");
    println!("| probe | order | sun and window | mean | largest | least value | shading ms |");
    println!("|---|---|---|---|---|---|---|");
    for probe in probes {
        let truth = NaturalLight::of(probe);
        for order in 1..=5i64 {
            for helped in [true, false] {
                let values = Values::from([
                    ("ks".to_owned(), Value::Float(0.0)),
                    ("sh-order".to_owned(), Value::Int(order)),
                    ("sun".to_owned(), Value::Bool(helped)),
                    ("window".to_owned(), Value::Bool(helped)),
                ]);
                let found = small.all_around(probe, &values)?;
                let [mean, largest, least] =
                    errors(&found, |seen| truth.white_diffuse(seen.normal));
                let ms = large.shading_ms(probe, &values)?;
                println!(
                    "| {} | {order} | {} | {:.3} % | {:.2} % | {least:.4} | {ms:.2} |",
                    probe.name,
                    if helped { "on" } else { "off" },
                    100.0 * mean,
                    100.0 * largest,
                );
            }
        }
    }
    Ok(())
}

fn shiny(small: &mut Lab, probes: &[Probe]) -> anyhow::Result<()> {
    println!("\nGGX reflected once, metal: errors as shares of the mean, all view angles.\n");
    println!("| probe | roughness | mean | largest |");
    println!("|---|---|---|---|");
    for probe in probes {
        let truth = NaturalLight::of(probe);
        for roughness in [0.3, 0.5, 0.7, 1.0] {
            let values = Values::from([
                ("kd".to_owned(), Value::Float(0.0)),
                ("metallic".to_owned(), Value::Float(1.0)),
                ("multiple-scattering".to_owned(), Value::Bool(false)),
                ("antialias".to_owned(), Value::Bool(false)),
                ("roughness".to_owned(), Value::Float(roughness)),
            ]);
            let found = small.all_around(probe, &values)?;
            let [mean, largest, _] =
                errors(&found, |seen| truth.ggx(seen.normal, seen.to_eye, roughness, 1.0));
            let name = &probe.name;
            println!("| {name} | {roughness} | {:.2} % | {:.1} % |", 100.0 * mean, 100.0 * largest);
        }
    }
    Ok(())
}

fn reading(files: &[String]) -> anyhow::Result<()> {
    println!("\n| probe | size | read, with harmonics | filtered (GGX) | again |");
    println!("|---|---|---|---|---|");
    for file in files {
        let started = Instant::now();
        let probe = probe::read(file, None)?;
        let read = started.elapsed();
        let mut lab = Lab::new(48);
        let filtered = |frame: &Rendered| -> f64 {
            let own = frame.passes.iter().filter(|pass| pass.name.starts_with("prefilter"));
            own.filter(|pass| pass.state == PassState::Ran)
                .filter_map(|pass| pass.gpu_ms)
                .fold(0.0, |sum, ms| sum + ms)
        };
        let first = filtered(&lab.frame(&probe, &Values::new())?);
        let second = filtered(&lab.frame(&probe, &Values::new())?);
        println!(
            "| {} | {} x {} | {:.0} ms | {first:.0} ms | {second:.0} ms |",
            probe.name,
            probe.picture.width,
            probe.picture.height,
            read.as_secs_f64() * 1e3
        );
    }
    Ok(())
}
