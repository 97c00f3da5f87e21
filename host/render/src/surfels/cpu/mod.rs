//! Surface buffers that the CPU draws: on software adapters it takes a fraction of what their
//! rasteriser takes.

pub(crate) mod columns;
pub(crate) mod paint;

use crate::graph::{PassState, Recorder};
use crate::stages::Stages;
use crate::surfels::spare_textures::{SpareTextures, texture};
use crate::surfels::surface::{Surface, SurfaceInput, SurfaceParts};
use std::sync::{Arc, LazyLock};
use surfelshop_api::graph::SurfaceMode;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_image::Image;
use surfelshop_raster::{
    Albedo, Cloud, Columns, Merging, Mode, Parts, Picture, Sources, Spent, Splats, draw,
};

/// What the pass is called.
const NAME: &str = "surfels: processor";

/// Makes what is missing of a surface; nothing where a cloud is not in memory. Returns how often the
/// surfels were drawn for that.
pub(crate) fn ensure(
    parts: SurfaceParts,
    input: &SurfaceInput<'_>,
    surface: &mut Surface,
    picture: &mut Picture,
    spare: &mut SpareTextures,
    recorder: &mut Recorder<'_>,
) -> Result<u32, Stopped> {
    let one = input.clouds.iter().all(|cloud| cloud.object == 0);
    let wanted = |mode: SurfaceMode, wanted: bool| wanted && surface.packed(mode).is_none();
    let modes = [
        (Mode::Nearest, wanted(SurfaceMode::Nearest, parts.nearest)),
        (Mode::Blended, wanted(SurfaceMode::Blended, parts.blended)),
        (Mode::Fields, wanted(SurfaceMode::Fields, parts.fields)),
    ];
    let mut modes: Vec<Mode> =
        modes.into_iter().filter(|(_, w)| *w).map(|(mode, _)| mode).collect();
    let mut looked_up = Parts {
        mode: Mode::None,
        winners: parts.winners && !surface.visible
            || parts.distances && surface.distances.is_none(),
        material: parts.material && surface.material.is_none(),
        object: parts.object && surface.object.is_none() && !one,
    };
    if modes.is_empty() && (looked_up.winners || looked_up.material || looked_up.object) {
        modes.push(Mode::None);
    }
    if modes.is_empty() {
        recorder.note(NAME, PassState::Reused);
    }
    let clouds = clouds(input);
    let n_drawn = modes.len() as u32;
    let stages = &recorder.gpu.stages;
    picture.clocks = stages.clocks();
    for mode in modes {
        stages.end("preparation");
        draw(&clouds, input.raster_view, Parts { mode, ..looked_up }, &LINEAR_OF_SRGB, picture);
        if picture.is_stopped() {
            return Err(Stopped);
        }
        tell(stages, &picture.spent);
        recorder.note(NAME, PassState::Ran);
        if parts.distances && surface.distances.is_none() {
            surface.distances = Some(Arc::new(distances(picture, input.size, input.unit as f32)));
            stages.end("surfels: distances");
        }
        let uploaded = Parts { winners: parts.winners && !surface.visible, ..looked_up };
        keep(picture, mode, uploaded, input.size, surface, spare, recorder);
        looked_up = Parts { mode, winners: false, material: false, object: false };
    }
    if parts.object && surface.object.is_none() {
        // Where there is one cloud, a single pixel says so; textures begin as zeros.
        let format = wgpu::TextureFormat::R32Uint;
        surface.object = Some(texture(recorder.gpu, "object", [1, 1], format));
    }
    Ok(n_drawn)
}

/// Somebody wanted no more of the picture.
pub(crate) struct Stopped;

/// Tells what the stages of a surface took.
fn tell(stages: &Stages, spent: &Spent) {
    stages.end("surfels");
    stages.part("surfels: choosing and culling", spent.cull);
    stages.part("surfels: placing", spent.place);
    stages.part("surfels: visibility", spent.nearest);
    stages.part("surfels: blending", spent.blend);
    stages.part("surfels: packing", spent.pack);
}

