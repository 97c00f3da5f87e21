//! Ambient occlusion of a pyramid against rays: `surface occlusion BAKED.surfels… [--rays N] [--samples N]`.
//!
//! Each of the files is one pyramid with a column `ao`, all of the same surfels. All of them are brought into memory at
//! once; of some, evenly spread over their order, rays against all discs tell the occlusion.

use anyhow::{Context as _, anyhow};
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use surfelshop_api::UnitKind;
use surfelshop_api::columns::CONTEXT;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_pyramid::Pyramid;
use surfelshop_runtime::plugins::{Origin, Place, Registry, SearchPath, Trust};
use surfelshop_runtime::tools::ToolOptions;
use surfelshop_session::tool_run::Step;

/// A surfel by its place.
fn key(cloud: &Cloud, i: usize) -> [u64; 3] {
    cloud.world_position(i).unwrap_or_default().to_array().map(f64::to_bits)
}

pub(super) fn run(arguments: &[String]) -> anyhow::Result<()> {
    let (mut files, mut rays, mut samples) = (Vec::new(), 1024i64, 2000usize);
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut number = || rest.next().context("expected a number").map(|text| text.parse());
        match argument.as_str() {
            "--rays" => rays = number()??,
            "--samples" => samples = number()?? as usize,
            file => files.push(Path::new(file)),
        }
    }
    let first = *files.first().context("expected pyramids with a column `ao`, found none")?;
    let pyramid = Pyramid::open(first)?;
    let whole = pyramid.overview_cloud(u64::MAX)?;
    let step = (whole.len() / samples.max(1)).max(1);
    let is_context = (0..whole.len()).map(|i| u8::from(i % step != 0)).collect();
    let whole = whole.with_columns(vec![Column::new(CONTEXT, 1, Buffer::U8(is_context))])?;
    println!("{} surfels, rays for one of {step}", whole.len());
    let started = Instant::now();
    let truth = traced(&whole, rays)?;
    println!("{rays} rays each: {:.1} s", started.elapsed().as_secs_f64());
    let truth: HashMap<[u64; 3], f32> =
        (0..whole.len()).step_by(step).map(|i| (key(&whole, i), truth[i])).collect();
    drop(whole);
    for file in files {
        let pyramid = Pyramid::open(file)?;
        let leaves = (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf());
        let mut found: Vec<(f64, DVec3)> = Vec::new();
        for (number, _) in leaves {
            let leaf = pyramid.read(number)?;
            for (i, &ao) in leaf.floats("ao", 1).iter().enumerate() {
                let Some(&known) = truth.get(&key(&leaf, i)) else { continue };
                let at = leaf.world_position(i).unwrap_or_default();
                found.push((f64::from(ao) - f64::from(known), at));
            }
        }
        found.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let rmse = |of: &[(f64, DVec3)]| {
            (of.iter().map(|(off, _)| off * off).sum::<f64>() / of.len().max(1) as f64).sqrt()
        };
        let mean = found.iter().map(|(off, _)| off).sum::<f64>() / found.len().max(1) as f64;
        let others = found.get(found.len() / 200..).unwrap_or_default();
        println!(
            "{}: {} surfels, RMSE {:.5}, without the worst in 200 {:.5}, mean {mean:+.5}",
            file.display(),
            found.len(),
            rmse(&found),
            rmse(others),
        );
        for (off, at) in found.iter().take(5) {
            println!("  {off:+.3} at {at:.3}");
        }
    }
    Ok(())
}

/// The accessibility of a cloud's own surfels by rays.
fn traced(cloud: &Cloud, rays: i64) -> anyhow::Result<Vec<f32>> {
    let (before, after) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = format!("{before}surfelshop_ambient_occlusion{after}");
    let path = std::env::current_exe()?.with_file_name(library);
    let files = vec![Place::new(path, Origin::CommandLine)];
    let search = SearchPath { files, trust: Trust::everything(), ..SearchPath::default() };
    let registry = Registry::scan(&search);
    let reference = registry.find(UnitKind::Tool, "ambient-occlusion")?;
    let unit = registry.load(&reference).map_err(|fault| anyhow!("{fault}"))?;
    let values = Values::from([
        ("method".to_owned(), Value::Text("rays".to_owned())),
        ("rays".to_owned(), Value::Int(rays)),
    ]);
    let step = Step { reference, unit, values };
    let (done, _) = step.run(cloud, &ToolOptions::default(), &AtomicBool::new(false))?;
    let edited = done.edited.context("the tool changed nothing")?;
    Ok(edited.cloud.floats("ao", 1).to_vec())
}
