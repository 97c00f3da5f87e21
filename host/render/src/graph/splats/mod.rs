//! Passes of splats: a shader tells footprints, and the CPU or the device puts them together.

mod check;
mod cpu;
mod device;
mod parameters;
mod pictures;
mod quads;
mod source;
mod surface;

use crate::graph::execute::Variables;
use crate::graph::pipeline_desc::{Pipeline, Stage};
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::PassScratch;
use crate::graph::recorder::Recorder;
use crate::graph::resources::BufferPart;
use crate::graph::{RenderError, bind};
pub(super) use check::check_footprint;
pub(super) use source::{COMPOSE_PER_PIXEL, SPLAT_ENTRY, splat_source};
pub(super) use source::{SPLAT_FOOTPRINTS, SPLAT_PAYLOADS, SPLAT_RANGE};
use surfelshop_api::graph::{Resource, Splats};
use surfelshop_raster::composition::FOOTPRINT_BYTES;

/// Bytes of a vector that splats carry.
const VECTOR_BYTES: u64 = 16;

/// Splats whose footprints were made on the device.
pub(super) struct Made {
    pub(super) n: u32,
    pub(super) footprints: wgpu::Buffer,
    pub(super) payloads: wgpu::Buffer,
}

/// How splats are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SplatDrawing {
    /// By the CPU, which takes footprints from the device.
    Processor,
    /// As quads, by the device's blending and depth test.
    Quads,
    /// By compute, tile by tile.
    Lists,
}

