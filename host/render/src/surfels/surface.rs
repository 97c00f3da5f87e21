//! The surface buffer: made once for a view and shared by every renderer that looks through it.

use crate::gpu::Gpu;
use crate::graph::{PassState, Pipelines, Recorder, texture_bytes};
use crate::resource_use::ResourceUse;
use crate::surfels::cpu;
use crate::surfels::quads::{Drawing, Lookup};
use crate::surfels::render_cloud::DrawnCloud;
use crate::surfels::spare_textures::{SpareTextures, texture};
use glam::{DMat4, DVec3, Mat4};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use surfelshop_api::graph::SurfaceMode;
use surfelshop_api::{SurfaceSettings, View};
use surfelshop_image::Image;
use surfelshop_raster::Coverage;

/// Surface buffers kept for views that are no longer drawn every frame.
const KEPT_SURFACES: usize = 4;
/// Frames for which the room for a graph's cameras is kept while graphs with fewer are drawn.
const KEPT_FRAMES: u64 = 64;

/// What is said of a surface that nobody wanted any more.
pub(crate) const STOPPED: &str = "the picture was not wanted any more";

/// Which parts of the surface a frame needs; all need the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SurfaceParts {
    /// Depth and index of the nearest surfel.
    pub(crate) visibility: bool,
    /// The surface of the nearest surfels.
    pub(crate) nearest: bool,
    /// The surface of blended surfels.
    pub(crate) blended: bool,
    /// The same with normals that vary over surfels.
    pub(crate) fields: bool,
    /// The material of the nearest surfels.
    pub(crate) material: bool,
    /// The cloud of the nearest surfels.
    pub(crate) object: bool,
    /// The depth and index of the nearest surfels themselves, not only what is made of them.
    pub(crate) winners: bool,
    /// Their distances as a picture, where the CPU draws it: others make it of the winners.
    pub(crate) distances: bool,
}

impl SurfaceParts {
    pub(crate) fn add(&mut self, mode: SurfaceMode) {
        self.visibility = true;
        match mode {
            SurfaceMode::Nearest => self.nearest = true,
            SurfaceMode::Blended => self.blended = true,
            SurfaceMode::Fields => self.fields = true,
        }
    }
}

/// How often parts of surface buffers were made since the engine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct SurfaceCounts {
    /// Times the nearest surfels were found.
    pub visibility: u32,
    /// Times the nearest surfels' surface was made.
    pub nearest: u32,
    /// Times the blended surface was made.
    pub blended: u32,
}

/// The surface buffer of one view.
#[derive(Clone)]
pub(crate) struct Surface {
    pub(crate) depth: Option<wgpu::TextureView>,
    pub(super) size: [u32; 2],
    /// Number and distance of the nearest surfels; where the CPU drew it only where they were asked for.
    pub(crate) winners: Option<wgpu::TextureView>,
    /// Distances of the nearest surfels along the viewing axis, scene units, 0 where nothing is: where the CPU drew it and
    /// was asked for them.
    pub(crate) distances: Option<Arc<Image>>,
    pub(crate) nearest: Option<wgpu::TextureView>,
    pub(crate) blended: Option<wgpu::TextureView>,
    pub(crate) fields: Option<wgpu::TextureView>,
    pub(crate) material: Option<wgpu::TextureView>,
    pub(crate) object: Option<wgpu::TextureView>,
    pub(crate) visible: bool,
    /// Which parts of it hold surfels, where that is known: where the CPU drew it.
    pub(crate) covered: Option<Arc<Coverage>>,
    /// Surfels that were drawn for it last.
    n_drawn: usize,
    /// Size of the picture that it was used for last, pixels: cameras of a graph have others.
    used_for: [u32; 2],
}

impl Surface {
    /// Size in pixels.
    pub(crate) fn size(&self) -> wgpu::Extent3d {
        wgpu::Extent3d { width: self.size[0], height: self.size[1], depth_or_array_layers: 1 }
    }

    /// Lends its textures to surfaces that come.
    fn spare(self, spare: &mut SpareTextures) {
        let Self { nearest, blended, fields, material, object, covered, size, .. } = self;
        let whole = || Arc::new(Coverage::whole(size.map(|side| side as usize)));
        let views = [nearest, blended, fields, material, object].into_iter().flatten();
        spare.replace(views, &covered.unwrap_or_else(whole));
    }

    /// Where the nearest surfels are drawn.
    ///
    /// # Errors
    /// Where no texture was made for them.
    pub(crate) fn winners(&self) -> Result<&wgpu::TextureView, String> {
        self.winners.as_ref().ok_or_else(|| "the nearest surfels were not drawn".to_owned())
    }

