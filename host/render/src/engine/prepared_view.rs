//! The bytes of the host's own uniforms, and the key of a surface.

use crate::engine::RenderRequest;
use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::host_uniform::HostUniform;
use crate::surfels::{BACK_ALBEDO, DrawnCloud, SurfaceInput};
use glam::{DVec3, Mat4, Vec2, Vec4};
use std::ops::RangeInclusive;
use surfelshop_api::{Lamp, ObjectFrame, Projection, Scene, Uniform, View};

pub(super) fn uniform(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    gpu.filled_buffer(label, bytes, wgpu::BufferUsages::UNIFORM)
}

/// The view as surfels are drawn: in units of its own, so that squares of a scene's lengths neither
/// overflow nor vanish in f32, and with room before the near plane.
pub(super) struct DrawnView {
    pub(super) view: View,
    /// Scene units per unit of drawing, a power of two: scaling by it loses nothing.
    pub(super) unit: f64,
}

/// Exponents beyond this are left to f32 itself, whose range ends at 2^127.
const MAX_EXPONENT: f64 = 120.0;

/// A pixel of low-pass makes a disc's half axes longer by at most so many pixels' widths: one across, and
/// two in depth (`MAX_SLOPE` of the surfel shaders) along each of two axes.
const WIDENED_BY: f64 = 3.0;

/// How a view is drawn. Its near plane lies before the requested one, so that the depth tolerance
/// has room there (`MAX_PULL` of the surfel shaders).
fn drawn_view(request: &RenderRequest<'_>, clouds: &[DrawnCloud<'_>]) -> DrawnView {
    let facts = request.facts;
    let center = 0.5 * facts.bounds_min + 0.5 * facts.bounds_max;
    let reach = (facts.bounds_max - facts.bounds_min)
        .abs()
        .max((request.view.camera.eye - center).abs())
        .max_element();
    let exponent = reach.log2().round().clamp(-MAX_EXPONENT, MAX_EXPONENT);
    let unit = if exponent.is_finite() { exponent.exp2() } else { 1.0 };
    let mut view = request.view;
    view.near /= unit;
    view.far /= unit;
    match &mut view.camera.projection {
        Projection::Perspective { .. } => view.near *= 0.5,
        Projection::Orthographic { height } => {
            *height /= unit;
            let settings = &request.scene.surface;
            let reach = clouds.iter().fold(0.0f32, |most, cloud| most.max(cloud.max_radius));
            let pixel = *height / f64::from(view.size_px[1]);
            let widened = f64::from(reach * settings.radius_scale) / unit
                + WIDENED_BY * f64::from(settings.low_pass) * pixel;
            view.near -= f64::from(settings.depth_tolerance) * widened;
        }
    }
    DrawnView { view, unit }
}

/// How surfels are drawn that are seen from a place.
#[derive(Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub(super) struct DrawnAs {
    /// Whether compute draws the small ones.
    pub(super) computes: bool,
    /// Whether those seen from behind have a colour of their own.
    pub(super) tints_backs: bool,
    /// Whether near round splats are bounded. Where it is no eye that looks, as for the shadows of a lamp, they hide
    /// what the eye sees them hide.
    pub(super) bounds_round: bool,
}

/// Where surfels are seen from in a frame.
pub(super) struct PreparedView {
    pub(super) drawn: DrawnView,
    uniform: wgpu::Buffer,
    raster_view: surfelshop_raster::View,
    key: Vec<u8>,
    drawn_as: DrawnAs,
}