/// Linear values of all 8-bit codes.
pub(crate) static LINEAR_OF_SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear(code as f32 / 255.0)));

/// Columns of a cloud in drawing order.
pub(crate) fn columns(
    sources: &Sources<'_>,
    order: Arc<Vec<u32>>,
    albedo: Albedo,
    splats: Splats,
    merging: Merging,
    tell: &(dyn Fn(f32) + Sync),
) -> Columns {
    Columns::new(sources, order, albedo, splats, merging, &LINEAR_OF_SRGB, tell)
}

/// The clouds that are in memory.
fn clouds<'a>(input: &SurfaceInput<'a>) -> Vec<Cloud<'a>> {
    let mut first = 1;
    let mut clouds = Vec::with_capacity(input.clouds.len());
    for cloud in input.clouds {
        if let Some(columns) = cloud.on_host.as_deref() {
            let view_from_cloud = input.view_from_offset(cloud.origin);
            let (object, round_reach) = (cloud.object, input.round_reach(cloud));
            let geometry = cloud.geometry;
            clouds.push(Cloud { columns, geometry, view_from_cloud, first, object, round_reach });
        }
        first += cloud.n_surfels;
    }
    clouds
}

/// Distances of the nearest surfels, with so many scene units per unit of drawing: twin of `depth_only`.
fn distances(picture: &Picture, size: [u32; 2], unit: f32) -> Image {
    let [width, height] = size;
    let across = width as usize;
    let mut data = vec![0.0; across * height as usize];
    for [x, y, width, height] in picture.covered.rectangles() {
        for row in y..y + height {
            let first = row as usize * across + x as usize;
            let here = first..first + width as usize;
            let rows = data.get_mut(here.clone()).zip(picture.winners.get(here));
            for (distance, [_, bits]) in
                rows.into_iter().flat_map(|(to, from)| to.iter_mut().zip(from))
            {
                *distance = f32::from_bits(*bits) * unit;
            }
        }
    }
    Image { width, height, components: 1, data }
}

/// Rectangles, one above the other, in which a picture goes to the device.
const STRIPS: usize = 16;

/// Hands a picture to the device: what of it holds surfels, and what of a texture held some before.
fn keep(
    picture: &Picture,
    mode: Mode,
    looked_up: Parts,
    size: [u32; 2],
    surface: &mut Surface,
    spare: &mut SpareTextures,
    recorder: &mut Recorder<'_>,
) {
    use wgpu::TextureFormat as F;
    let covered = &picture.covered;
    if looked_up.winners {
        // Made for this surface, it has held nothing yet.
        let strips = covered.strips(covered, STRIPS);
        let winners = surface.make_winners(recorder.gpu).texture();
        recorder.upload(winners, bytemuck::cast_slice(&picture.winners), 8, &strips);
        surface.visible = true;
    }
    if surface.covered.as_deref() != Some(covered) {
        surface.covered = Some(Arc::new(covered.clone()));
    }
    let mut made = |label: &str, format, bytes: &[u8], texel: u32| {
        let (view, held) = spare.take(recorder.gpu, label, size, format);
        recorder.upload(view.texture(), bytes, texel, &covered.strips(&held, STRIPS));
        Some(view)
    };
    let mut packed = || made("surface", F::Rgba32Uint, bytemuck::cast_slice(&picture.packed), 16);
    match mode {
        Mode::Nearest => surface.nearest = packed(),
        Mode::Blended => surface.blended = packed(),
        Mode::Fields => surface.fields = packed(),
        Mode::None => {}
    }
    if looked_up.material {
        let bytes = bytemuck::cast_slice(&picture.material);
        surface.material = made("material", F::R32Uint, bytes, 4);
    }
    if looked_up.object {
        let bytes = bytemuck::cast_slice(&picture.object);
        surface.object = made("object", F::R32Uint, bytes, 4);
    }
}