    /// Makes it, where it is not there.
    pub(crate) fn make_winners(&mut self, gpu: &Gpu) -> &wgpu::TextureView {
        let (size, format) = (self.size, wgpu::TextureFormat::Rg32Uint);
        self.winners.get_or_insert_with(|| texture(gpu, "nearest surfels", size, format))
    }

    /// Bytes of its textures, without what the driver adds, and of its distances.
    fn bytes(&self) -> u64 {
        let drawn = [&self.depth, &self.winners, &self.nearest, &self.blended, &self.fields];
        let all = drawn.into_iter().chain([&self.material, &self.object]);
        let textures: u64 = all.flatten().map(|view| texture_bytes(view.texture())).sum();
        let distances = self.distances.as_ref().map_or(0, |image| size_of_val(&*image.data));
        textures + distances as u64
    }

    /// The packed surface of a mode, once made.
    pub(crate) fn packed(&self, mode: SurfaceMode) -> Option<&wgpu::TextureView> {
        match mode {
            SurfaceMode::Nearest => self.nearest.as_ref(),
            SurfaceMode::Blended => self.blended.as_ref(),
            SurfaceMode::Fields => self.fields.as_ref(),
        }
    }
}

/// What a surface buffer is made from.
pub(crate) struct SurfaceInput<'a> {
    /// Whether surfels that are seen from behind have a colour of their own.
    pub(crate) tints_backs: bool,
    /// Whether near round splats are bounded.
    pub(crate) bounds_round: bool,
    pub(crate) clouds: &'a [DrawnCloud<'a>],
    pub(crate) settings: &'a SurfaceSettings,
    /// One surfel of so many is drawn.
    pub(crate) stride: u32,
    pub(crate) view_uniform: &'a wgpu::Buffer,
    /// Scene units per unit of drawing.
    pub(crate) unit: f64,
    pub(crate) view: &'a View,
    pub(crate) size: [u32; 2],
    /// Whether compute draws the small surfels.
    pub(crate) computes: bool,
    /// The view and its settings as the CPU draws it.
    pub(crate) raster_view: &'a surfelshop_raster::View,
    /// Equal keys mean equal surfaces.
    pub(crate) key: Vec<u8>,
}

impl SurfaceInput<'_> {
    /// The largest radius of a cloud's round splats here, as [`DrawnCloud::round_reach`] has it.
    pub(crate) fn round_reach(&self, cloud: &DrawnCloud<'_>) -> f32 {
        if self.bounds_round { cloud.round_reach } else { f32::INFINITY }
    }

    /// Rigid motion to view space, in units of drawing, for positions relative to an origin.
    pub(crate) fn view_from_offset(&self, origin: DVec3) -> Mat4 {
        let to_drawn = DMat4::from_scale(DVec3::splat(1.0 / self.unit));
        (to_drawn * self.view.view_from_offset(origin)).as_mat4()
    }
}

/// Surface buffers by key.
#[derive(Default)]
pub(crate) struct Surfaces {
    kept: Vec<(Vec<u8>, Surface)>,
    /// Memory that the CPU draws into.
    scratch: surfelshop_raster::Picture,
    /// Textures for what it draws next.
    spare: SpareTextures,
    /// What says that nobody wants the picture any more.
    pub(crate) stop: Option<Arc<AtomicBool>>,
    /// No view is drawn a second time, so that none but the last surface is kept.
    pub(crate) passing: bool,
    pub(crate) counts: SurfaceCounts,
    /// Surfels that were drawn last.
    pub(crate) n_drawn: usize,
    /// Cameras of graphs whose surfaces are kept besides, and frames for which they are.
    n_cameras: usize,
    n_frames_left: u64,
    /// Size of the picture that is drawn, pixels.
    size: [u32; 2],
}

impl Surfaces {
    /// Makes room for the surfaces of so many cameras of a graph, once a frame, for a picture of this
    /// size. Views with other graphs may be drawn in between, so it stays for a while.
    pub(crate) fn make_room(&mut self, n_cameras: usize, size: [u32; 2]) {
        self.size = size;
        self.n_frames_left = self.n_frames_left.saturating_sub(1);
        if n_cameras >= self.n_cameras || self.n_frames_left == 0 {
            (self.n_cameras, self.n_frames_left) = (n_cameras, KEPT_FRAMES);
        }
    }

