//! Columns that must not change the picture: how they are cut, ordered, and others beside them.

use super::bench::{Bench, DrawRequest, alike, front, picture, same};
use crate::conformance::clouds::{self, Surfels};
use crate::conformance::hard;
use crate::conformance::verdict::{Judged, Said};
use surfelshop_api::columns::{AO, COLOR, MATERIAL, NEUTRAL_ALBEDO};
use surfelshop_api::graph::Output;
use surfelshop_cloud::{Buffer, Column};
use surfelshop_image::Image;
use surfelshop_render::{EngineOptions, SurfelDrawing};

const SIZE: u32 = 96;
const N: usize = 3000;

/// So many surfels of a ball with everything that drawing reads.
pub(super) fn full(n: usize) -> Surfels {
    let mut surfels = clouds::sphere(n, 1.0);
    surfels.ao = (0..n).map(|i| (i % 7) as f32 / 8.0).collect();
    surfels.materials = (0..n).map(|i| (i % 3) as u32).collect();
    surfels
}

/// The same with nothing but what drawing needs.
pub(super) fn bare(n: usize) -> Surfels {
    Surfels { colors: Vec::new(), ..clouds::sphere(n, 1.0) }
}

fn shot(surfels: &Surfels) -> DrawRequest<'static> {
    DrawRequest::new(surfels.cloud(), front(SIZE)).of(&[Output::Color])
}

pub(super) fn chunked(bench: &mut Bench<'_>) -> Judged {
    let surfels = full(N);
    // The CPU knows no chunks.
    let quads = EngineOptions { surfels: SurfelDrawing::Quads, ..EngineOptions::default() };
    let whole = bench.with(&quads)?.color(&shot(&surfels))?;
    let mut said = Vec::new();
    for chunk_surfels in [997, 64] {
        let options = EngineOptions { chunk_surfels, ..quads.clone() };
        let mut other = bench.with(&options)?;
        let chunked = other.color(&shot(&surfels))?;
        same(&format!("chunks of {chunk_surfels}"), &whole, &chunked)?;
        said.push(chunk_surfels.to_string());
    }
    Ok(Said::Measured(format!("chunks of {}", said.join(" and "))))
}

pub(super) fn unused(bench: &mut Bench<'_>) -> Judged {
    let surfels = full(N);
    let expected = bench.color(&shot(&surfels))?;
    let odd = Column::new("check-unknown", 2, Buffer::F32(vec![f32::NAN; 2 * N]));
    let cloud = hard::with_column(&surfels.cloud(), odd);
    let found = bench.color(&DrawRequest { cloud, ..shot(&surfels) })?;
    same("a column `check-unknown` more", &expected, &found)?;
    Ok(Said::Measured("with a column of NaN that nobody knows".to_owned()))
}

/// What a cloud lacks is left out of shaders and of the device; with values that mean the same it is there.
pub(super) fn neutral(bench: &mut Bench<'_>) -> Judged {
    let bare = bare(N);
    let expected = bench.color(&shot(&bare))?;
    let albedo = NEUTRAL_ALBEDO.iter().copied().cycle().take(3 * N).collect();
    let neutral = [
        Column::new(COLOR, 3, Buffer::F32(albedo)),
        Column::new(AO, 1, Buffer::F32(vec![1.0; N])),
        Column::new(MATERIAL, 1, Buffer::U32(vec![0; N])),
    ];
    let mut all = bare.cloud();
    for column in neutral {
        let what = format!("a neutral column `{}`", column.name());
        all = hard::with_column(&all, column.clone());
        let cloud = hard::with_column(&bare.cloud(), column);
        same(&what, &expected, &bench.color(&DrawRequest { cloud, ..shot(&bare) })?)?;
    }
    let found = bench.color(&DrawRequest { cloud: all, ..shot(&bare) })?;
    same("all neutral columns", &expected, &found)?;
    Ok(Said::Measured("colours, accessibility and materials, alone and together".to_owned()))
}

pub(super) fn reordered(bench: &mut Bench<'_>) -> Judged {
    let surfels = full(N);
    let outputs = [Output::Color, Output::Depth, Output::Normal];
    let drawn = bench.draw(&shot(&surfels).of(&outputs))?;
    let other = bench.draw(&shot(&hard::shuffled(&surfels)).of(&outputs))?;
    let color = |drawn| -> Result<Image, _> { picture(drawn, &Output::Color) };
    // No pixel may differ: what decides between equal surfels must be what they are.
    let line = alike("colour", &color(&drawn)?, &color(&other)?, 0.0)?;
    for output in &outputs[1..] {
        same(&output.name(), &picture(&drawn, output)?, &picture(&other, output)?)?;
    }
    Ok(Said::Measured(line))
}
