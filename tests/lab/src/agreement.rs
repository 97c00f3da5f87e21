//! Prints how far renderers agree with rays cast at the same discs: `agreement FILE... [SIZE]`.

use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_tests::cast::{Agreement, cast};
use surfelshop_tests::stage;

/// Depths further apart than this fraction count as different.
const DEPTH_FRACTION: f64 = 1e-3;

pub(crate) fn run() -> anyhow::Result<()> {
    let (sizes, files): (Vec<String>, Vec<String>) =
        std::env::args().skip(2).partition(|argument| argument.parse::<u32>().is_ok());
    let size = sizes.first().and_then(|size| size.parse().ok()).unwrap_or(1024);
    let mut engine = stage::engine();
    println!("{} at {size} x {size}", engine.gpu().describe());
    println!("| file | view | renderer | drawn px | met px | agree | depth differs |");
    println!("|---|---|---|---|---|---|---|");
    for file in files {
        let cloud = surfelshop_cloud::read(&file, &Default::default())?.cloud;
        let name = file.rsplit('/').next().unwrap_or(&file).to_owned();
        for (what, view) in stage::hard_views(&cloud, size) {
            let reference = cast(&cloud, &view);
            for (library, unit) in
                [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")]
            {
                let mut renderer = stage::built_renderer(&engine, library, unit);
                let mut scene = Scene::default();
                scene.surface.low_pass = 0.0;
                let outputs = [Output::Color, Output::Depth];
                let frame =
                    stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs)?;
                let color = frame.image(&Output::Color).ok_or_else(|| anyhow::anyhow!("none"))?;
                let depth = frame.image(&Output::Depth).ok_or_else(|| anyhow::anyhow!("none"))?;
                let depths = color.data.chunks_exact(4).zip(&depth.data);
                let depths = depths.map(|(c, d)| if c[3] > 0.0 { *d } else { 0.0 });
                let found = Agreement::new(depths, &reference, DEPTH_FRACTION);
                println!(
                    "| {name} | {what} | {unit} | {} | {} | {:.4} % | {:.4} % |",
                    found.drawn,
                    found.cast,
                    100.0 * found.coverage(),
                    100.0 * found.depth_differs as f64 / found.both.max(1) as f64,
                );
            }
        }
    }
    Ok(())
}