    /// Lets go of all that is kept: where it is to be made anew, and after a frame that failed half way.
    pub(crate) fn forget(&mut self) {
        let last = self.kept.drain(..).next();
        if let Some((_, surface)) = last {
            surface.spare(&mut self.spare);
        }
    }

    /// Lets go of what was made for pictures of other sizes than these, and of what the CPU drew
    /// into.
    pub(crate) fn keep_sizes(&mut self, sizes: &[[u32; 2]]) {
        self.kept.retain(|(_, surface)| sizes.contains(&surface.used_for));
        self.scratch = surfelshop_raster::Picture::default();
        self.spare = SpareTextures::default();
    }

    /// Bytes of all that is kept for frames to come, without what the driver adds.
    pub(crate) fn bytes(&self) -> u64 {
        let kept: u64 = self.kept.iter().map(|(_, surface)| surface.bytes()).sum();
        kept + self.scratch.bytes() + self.spare.bytes()
    }

    /// Textures of the surface that was drawn last.
    pub(crate) fn textures(&self) -> Vec<ResourceUse> {
        let Some((_, surface)) = self.kept.first() else { return Vec::new() };
        let all = [
            ("surfels: nearest depth", "decides which surfels are nearest", &surface.depth),
            ("surfels: nearest", "numbers and distances of the nearest", &surface.winners),
            ("surfels: nearest surface", "read by passes over the nearest", &surface.nearest),
            ("surfels: blended surface", "read by passes over what is blended", &surface.blended),
            (
                "surfels: blended surface with normal fields",
                "read by passes over normals that vary over surfels",
                &surface.fields,
            ),
            ("surfels: materials", "read by passes that ask for materials", &surface.material),
            ("surfels: clouds", "read by passes that ask which cloud it is", &surface.object),
        ];
        let used = all.into_iter().map(|(label, why, view)| match view {
            Some(view) => ResourceUse::of(label, view.texture(), why),
            None => ResourceUse::missing(label, "nothing that was drawn needs it"),
        });
        used.collect()
    }

    /// Records what is missing of a view's surface and returns it.
    ///
    /// # Errors
    /// Where a pipeline cannot be made.
    pub(crate) fn ensure(
        &mut self,
        parts: SurfaceParts,
        input: &SurfaceInput<'_>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<Surface, String> {
        let mut surface = match self.kept.iter().position(|(key, _)| *key == input.key) {
            Some(at) => self.kept.remove(at).1,
            None => {
                self.make_room_for_one();
                Surface::new(input.size)
            }
        };
        if input.clouds.iter().all(|cloud| cloud.on_host.is_some()) {
            let n_blended = |surface: &Surface| {
                u32::from(surface.blended.is_some()) + u32::from(surface.fields.is_some())
            };
            let was = (surface.nearest.is_some(), n_blended(&surface));
            let (scratch, spare) = (&mut self.scratch, &mut self.spare);
            scratch.stop.clone_from(&self.stop);
            let drawn = cpu::ensure(parts, input, &mut surface, scratch, spare, recorder);
            let drawn = drawn.map_err(|_stopped| STOPPED.to_owned())?;
            self.counts.visibility += drawn;
            if drawn > 0 {
                surface.n_drawn = self.scratch.drawn.surfels;
            }
            self.n_drawn = surface.n_drawn;
            self.counts.nearest += u32::from(surface.nearest.is_some() && !was.0);
            self.counts.blended += n_blended(&surface) - was.1;
            return Ok(self.keep(input, surface));
        }
        let mut drawing = None;
        self.draw(parts, input, &mut surface, &mut drawing, recorder, pipelines)?;
        look_up(parts, input, &mut surface, &mut drawing, recorder, pipelines)?;
        surface.n_drawn = drawing.map_or(surface.n_drawn, |drawing| drawing.n_drawn);
        self.n_drawn = surface.n_drawn;
        Ok(self.keep(input, surface))
    }

