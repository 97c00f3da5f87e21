//! The bytes of the host's own uniforms, and the key of a surface.

use super::RenderRequest;
use crate::gpu::Gpu;
use crate::run::RenderError;
use crate::surfels::DrawnCloud;
use glam::{DVec3, Mat4, Vec2, Vec4};
use surfelshop_api::{Light, Projection, Scene, Uniform, View};
use wgpu::util::DeviceExt as _;

pub(super) fn uniform(gpu: &Gpu, label: &str, uniform: Uniform) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: &uniform.into_bytes(),
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

/// The view as it is drawn: its near plane lies before the requested one, so that the depth
/// tolerance has room there (`MAX_PULL` of the surfel shaders).
pub(super) fn drawn_view(request: &RenderRequest<'_>, clouds: &[DrawnCloud]) -> View {
    let mut view = request.view;
    match view.camera.projection {
        Projection::Perspective { .. } => view.near *= 0.5,
        Projection::Orthographic { height } => {
            let settings = &request.scene.surface;
            let reach = clouds.iter().fold(0.0f32, |most, cloud| most.max(cloud.max_radius));
            let pixel = height / f64::from(view.size_px[1]);
            let widened = reach * settings.radius_scale + settings.low_pass * pixel as f32;
            let slack = settings.depth_tolerance * widened;
            view.near -= f64::from(slack);
        }
    }
    view
}

/// The bytes of `surfelshop::view::View`.
pub(super) fn view_uniform(request: &RenderRequest<'_>, drawn: &View) -> Uniform {
    let view = &request.view;
    let origin = request.clouds.first().map_or(DVec3::ZERO, |cloud| cloud.origin);
    let world_from_view = view.camera.view_from_world().transpose();
    let eye = (view.camera.eye - origin).as_vec3();
    let [half_x, half_y] = view.half_extent();
    let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
    Uniform::new()
        .mat4(drawn.clip_from_view())
        .mat4(Mat4::from_mat3_translation(world_from_view.as_mat3(), eye))
        .vec2(Vec2::new(half_x as f32, half_y as f32))
        .vec2(Vec2::new(view.size_px[0] as f32, view.size_px[1] as f32))
        .f32(view.near as f32)
        .f32(view.far as f32)
        .u32(u32::from(orthographic))
        .u32(request.frame_index)
}

/// The bytes of `surfelshop::light::Lights`; a light's two vectors take 16 bytes each.
pub(super) fn lights_uniform(request: &RenderRequest<'_>) -> Uniform {
    let world_from_view = request.view.camera.view_from_world().transpose();
    let lights = request.scene.lights.iter().take(Scene::MAX_LIGHTS);
    let mut uniform = Uniform::new();
    let mut count = 0;
    for light in lights {
        let Light::Directional { towards, radiance, follows_camera } = *light;
        let world = if follows_camera { world_from_view * towards } else { towards };
        let towards = world.try_normalize().unwrap_or(DVec3::Y).as_vec3();
        uniform = uniform.vec4(towards.extend(0.0)).vec4(radiance.extend(0.0));
        count += 1;
    }
    for _ in count..Scene::MAX_LIGHTS {
        uniform = uniform.vec4(Vec4::ZERO).vec4(Vec4::ZERO);
    }
    uniform.u32(count as u32)
}

/// Equal bytes mean an equal surface: clouds, camera, size and surface settings.
pub(super) fn surface_key(
    request: &RenderRequest<'_>,
    clouds: &[DrawnCloud],
) -> Result<Vec<u8>, RenderError> {
    let clouds: Vec<_> =
        clouds.iter().map(|c| (c.origin, c.n_surfels, c.chunk_len, &c.generations)).collect();
    rmp_serde::to_vec(&(&request.view, &request.scene.surface, clouds))
        .map_err(|error| RenderError::Host(error.to_string()))
}
