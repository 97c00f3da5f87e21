//! Prints how far the renderer `environment` is from sums over all texels of light probes, by order
//! of its spherical harmonics and by roughness, with what a frame takes; then how long probes take
//! to be read and filtered: `natural_light [PROBE...]`.

use std::time::Instant;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::environment_map::{self, Probe};
use surfelshop_render::{PassState, Rendered};
use surfelshop_tests::natural_light::{Errors, Lab, NaturalLight, Pixel, around, lone_sun};

/// Frames that are timed.
const N_FRAMES: usize = 15;

/// Covered pixels from two opposite sides, which show all normals.
fn all_around(lab: &mut Lab, probe: &Probe, values: &Values) -> anyhow::Result<Vec<Pixel>> {
    let mut all = Vec::new();
    for _ in 0..2 {
        all.extend(lab.pixels(probe, values)?);
        lab.view.camera.eye = -lab.view.camera.eye;
    }
    Ok(all)
}

/// A frame in the light of a probe.
fn frame(lab: &mut Lab, probe: &Probe, values: &Values) -> anyhow::Result<Rendered> {
    lab.frame(Some((&around(probe), probe)), values, 1)
}

/// Median milliseconds of the shading pass.
fn shading_ms(lab: &mut Lab, probe: &Probe, values: &Values) -> anyhow::Result<f64> {
    let mut times = Vec::new();
    for _ in 0..N_FRAMES {
        let frame = frame(lab, probe, values)?;
        let pass = frame.passes.iter().find(|pass| pass.name == "environment");
        times.extend(pass.and_then(|pass| pass.gpu_ms));
    }
    times.sort_by(f64::total_cmp);
    Ok(times.get(times.len() / 2).copied().unwrap_or(f64::NAN))
}

pub(crate) fn run() -> anyhow::Result<()> {
    let mut probes = vec![
        Probe::constant([1.0; 3]),
        Probe::studio(),
        Probe::from_picture("a lone sun of 1e5", lone_sun(1e5), None)?,
    ];
    let files: Vec<String> = std::env::args().skip(2).collect();
    for file in &files {
        probes.push(environment_map::read(file, None)?);
    }
    let (mut small, mut large) = (Lab::new(40_000, 48), Lab::new(40_000, 512));
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
                let found = all_around(small, probe, &values)?;
                let Errors { mean, largest, least } =
                    Errors::of(&found, |seen| truth.white_diffuse(seen.normal));
                let ms = shading_ms(large, probe, &values)?;
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
            let found = all_around(small, probe, &values)?;
            let Errors { mean, largest, .. } =
                Errors::of(&found, |seen| truth.ggx(seen.normal, seen.to_eye, roughness, 1.0));
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
        let probe = environment_map::read(file, None)?;
        let read = started.elapsed();
        let mut lab = Lab::new(40_000, 48);
        let filtered = |frame: &Rendered| -> f64 {
            let own = frame.passes.iter().filter(|pass| pass.name.starts_with("prefilter"));
            own.filter(|pass| pass.state == PassState::Ran)
                .filter_map(|pass| pass.gpu_ms)
                .fold(0.0, |sum, ms| sum + ms)
        };
        let first = filtered(&frame(&mut lab, &probe, &Values::new())?);
        let second = filtered(&frame(&mut lab, &probe, &Values::new())?);
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