    /// Has the device draw what is missing.
    fn draw<'a>(
        &mut self,
        parts: SurfaceParts,
        input: &'a SurfaceInput<'a>,
        surface: &mut Surface,
        drawing: &mut Option<Drawing<'a>>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), String> {
        let gpu = recorder.gpu;
        if surface.depth.is_none() {
            let format = wgpu::TextureFormat::Depth32Float;
            surface.depth = Some(texture(gpu, "nearest depth", input.size, format));
        }
        surface.make_winners(gpu);
        // What compute leaves for blending is not kept: it is found again where that comes later.
        let blends =
            parts.blended && surface.blended.is_none() || parts.fields && surface.fields.is_none();
        let left = input.computes && blends;
        if parts.visibility && surface.visible && !left {
            recorder.note("surfels: visibility", PassState::Reused);
        } else if parts.visibility {
            begun(drawing, input, gpu).nearest(surface, recorder, pipelines)?;
            surface.visible = true;
            self.counts.visibility += 1;
        }
        if parts.nearest && surface.nearest.is_some() {
            recorder.note("surfels: nearest", PassState::Reused);
        } else if parts.nearest {
            let view = packed_texture(gpu, input.size);
            let drawing = begun(drawing, input, gpu);
            drawing.lookup(Lookup::Surface, surface, &view, recorder, pipelines)?;
            let view = drawing.with_smooth_rims(view, surface, recorder, pipelines)?;
            surface.nearest = Some(view);
            self.counts.nearest += 1;
        }
        let blended = [(parts.blended, SurfaceMode::Blended), (parts.fields, SurfaceMode::Fields)];
        for (_, mode) in blended.into_iter().filter(|(wanted, _)| *wanted) {
            if surface.packed(mode).is_some() {
                recorder.note("surfels: blend", PassState::Reused);
                continue;
            }
            let view = packed_texture(gpu, input.size);
            let fields = mode == SurfaceMode::Fields;
            let drawing = begun(drawing, input, gpu).with_fields(fields);
            drawing.blended(surface, &view, recorder, pipelines)?;
            let view = drawing.with_smooth_rims(view, surface, recorder, pipelines)?;
            let place = if fields { &mut surface.fields } else { &mut surface.blended };
            *place = Some(view);
            self.counts.blended += 1;
        }
        Ok(())
    }

    fn keep(&mut self, input: &SurfaceInput<'_>, mut surface: Surface) -> Surface {
        surface.used_for = self.size;
        self.kept.insert(0, (input.key.clone(), surface.clone()));
        surface
    }

    /// Lets go of the surfaces used longest ago, so that their textures are there for the next. Those of the frame that
    /// is drawn stay: there is room for all its cameras.
    fn make_room_for_one(&mut self) {
        let most = match self.passing {
            true => self.n_cameras.max(1),
            false => KEPT_SURFACES + self.n_cameras,
        };
        while self.kept.len() >= most {
            let Some((_, surface)) = self.kept.pop() else { break };
            surface.spare(&mut self.spare);
        }
    }
}

/// Has the device look up what is missing of the nearest surfels.
fn look_up<'a>(
    parts: SurfaceParts,
    input: &'a SurfaceInput<'a>,
    surface: &mut Surface,
    drawing: &mut Option<Drawing<'a>>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<(), String> {
    let (gpu, format) = (recorder.gpu, wgpu::TextureFormat::R32Uint);
    if parts.material && surface.material.is_some() {
        recorder.note("surfels: material", PassState::Reused);
    } else if parts.material {
        let view = texture(gpu, "material", input.size, format);
        let drawing = begun(drawing, input, gpu);
        drawing.lookup(Lookup::Material, surface, &view, recorder, pipelines)?;
        surface.material = Some(view);
    }
    if parts.object && surface.object.is_some() {
        recorder.note("surfels: object", PassState::Reused);
    } else if parts.object {
        // Where there is one cloud, a single pixel says so; textures begin as zeros.
        let one = input.clouds.iter().all(|cloud| cloud.object == 0);
        let view = texture(gpu, "object", if one { [1, 1] } else { input.size }, format);
        if !one {
            let drawing = begun(drawing, input, gpu);
            drawing.lookup(Lookup::Object, surface, &view, recorder, pipelines)?;
        }
        surface.object = Some(view);
    }
    Ok(())
}

/// What draws, once something is to be drawn.
fn begun<'d, 'a>(
    drawing: &'d mut Option<Drawing<'a>>,
    input: &'a SurfaceInput<'a>,
    gpu: &Gpu,
) -> &'d mut Drawing<'a> {
    drawing.get_or_insert_with(|| Drawing::new(input, gpu))
}

impl Surface {
    fn new(size: [u32; 2]) -> Self {
        Self {
            depth: None,
            size,
            winners: None,
            nearest: None,
            blended: None,
            fields: None,
            material: None,
            object: None,
            visible: false,
            distances: None,
            covered: None,
            n_drawn: 0,
            used_for: size,
        }
    }
}

pub(crate) fn packed_texture(gpu: &Gpu, size: [u32; 2]) -> wgpu::TextureView {
    texture(gpu, "surface", size, wgpu::TextureFormat::Rgba32Uint)
}