impl PreparedView {
    pub(super) fn new(
        gpu: &Gpu,
        request: &RenderRequest<'_>,
        clouds: &[DrawnCloud<'_>],
        drawn_as: DrawnAs,
        shift_px: Vec2,
    ) -> Result<Self, RenderError> {
        let drawn = drawn_view(request, clouds);
        let shown = drawn_uniform(request, &drawn, shift_px);
        Ok(Self {
            uniform: uniform(gpu, "drawn view", &shown.into_bytes()),
            raster_view: raster_view(request, &drawn, drawn_as.tints_backs, shift_px),
            key: surface_key(request, clouds, drawn_as, shift_px)?,
            drawn_as,
            drawn,
        })
    }

    /// What a surface buffer is made from.
    pub(super) fn input<'a>(
        &'a self,
        request: &'a RenderRequest<'_>,
        clouds: &'a [DrawnCloud<'a>],
    ) -> SurfaceInput<'a> {
        SurfaceInput {
            raster_view: &self.raster_view,
            clouds,
            settings: &request.scene.surface,
            stride: request.stride,
            view_uniform: &self.uniform,
            unit: self.drawn.unit,
            view: &request.view,
            size: request.view.size_px,
            computes: self.drawn_as.computes,
            tints_backs: self.drawn_as.tints_backs,
            bounds_round: self.drawn_as.bounds_round,
            key: self.key.clone(),
        }
    }
}

/// The bytes of `surfelshop::view::View` for the passes that draw surfels, in units of drawing.
fn drawn_uniform(request: &RenderRequest<'_>, drawn: &DrawnView, shift_px: Vec2) -> HostUniform {
    let near = request.view.near / drawn.unit;
    view_bytes(request, &drawn.view, near, 1.0, shift_px)
}

/// The bytes of `surfelshop::view::View` for the passes of graphs, in scene units.
pub(super) fn view_uniform(
    request: &RenderRequest<'_>,
    drawn: &DrawnView,
    shift_px: Vec2,
) -> HostUniform {
    view_bytes(request, &request.view, request.view.near, drawn.unit, shift_px)
}

/// The projection that shows in each pixel what lies `shift_px` from its centre, y downwards.
fn shifted(clip_from_view: Mat4, size_px: [u32; 2], shift_px: Vec2, orthographic: bool) -> Mat4 {
    if shift_px == Vec2::ZERO {
        return clip_from_view;
    }
    let size = Vec2::new(size_px[0] as f32, size_px[1] as f32);
    // In perspective the fourth component is minus z.
    let moved = 2.0 * shift_px / size * Vec2::new(1.0, -1.0);
    let mut clip = clip_from_view;
    if orthographic {
        clip.w_axis -= moved.extend(0.0).extend(0.0);
    } else {
        clip.z_axis += moved.extend(0.0).extend(0.0);
    }
    clip
}

fn view_bytes(
    request: &RenderRequest<'_>,
    view: &View,
    near: f64,
    unit: f64,
    shift_px: Vec2,
) -> HostUniform {
    let origin = request.clouds.first().map_or(DVec3::ZERO, |cloud| cloud.origin);
    let world_from_view = view.camera.view_from_world().transpose();
    let eye = (view.camera.eye - origin).as_vec3();
    let [half_x, half_y] = view.half_extent();
    let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
    HostUniform::new()
        .mat4(
            "clip_from_view",
            shifted(view.clip_from_view(), view.size_px, shift_px, orthographic),
        )
        .mat4("world_from_view", Mat4::from_mat3_translation(world_from_view.as_mat3(), eye))
        .vec2("half_extent", Vec2::new(half_x as f32, half_y as f32))
        .vec2("size_px", Vec2::new(view.size_px[0] as f32, view.size_px[1] as f32))
        .f32("near", near as f32)
        .f32("far", view.far as f32)
        .u32("orthographic", u32::from(orthographic))
        .u32("frame_index", request.frame_index)
        .f32("unit", unit as f32)
}

/// Farther away than this, in units of drawing, a light is brought nearer in its direction and dimmed
/// as much: all that is seen lies within a few units, from where its direction then differs by less
/// than a hundredth of what f32 resolves, and squares of distances stay in its range.
const FARTHEST_LAMP: f64 = 1e9;

/// Radii of lights in units of drawing whose squares f32 holds. A ten-thousandth of a scene lies beyond
/// them only where it is seen from far more than millions of its sizes away, or is a single point.
const LAMP_RADII: RangeInclusive<f64> = 1e-15..=1e15;

