//! Splats as quads: a rectangle for each, in the order of their distances, put together by the device's blending; where
//! the nearest is looked for, by its depth test.
//!
//! Blending adds up three channels and a weight in each picture. Where half of the light is kept off is found by
//! bisection over the order: a picture of what the first splats hide, for each bit of their number.
//!
//! Invariants: quads are drawn in an order that follows from the splats, and devices blend in the order of drawing.

mod draws;

use crate::gpu::Gpu;
use crate::graph::execute::Variables;
use crate::graph::pipeline_desc::DrawKind;
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::PassScratch;
use crate::graph::recorder::Recorder;
use crate::graph::splats::device::{Device, Order};
use crate::graph::splats::parameters::Parameters;
use crate::graph::splats::pictures::copy_pictures;
use crate::graph::splats::{Made, surface};
use draws::{Drawn, QuadDraw};
use surfelshop_api::graph::{Composition, SplatDepth, Splats};

/// Channels of a picture that is blended, besides the weight.
const CHANNELS: u32 = 3;

/// Puts splats together; `false` where there are more of them than the device binds at once, or where depths are to be
/// blended that the device cannot blend.
///
/// # Errors
/// Where a pipeline cannot be made or the device fails.
pub(super) fn compose(
    splats: &Splats,
    variables: &Variables<'_>,
    made: &[Made],
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<bool, String> {
    let [made] = made else { return Ok(false) };
    if !blends_depths(recorder.gpu) && !splats.depths.is_empty() && !picks(splats.composition) {
        return Ok(false);
    }
    let size = variables.plan.size_of(variables.pass);
    let device = Device::new(recorder, pipelines, scratch);
    let mut quads = Quads { device, splats, variables, made, size, textures: Vec::new() };
    let composed = quads.compose();
    quads.give_back();
    composed.map(|()| true)
}

/// Whether the nearest is looked for, and nothing is blended.
fn picks(composition: Composition) -> bool {
    matches!(composition, Composition::Nearest | Composition::Stochastic { .. })
}

/// Whether pictures of 32-bit floats are blended: with 16 bits distances are too coarse.
fn blends_depths(gpu: &Gpu) -> bool {
    gpu.blends_f32 && gpu.draws(wgpu::TextureFormat::Rgba32Float)
}

/// A pass of splats while it is drawn.
struct Quads<'a, 'b, 'g> {
    device: Device<'b, 'g>,
    splats: &'a Splats,
    variables: &'a Variables<'a>,
    made: &'a Made,
    size: [u32; 2],
    /// To be given back.
    textures: Vec<wgpu::Texture>,
}

/// What every draw binds.
struct Bound {
    order: Order,
    surface: wgpu::Buffer,
    passed: wgpu::Buffer,
    nearest: wgpu::TextureView,
}

