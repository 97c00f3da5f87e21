//! Pictures of Gaussians from files against a plain renderer in f64, in every way to draw: `surface gaussian-truth
//! FILE...`.
//!
//! Each file is seen from outside and from within the middle of its splats. The plain renderer looks at every splat for
//! every pixel, so that pictures are small.

use anyhow::{Context as _, ensure};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::process::Command;
use surfelshop_api::columns::{OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Projection, View};
use surfelshop_cloud::{Cloud, ReadOptions};
use surfelshop_render::{EngineOptions, GpuOptions};
use surfelshop_tests::gaussians::reference::{Kind, Pixel, draw};
use surfelshop_tests::gaussians::{self, Gaussians};
use surfelshop_tests::stage::{WAYS, engine_with};

/// Splats times pixels that are looked at for a picture, about.
const LOOKS: f64 = 6e9;

pub(super) fn run(files: &[String]) -> anyhow::Result<()> {
    ensure!(!files.is_empty(), "expected files of Gaussians, found none");
    println!(
        "| file | splats | pixels | seen from | renderer | drawn by | colour, dB | coverage, dB |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let folder = tempfile::tempdir()?;
    let mut engines = WAYS.map(|surfels| {
        let options = EngineOptions { surfels, ..EngineOptions::default() };
        (surfels, engine_with(&GpuOptions::default(), &options))
    });
    for file in files {
        let ply = as_ply(Path::new(file), folder.path())?;
        let loaded = surfelshop_cloud::read(&ply, &ReadOptions::default())?;
        let all = of_cloud(&loaded.cloud).with_context(|| format!("{file}: no Gaussians"))?;
        for (from, view) in views(&all) {
            let space = Kind::Space { low_pass: 0.3, keeps_sum: false };
            for (unit, kind) in [("gaussians", space), ("gaussians-2d", Kind::Plane)] {
                let truth: Vec<Pixel> = draw(&all, &view, kind, 3);
                let expected: Vec<[f64; 4]> = truth.iter().map(|pixel| pixel.color).collect();
                for (way, engine) in &mut engines {
                    let mut renderer = gaussians::renderer(engine, unit);
                    let (clouds, outputs) = ([&loaded.cloud], [Output::Color]);
                    let values = Values::default();
                    let frame =
                        gaussians::frame(engine, &mut renderer, &clouds, view, &values, &outputs)?;
                    let [color, coverage] =
                        gaussians::decibels(&gaussians::pixels(&frame, &Output::Color), &expected);
                    println!(
                        "| {} | {} | {} | {from} | {unit} | {way:?} | {color:.1} | {coverage:.1} |",
                        Path::new(file).file_name().unwrap_or_default().display(),
                        all.len(),
                        truth.len(),
                    );
                }
            }
        }
    }
    Ok(())
}

/// The file as trainers write it: as it is, or what the program makes of it.
fn as_ply(file: &Path, folder: &Path) -> anyhow::Result<PathBuf> {
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ply")) {
        return Ok(file.to_owned());
    }
    let program = std::env::current_exe()?.with_file_name("surfelshop");
    let to = folder.join("converted.ply");
    let ended = Command::new(&program).arg("convert").arg(file).arg(&to).output()?;
    ensure!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr).trim_end());
    Ok(to)
}

/// The columns of a cloud of Gaussians.
fn of_cloud(cloud: &Cloud) -> Option<Gaussians> {
    let view = cloud.view();
    let columns = |name: &str, n: u32| view.floats(name, n).map(<[f32]>::to_vec);
    let threes = |name: &str| Some(columns(name, 3)?.as_chunks::<3>().0.to_vec());
    let positions = cloud.positions().to_vec();
    let [zeroth, first, second, third] =
        [0, 1, 2, 3].map(|l| columns(SH[l], 6 * l as u32 + 3).unwrap_or_default());
    Some(Gaussians {
        positions,
        scales: threes(SPLAT_SCALE)?,
        rotations: columns(SPLAT_ROTATION, 4)?.as_chunks::<4>().0.to_vec(),
        opacities: columns(OPACITY, 1)?,
        harmonics: [zeroth, first, second, third],
    })
}

/// Cameras outside and inside of the middle of the splats, which far ones do not move.
fn views(all: &Gaussians) -> [(&'static str, View); 2] {
    let middle = |mut values: Vec<f64>, share: f64| {
        let at = ((values.len() as f64 * share) as usize).min(values.len() - 1);
        *values.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let centre = DVec3::from_array([0, 1, 2].map(|axis| {
        middle(all.positions.iter().map(|place| f64::from(place[axis])).collect(), 0.5)
    }));
    let away = all.positions.iter().map(|place| place.as_dvec3().distance(centre)).collect();
    let reach = middle(away, 0.8);
    let side = (LOOKS / all.len() as f64).sqrt().clamp(60.0, 300.0) as u32;
    let from = |share: f64| {
        let camera = Camera {
            eye: centre + DVec3::new(0.55, 0.35, 0.76) * (share * reach),
            target: centre,
            up: DVec3::Y,
            projection: Projection::Perspective { fov_y: 0.8 },
        };
        View { camera, size_px: [side, side], near: 1e-3 * reach, far: 1e3 * reach }
    };
    [("outside", from(2.5)), ("inside", from(0.6))]
}