/// Draws a pass of splats into its targets; `per_pixel` puts them together where the pass has a function of pixels.
///
/// # Errors
/// Where a pipeline cannot be made or bound, or the device fails.
pub(super) fn draw(
    splats: &Splats,
    variables: &Variables<'_>,
    pipeline: &Pipeline,
    per_pixel: Option<&Pipeline>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<(), RenderError> {
    let fail = |message: String| RenderError::pass(&variables.pass.name, message);
    let mut made = Vec::new();
    for (k, [first, n]) in ranges(splats, variables).map_err(fail)?.into_iter().enumerate() {
        let part = Part { splats: [first, n], number: k };
        made.push(footprints(splats, variables, pipeline, recorder, part, scratch).map_err(fail)?);
    }
    let lists = recorder.gpu.lists_splats();
    let drawing = match (&splats.per_pixel, variables.frame.splats) {
        (None, drawing) => drawing,
        // The CPU cannot call a function of a shader.
        (Some(_), SplatDrawing::Processor) if lists => SplatDrawing::Lists,
        (Some(_), SplatDrawing::Lists) if lists => SplatDrawing::Lists,
        (Some(_), _) => SplatDrawing::Quads,
    };
    let composed = match drawing {
        SplatDrawing::Processor => Ok(false),
        SplatDrawing::Quads => {
            quads::compose(splats, variables, &made, recorder, pipelines, scratch)
        }
        SplatDrawing::Lists => {
            device::compose(splats, variables, &made, per_pixel, recorder, pipelines, scratch)
        }
    };
    let composed = match (composed, drawing) {
        // Depths, which not every device blends.
        (Ok(false), SplatDrawing::Quads) if per_pixel.is_some() && lists => {
            device::compose(splats, variables, &made, per_pixel, recorder, pipelines, scratch)
        }
        // Lists that are too long.
        (Ok(false), SplatDrawing::Lists) if per_pixel.is_some() => {
            quads::compose(splats, variables, &made, recorder, pipelines, scratch)
        }
        (composed, _) => composed,
    };
    // The CPU can, however many there are.
    let drawn = composed.and_then(|composed| match (composed, &splats.per_pixel) {
        (true, _) => Ok(()),
        (false, None) => cpu::compose(splats, variables, &made, recorder, pipelines, scratch),
        (false, Some(function)) => Err(format!(
            "its {} splats, with the tiles that they touch, are more than this device, {}, binds at once, or have depths \
             that it cannot blend; and the CPU, which composes those, cannot call `{function}` of each pixel: draw \
             fewer or smaller ones, or leave `per_pixel` or the depths out",
            splats.n,
            recorder.gpu.describe()
        )),
    });
    for Made { footprints, payloads, .. } in made {
        scratch.give(footprints);
        scratch.give(payloads);
    }
    drawn.map_err(fail)
}

/// The splats that are made at once: first and number of each part.
///
/// # Errors
/// Where columns that come in parts are not all of as many surfels as there are splats.
fn ranges(splats: &Splats, variables: &Variables<'_>) -> Result<Vec<[u32; 2]>, String> {
    let n = u32::try_from(splats.n).unwrap_or(u32::MAX);
    let mut ranges: Option<Vec<[u32; 2]>> = None;
    for (name, resource) in &variables.pass.bindings {
        let Resource::Buffer(id) = resource else { continue };
        let Some(parts) = variables.resources.parts.get(&id.index()) else { continue };
        let own: Vec<[u32; 2]> = parts.iter().map(|part| [part.first, part.n]).collect();
        if own.len() == 1 && ranges.is_none() {
            continue;
        }
        let end = own.last().map_or(0, |[first, n]| first + n);
        if end != n || ranges.as_ref().is_some_and(|known| *known != own) {
            return Err(format!(
                "`{name}` is larger than the device binds and comes in parts: all columns of the pass must be of \
                 its {n} splats, found {end}"
            ));
        }
        ranges = Some(own);
    }
    Ok(ranges.unwrap_or_else(|| vec![[0, n]]))
}

/// Splats whose footprints are made at once.
#[derive(Clone, Copy)]
struct Part {
    /// The first, and how many.
    splats: [u32; 2],
    number: usize,
}

/// Calls the author's function for a part of the splats.
fn footprints(
    splats: &Splats,
    variables: &Variables<'_>,
    pipeline: &Pipeline,
    recorder: &mut Recorder<'_>,
    part: Part,
    scratch: &mut PassScratch,
) -> Result<Made, String> {
    let gpu = recorder.gpu;
    let [first, n] = part.splats;
    let read = match gpu.maps_storage {
        true => wgpu::BufferUsages::MAP_READ,
        false => wgpu::BufferUsages::COPY_SRC,
    };
    // One splat at least: of a buffer without one nothing can be bound.
    let n_bytes = |bytes: u64| u64::from(n.max(1)) * bytes;
    let mut buffer = |label: &str, bytes: u64| {
        scratch.take(gpu, label, n_bytes(bytes), wgpu::BufferUsages::STORAGE | read)
    };
    let made = Made {
        n,
        footprints: buffer("footprints", FOOTPRINT_BYTES as u64),
        payloads: buffer("payloads", VECTOR_BYTES * splats.targets.len() as u64),
    };
    let range: Vec<u8> = [first, n, 0, 0].into_iter().flat_map(u32::to_le_bytes).collect();
    let range = gpu.filled_buffer("range of splats", &range, wgpu::BufferUsages::UNIFORM);
    let group = bind(gpu, pipeline, |name| match name {
        SPLAT_FOOTPRINTS => Some(made.footprints.as_entire_binding()),
        SPLAT_PAYLOADS => Some(made.payloads.as_entire_binding()),
        SPLAT_RANGE => Some(range.as_entire_binding()),
        _ => match part_of(variables, name, part.number) {
            Some(part) => Some(part.buffer.as_entire_binding()),
            None => variables.resource(name),
        },
    })?;
    let groups = n.div_ceil(source::GROUP);
    // More than a row of workgroups may have.
    let across = groups.min(1 << 15);
    recorder.compute(&variables.pass.name, |pass| {
        if let Stage::Compute(stage) = &pipeline.stage
            && n > 0
        {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
        }
    });
    Ok(made)
}

/// A part of the columns that a variable reads; the only one where there is one alone.
fn part_of<'a>(variables: &Variables<'a>, name: &str, part: usize) -> Option<&'a BufferPart> {
    let Resource::Buffer(id) = variables.pass.bindings.get(name)? else { return None };
    let parts = variables.resources.parts.get(&id.index())?;
    parts.get(part).or(parts.first())
}