/// Intensity in units of drawing that f32 holds. Over the square of the radius it is at most as much
/// as `Lamp` leaves of it, 1e30.
const BRIGHTEST_LAMP: f64 = 1e30;

/// The bytes of `surfelshop::light::Lights` for passes that look from the request's camera, in a view of
/// which lights may follow the own one, `of`.
pub(super) fn lights_uniform(request: &RenderRequest<'_>, of: &View, drawn: &DrawnView) -> Uniform {
    let facts = request.facts;
    let middle = ObjectFrame::around(facts.bounds_min, facts.bounds_max, 1.0).center;
    let lights = request.scene.lights.iter().take(Scene::MAX_LIGHTS);
    let lamps: Vec<Lamp> = lights.map(|light| Lamp::new(light, of, facts)).collect();
    let mut uniform = Uniform::new();
    for lamp in &lamps {
        let there = lamp.arriving(middle);
        uniform = uniform
            .vec4(there.towards.as_vec3().extend(0.0))
            .vec4(there.radiance.as_vec3().extend(0.0));
    }
    for _ in lamps.len()..Scene::MAX_LIGHTS {
        uniform = uniform.vec4(Vec4::ZERO).vec4(Vec4::ZERO);
    }
    uniform = uniform.u32(lamps.len() as u32);
    let none = [Vec4::ZERO; 3];
    let placed = lamps.iter().map(|lamp| lamp_vectors(lamp, request.view.camera.eye, drawn.unit));
    let placed = placed.chain(std::iter::repeat(none)).take(Scene::MAX_LIGHTS);
    placed.flatten().fold(uniform, Uniform::vec4)
}

/// A `surfelshop::light::Lamp` as three vectors of 16 bytes.
fn lamp_vectors(lamp: &Lamp, eye: DVec3, unit: f64) -> [Vec4; 3] {
    let Some(position) = lamp.position else { return [Vec4::ZERO; 3] };
    // One beyond all numbers gives no light, wherever it is.
    let offset = Some((position - eye) / unit).filter(|offset| offset.is_finite());
    let nearer = offset.map_or(0.0, |offset| (FARTHEST_LAMP / offset.length()).min(1.0));
    let offset = offset.unwrap_or_default();
    let nearest = (lamp.nearest / unit).clamp(*LAMP_RADII.start(), *LAMP_RADII.end());
    let intensity = lamp.intensity * (nearer / unit).powi(2);
    [
        (offset * nearer).as_vec3().extend((nearest * nearest) as f32),
        intensity.min(DVec3::splat(BRIGHTEST_LAMP)).as_vec3().extend(lamp.edge as f32),
        lamp.towards.as_vec3().extend(lamp.sharpness as f32),
    ]
}

/// The view as the CPU draws surfels, in units of drawing.
fn raster_view(
    request: &RenderRequest<'_>,
    drawn: &DrawnView,
    tints_backs: bool,
    shift_px: Vec2,
) -> surfelshop_raster::View {
    let settings = &request.scene.surface;
    let camera = &request.view.camera;
    let world_from_view = camera.view_from_world().transpose().as_mat3().transpose();
    surfelshop_raster::View {
        size_px: request.view.size_px,
        half_extent: drawn.view.half_extent().map(|half| half as f32),
        shift_px: shift_px.into(),
        near: (request.view.near / drawn.unit) as f32,
        orthographic: matches!(camera.projection, Projection::Orthographic { .. }),
        world_from_view: world_from_view.to_cols_array_2d(),
        two_sided: settings.two_sided,
        back_albedo: tints_backs.then_some(BACK_ALBEDO),
        low_pass: settings.low_pass,
        tolerance: settings.depth_tolerance,
        tangent_scale: settings.radius_scale,
        unit: drawn.unit as f32,
        detail_px: request.detail_px,
    }
}