impl Quads<'_, '_, '_> {
    fn wants(&self, which: SplatDepth) -> bool {
        self.splats.depths.iter().any(|(depth, _)| *depth == which)
    }

    fn compose(&mut self) -> Result<(), String> {
        let variables = self.variables;
        let view = Parameters::of(self.splats, variables, self.size)?;
        let n_pixels = self.size[0] * self.size[1];
        let in_order =
            matches!(self.splats.composition, Composition::Over | Composition::Normalized { .. });
        let surface = match self.splats.tested {
            true => {
                let Device { recorder, pipelines, scratch, .. } = &mut self.device;
                let depths = surface::depths(variables, self.size, recorder, pipelines, scratch)?;
                self.device.taken.push(depths.clone());
                depths
            }
            false => self.device.numbers("no surface", 1),
        };
        let has_median =
            self.splats.composition == Composition::Over && self.wants(SplatDepth::Median);
        let bound = Bound {
            order: self.device.in_order(self.made, &view, in_order)?,
            surface,
            passed: self.device.numbers("ranks", if has_median { n_pixels } else { 1 }),
            nearest: self.picture("nearest splats", wgpu::TextureFormat::Rg32Uint),
        };
        let (height, n) = (self.size[1], self.splats.targets.len() as u32);
        let sums = self.device.numbers("sums of splats", 4 * n * view.stride * height);
        let n_depths = 2 + u32::from(self.wants(SplatDepth::Distortion));
        let depths = self.device.numbers("depths of splats", n_depths * view.depth_stride * height);
        let pictures = [("sums", &sums), ("depths", &depths)];
        match picks(self.splats.composition) {
            true => self.pick_tries(&view, &bound, &pictures)?,
            false => self.blend(&view, &bound, &pictures, has_median)?,
        }
        copy_pictures(self.splats, variables, &mut self.device, &view, &sums, &depths);
        Ok(())
    }

    /// The nearest of each try, one try after the other.
    fn pick_tries(
        &mut self,
        view: &Parameters,
        bound: &Bound,
        pictures: &[(&str, &wgpu::Buffer)],
    ) -> Result<(), String> {
        let depth = self.picture("depths of quads", wgpu::TextureFormat::Depth32Float);
        let tries = self.device.numbers("tries of splats", 8 * self.size[0] * self.size[1]);
        for step in 0..view.samples {
            self.pick(view, bound, &depth, step)?;
            let buffers = [pictures, &[("tries", &tries)]].concat();
            self.gather("gather", &view.at_step(step), &buffers, &[("nearest", &bound.nearest)])?;
        }
        Ok(())
    }

    fn pick(
        &mut self,
        view: &Parameters,
        bound: &Bound,
        depth: &wgpu::TextureView,
        step: u32,
    ) -> Result<(), String> {
        let draw = QuadDraw {
            entries: ["from_near", "pick"],
            kind: DrawKind::NearestSplats,
            into: &[Drawn { view: &bound.nearest, format: wgpu::TextureFormat::Rg32Uint }],
            depth: Some(depth),
            reads_nearest: false,
        };
        self.draw_quads(&draw, &view.at_step(step), bound)
    }

    /// Adds up all, each over those behind it where that is said.
    fn blend(
        &mut self,
        view: &Parameters,
        bound: &Bound,
        pictures: &[(&str, &wgpu::Buffer)],
        has_median: bool,
    ) -> Result<(), String> {
        let is_mean = matches!(self.splats.composition, Composition::Normalized { .. });
        let reads_nearest = is_mean || self.wants(SplatDepth::Distortion);
        if reads_nearest {
            let depth = self.picture("depths of quads", wgpu::TextureFormat::Depth32Float);
            self.pick(view, bound, &depth, 0)?;
        }
        let middle = match has_median {
            true => Some(self.median(view, bound)?),
            false => None,
        };
        let format = match blends_depths(self.device.recorder.gpu) {
            true => wgpu::TextureFormat::Rgba32Float,
            false => wgpu::TextureFormat::Rgba16Float,
        };
        let planes: Vec<wgpu::TextureView> =
            (0..self.n_planes()).map(|_| self.picture("planes of splats", format)).collect();
        // Those in front come last where they are over the others.
        let (vertex, kind) = match self.splats.composition {
            Composition::Over => ("from_far", DrawKind::SplatsOver),
            _ => ("from_near", DrawKind::AddedSplats),
        };
        let at_once = self.planes_at_once(format);
        for (group, views) in (0..).zip(planes.chunks(at_once)) {
            let into: Vec<Drawn<'_>> = views.iter().map(|view| Drawn { view, format }).collect();
            let first = group * at_once as u32;
            let fragment = format!("blend_from_{first}");
            let draw = QuadDraw {
                entries: [vertex, &fragment],
                kind,
                into: &into,
                depth: None,
                reads_nearest,
            };
            self.draw_quads(&draw, view, bound)?;
        }
        let names: Vec<String> = (0..planes.len()).map(|k| format!("plane_{k}")).collect();
        let mut read: Vec<(&str, &wgpu::TextureView)> =
            names.iter().map(String::as_str).zip(&planes).collect();
        read.push(("nearest", &bound.nearest));
        read.extend(middle.as_ref().map(|middle| ("middle", middle)));
        self.gather("finish", view, pictures, &read)
    }

    /// The distance of the splat that keeps off the second half of the light: bits of its rank, from the highest on.
    fn median(&mut self, view: &Parameters, bound: &Bound) -> Result<wgpu::TextureView, String> {
        let format = wgpu::TextureFormat::R32Float;
        let middle = self.picture("halves of splats", format);
        let into = [Drawn { view: &middle, format }];
        self.device.recorder.encoder.clear_buffer(&bound.passed, 0, None);
        let hide = QuadDraw {
            entries: ["from_near", "hide"],
            kind: DrawKind::SplatsOver,
            into: &into,
            depth: None,
            reads_nearest: false,
        };
        let bits = u32::BITS - bound.order.n.leading_zeros();
        for bit in (0..bits).rev() {
            let view = view.at_step(1 << bit);
            self.draw_quads(&hide, &view, bound)?;
            self.gather("halve", &view, &[("passed", &bound.passed)], &[("middle", &middle)])?;
        }
        let entries = ["from_near", "middle"];
        let last = QuadDraw { entries, kind: DrawKind::ReplacedSplats, ..hide };
        self.draw_quads(&last, view, bound)?;
        Ok(middle)
    }

    /// Pictures that are blended.
    fn n_planes(&self) -> u32 {
        let of_depths = match () {
            () if self.wants(SplatDepth::Distortion) => 3,
            () if self.wants(SplatDepth::Expected) => 1,
            () => 0,
        };
        (4 * self.splats.targets.len() as u32 + of_depths).div_ceil(CHANNELS)
    }

    /// How many of them the device draws into at once.
    fn planes_at_once(&self, format: wgpu::TextureFormat) -> usize {
        let limits = self.device.recorder.gpu.device.limits();
        let bytes = format.block_copy_size(None).unwrap_or(16);
        let fit = limits.max_color_attachment_bytes_per_sample / bytes;
        fit.min(limits.max_color_attachments).max(1) as usize
    }

    fn give_back(self) {
        let Self { device: Device { scratch, taken, .. }, textures, .. } = self;
        taken.into_iter().for_each(|buffer| scratch.give(buffer));
        textures.into_iter().for_each(|texture| scratch.give_texture(texture));
    }
}
