//! The marble of the thesis, with its errata T25 and T26, as patterns of the renderer.

use super::{Bench, Computed};
use crate::clouds::surfels;
use anyhow::bail;
use glam::DVec3;
use surfelshop_cloud::{ReadOptions, read};
use surfelshop_session::output::files::write_whole;

/// What all patterns begin with.
const HEAD: &str = "#import surfelshop::noise::Place
#import procedural::pattern::{Look, fbm, fbm_from, frequency}

const BASE = vec3<f32>(1.0, 0.843, 0.624);

";

/// Three channels of noise between 0 and 1, as sin and its neighbours would be looked up.
const CHANNELS: &str = "fn look(at: Place, albedo: vec3<f32>) -> Look {
    let x = 0.5 + 0.5 * fbm(at).mean;
    let y = 0.5 + 0.5 * fbm_from(at, frequency() * vec3(1.0, 1.03, 0.97)).mean;
    let z = 0.5 + 0.5 * fbm_from(at, frequency() * vec3(0.97, 1.0, 1.03)).mean;
    let marble = 0.2 + 5.0 * abs(SUM - 0.5);
    return Look(BASE * albedo * marble, clamp(1.1 - 1.3 * marble, 0.0, 1.0), 0.41727, 0.0);
}
";

/// One channel in a box that may be stretched.
const STRETCHED: &str = "fn look(at: Place, albedo: vec3<f32>) -> Look {
    let x = 0.5 + 0.5 * fbm_from(at, frequency() * STRETCH).mean;
    let marble = 0.2 + 5.0 * abs(x - 0.5);
    return Look(BASE * albedo * marble, clamp(1.1 - 1.3 * marble, 0.0, 1.0), 0.41727, 0.0);
}
";

/// An erratum on a model.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let (body, wrong, right) = match which {
        "T25" => (CHANNELS, "(x + y + z)".to_owned(), "x".to_owned()),
        "T26" => {
            let cloud = read(bench.path("mannequin")?, &ReadOptions::default())?.cloud;
            let (positions, _, _) = surfels(&cloud);
            let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
            let high = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
            let extent = (high - low).max(DVec3::splat(1e-12));
            let stretch = DVec3::splat(extent.max_element()) / extent;
            let vector = |v: DVec3| format!("vec3<f32>({:.6}, {:.6}, {:.6})", v.x, v.y, v.z);
            (STRETCHED, vector(stretch), vector(DVec3::ONE))
        }
        other => bail!("there is no erratum {other} of marble"),
    };
    let mut pictures = Vec::new();
    for (name, form) in [("printed", &wrong), ("corrected", &right)] {
        let pattern = HEAD.to_owned() + &body.replace("SUM", form).replace("STRETCH", form);
        write_whole(&bench.folder.join(format!("{name}.wgsl")), pattern.as_bytes())?;
        bench.run(&format!(
            "render {{mannequin}} -r procedural --set file={{out}}/{name}.wgsl --set own-color=0 -o {{out}}/{name}.exr"
        ))?;
        pictures.push(bench.radiance(&format!("{name}.exr"))?);
    }
    // The renderer's own marble, which is filtered over each pixel.
    bench.run(
        "render {mannequin} -r procedural --set pattern=simple-marble --set own-color=0 --antialias 8 \
         -o {out}/truth.exr",
    )?;
    Computed::pair(&pictures[0], &pictures[1], &bench.radiance("truth.exr")?)
}