/// Equal bytes mean an equal surface: clouds, camera, size, shift, surface settings, stride, detail, how they are
/// drawn, and whether backs are tinted.
fn surface_key(
    request: &RenderRequest<'_>,
    clouds: &[DrawnCloud<'_>],
    drawn_as: DrawnAs,
    shift_px: Vec2,
) -> Result<Vec<u8>, RenderError> {
    let clouds: Vec<_> = clouds
        .iter()
        .map(|c| {
            (c.origin, c.object, c.n_surfels, c.chunk_len, &c.generations, c.on_host.is_some())
        })
        .collect();
    let shift_bits = shift_px.to_array().map(f32::to_bits);
    let drawn = (request.stride, request.detail_px.to_bits(), drawn_as, shift_bits);
    rmp_serde::to_vec(&(&request.view, &request.scene.surface, drawn, clouds))
        .map_err(|error| RenderError::Host(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_compiler::{BindingKind, Library, on_large_stack, reflect};
    use surfelshop_api::params::Values;
    use surfelshop_api::{Camera, CloudFacts, Light};

    /// Does something with a request that has nothing but a view and a light.
    fn with_request<T>(work: impl FnOnce(&RenderRequest<'_>) -> T) -> T {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        let lights = vec![Light::Point { position: DVec3::X, intensity: glam::Vec3::ONE }];
        let scene = Scene { lights, ..Scene::default() };
        work(&RenderRequest {
            clouds: &[],
            facts: &CloudFacts::default(),
            scene: &scene,
            view: View { camera, size_px: [4, 3], near: 0.1, far: 9.0 },
            values: &Values::new(),
            outputs: &[],
            frame_index: 7,
            environment: None,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        })
    }

    #[test]
    fn views_are_laid_out_as_the_shaders_declare_them() {
        let uniform =
            with_request(|request| view_bytes(request, &request.view, 0.1, 1.0, Vec2::ZERO));
        let source = "#import surfelshop::view\n\
                      @fragment fn main() -> @location(0) vec4<f32> { return vec4(view::view.near); }";
        uniform.assert_is_laid_out_as(source, "main", "surfelshop::view::view");
    }

    #[test]
    fn a_shifted_projection_shows_what_lies_that_far_from_the_centre() {
        let point = Vec4::new(0.3, -0.2, -2.0, 1.0);
        for projection in
            [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 3.0 }]
        {
            let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
            let view = View { camera, size_px: [40, 30], near: 0.1, far: 9.0 };
            let orthographic = matches!(projection, Projection::Orthographic { .. });
            let seen = |shift: Vec2| {
                let matrix = shifted(view.clip_from_view(), view.size_px, shift, orthographic);
                let clip = matrix * point;
                let ndc = clip.truncate() / clip.w;
                (Vec2::new(20.0 * (ndc.x + 1.0), 15.0 * (1.0 - ndc.y)), ndc.z)
            };
            let (middle, depth) = seen(Vec2::ZERO);
            let (moved, same) = seen(Vec2::new(0.25, -0.375));
            assert_eq!(depth, same);
            // Single precision: some units in the last place of 40 pixels.
            assert!((middle - moved - Vec2::new(0.25, -0.375)).length() < 2e-5, "{middle} {moved}");
        }
    }

    #[test]
    fn lights_take_as_many_bytes_as_the_shaders_declare() {
        let bytes = with_request(|request| {
            let drawn = DrawnView { view: request.view, unit: 1.0 };
            lights_uniform(request, &request.view, &drawn).into_bytes()
        });
        let source = "#import surfelshop::light\n\
                      @fragment fn main() -> @location(0) vec4<f32> {\n\
                          return vec4(f32(light::lights.count));\n}";
        let kind = on_large_stack(|| {
            let composed = Library::new(true).unwrap().compose(source, &[], &[]).unwrap();
            let point = reflect(&composed, naga::ShaderStage::Fragment, "main").unwrap();
            point.bindings[0].kind
        });
        assert_eq!(kind.unwrap(), BindingKind::Uniform { size: bytes.len() as u64 });
    }
}
