//! How much textures, buffers and cameras of a graph may take.

mod work;

pub(crate) use work::{Watched, confines, loop_units};

use crate::graph::RenderError;
use crate::graph::plan::Plan;
use crate::shader_compiler::{Binding, BindingKind};
use surfelshop_api::graph::{Buffer, ColumnsOf, Lifetime};

/// Most bytes of one texture or buffer of a graph.
pub(crate) const MAX_RESOURCE_BYTES: u64 = 1 << 30;
/// Most bytes of all textures and buffers of a graph, and of what its cameras see.
pub(crate) const MAX_GRAPH_BYTES: u64 = 4 << 30;
/// Most cameras of a graph: six for each of a scene's lights.
const MAX_CAMERAS: usize = 6 * surfelshop_api::Scene::MAX_LIGHTS;
/// Bytes of a pixel that a camera sees: depth, number and distance of the nearest surfel, and a surface.
const CAMERA_PIXEL_BYTES: u64 = 4 + 8 + 16;

/// Most bytes of a key that bytes stay under.
const MAX_KEY_BYTES: usize = 1024;

/// Most components of a column.
const MAX_COMPONENTS: u32 = 1024;

/// # Errors
/// Where a column's name is none of WGSL, comes twice, or has too few or too many components.
fn check_columns(columns: &ColumnsOf) -> Result<(), String> {
    if columns.columns.is_empty() {
        return Err("is to hold columns and names none".to_owned());
    }
    for (i, column) in columns.columns.iter().enumerate() {
        let name = &column.name;
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let begins = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic());
        if !(plain && begins) {
            let name = name.escape_debug();
            return Err(format!(
                "holds a column `{name}`; expected a name of letters, digits and _"
            ));
        }
        if !(1..=MAX_COMPONENTS).contains(&column.components) {
            let n = column.components;
            return Err(format!(
                "holds `{name}` with {n} components; 1 to {MAX_COMPONENTS} are given"
            ));
        }
        if columns.columns[..i].iter().any(|other| other.name == *name) {
            return Err(format!("holds the column `{name}` twice"));
        }
    }
    Ok(())
}

impl Plan {
    /// # Errors
    /// Where an entry point binds more of something than the device does.
    pub(super) fn check_bound(
        &self,
        bindings: &[Binding],
        limits: &wgpu::Limits,
    ) -> Result<(), String> {
        let count = |is_one: fn(&BindingKind) -> bool| {
            bindings.iter().filter(|binding| is_one(&binding.kind)).count() as u64
        };
        let kinds = [
            (
                "storage buffers",
                count(|kind| matches!(kind, BindingKind::Storage { .. })),
                limits.max_storage_buffers_per_shader_stage,
            ),
            (
                "storage textures",
                count(|kind| matches!(kind, BindingKind::StorageTexture { .. })),
                limits.max_storage_textures_per_shader_stage,
            ),
            (
                "textures to read",
                count(|kind| matches!(kind, BindingKind::Texture { .. })),
                limits.max_sampled_textures_per_shader_stage,
            ),
            (
                "samplers",
                count(|kind| matches!(kind, BindingKind::Sampler { .. })),
                limits.max_samplers_per_shader_stage,
            ),
            (
                "uniforms",
                count(|kind| matches!(kind, BindingKind::Uniform { .. })),
                limits.max_uniform_buffers_per_shader_stage,
            ),
        ];
        match kinds.into_iter().find(|(_, n, most)| *n > u64::from(*most)) {
            Some((what, n, most)) => Err(format!("it has {n} {what}; this device binds {most}")),
            None => Ok(()),
        }
    }

    /// # Errors
    /// The first resource that is too large, of no size, or contradicts itself.
    pub(super) fn check_resources(&self, limits: &wgpu::Limits) -> Result<(), RenderError> {
        let sums = [
            self.check_textures(limits)?,
            self.check_buffers(limits)?,
            self.check_cameras(limits)?,
        ];
        let total = sums.into_iter().fold(0u64, u64::saturating_add);
        if total > MAX_GRAPH_BYTES {
            return Err(RenderError::Graph(format!(
                "its textures and buffers, and what its cameras see, have {total} bytes; at most \
                 {MAX_GRAPH_BYTES} are given"
            )));
        }
        Ok(())
    }

    /// Bytes that textures, buffers and cameras were found to have, once they have been checked.
    fn declared_bytes(&self) -> u64 {
        let textures = self.structure.textures.iter().enumerate().map(|(i, texture)| {
            let texels = self.extent(i).map(u64::from).iter().product::<u64>();
            texels.saturating_mul(u64::from(texture.format.bytes_per_texel()))
        });
        let buffers = self.structure.buffers.iter().map(|buffer| buffer.size);
        let cameras = self.structure.cameras.iter().map(|camera| {
            let [width, height] = camera.size_px.map(u64::from);
            width * height * CAMERA_PIXEL_BYTES
        });
        textures.chain(buffers).chain(cameras).fold(0, u64::saturating_add)
    }

    /// Bytes of all textures.
    fn check_textures(&self, limits: &wgpu::Limits) -> Result<u64, RenderError> {
        let mut total = 0u64;
        for (i, texture) in self.structure.textures.iter().enumerate() {
            let refuse = |what: String| {
                Err(RenderError::Graph(format!("texture `{}` {what}", texture.label)))
            };
            let [w, h, d] = self.extent(i);
            let largest = if texture.volume {
                limits.max_texture_dimension_3d
            } else {
                limits.max_texture_dimension_2d
            };
            if w == 0 || h == 0 || d == 0 {
                return refuse(format!("is {w} x {h} x {d}; each must be at least 1"));
            }
            let deepest = if texture.volume { largest } else { limits.max_texture_array_layers };
            if w.max(h) > largest || d > deepest {
                let most = format!("{largest} x {largest} x {deepest}");
                return refuse(format!("is {w} x {h} x {d}; the device allows {most}"));
            }
            if texture.mips == 0 || texture.mips > 32 - w.max(h).leading_zeros() {
                return refuse(format!("of {w} x {h} cannot have {} mip levels", texture.mips));
            }
            let texels = u64::from(w) * u64::from(h) * u64::from(d);
            let bytes = texels.saturating_mul(u64::from(texture.format.bytes_per_texel()));
            if bytes > MAX_RESOURCE_BYTES {
                return refuse(format!(
                    "has {bytes} bytes; at most {MAX_RESOURCE_BYTES} are given"
                ));
            }
            if texture.lifetime == Lifetime::History {
                return refuse("is to keep what a frame leaves in it; only buffers do".to_owned());
            }
            total = total.saturating_add(bytes);
        }
        Ok(total)
    }

    /// Bytes of all buffers.
    fn check_buffers(&self, limits: &wgpu::Limits) -> Result<u64, RenderError> {
        let mut total = 0u64;
        let most = limits.max_storage_buffer_binding_size.min(MAX_RESOURCE_BYTES);
        for buffer in &self.structure.buffers {
            let refuse =
                |what: String| Err(RenderError::Graph(format!("buffer `{}` {what}", buffer.label)));
            let Buffer { size, upload, surfels, lifetime, columns, resident, .. } = buffer;
            // Columns come in parts where they are larger than the device binds.
            let most = if columns.is_some() { MAX_GRAPH_BYTES } else { most };
            if *size < 4 || *size > most {
                return refuse(format!("has {size} bytes; 4 to {most} are allowed"));
            }
            if let Some(columns) = columns
                && let Err(what) = check_columns(columns)
            {
                return refuse(what);
            }
            let with = match (surfels, columns) {
                (Some(_), Some(_)) => {
                    return refuse(
                        "is filled with surfels and with columns; fill it once".to_owned(),
                    );
                }
                (Some(_), None) => Some("surfels"),
                (None, Some(_)) => Some("columns"),
                (None, None) => None,
            };
            if let Some(with) = with
                && (upload.is_some() || *lifetime != Lifetime::Frame)
            {
                return refuse(format!(
                    "is filled with {with}; it can neither be uploaded nor kept besides"
                ));
            }
            if let Some(key) = resident
                && key.len() > MAX_KEY_BYTES
            {
                let n = key.len();
                return refuse(format!(
                    "has a key of {n} bytes; at most {MAX_KEY_BYTES} are taken"
                ));
            }
            if resident.is_some() && (with.is_some() || *lifetime != Lifetime::Frame) {
                return refuse(
                    "is resident; it can be neither filled by the host nor kept besides".to_owned(),
                );
            }
            total = total.saturating_add(*size);
        }
        Ok(total)
    }

    /// Bytes of what all cameras see.
    fn check_cameras(&self, limits: &wgpu::Limits) -> Result<u64, RenderError> {
        let cameras = &self.structure.cameras;
        if cameras.len() > MAX_CAMERAS {
            return Err(RenderError::Graph(format!(
                "it has {} cameras; at most {MAX_CAMERAS} are looked through",
                cameras.len()
            )));
        }
        let most = limits.max_texture_dimension_2d;
        let wrong = |size: &[u32; 2]| size.iter().any(|&side| side == 0 || side > most);
        if let Some(camera) = cameras.iter().find(|camera| wrong(&camera.size_px)) {
            return Err(RenderError::Graph(format!(
                "camera `{}` has {} x {} pixels; each side must be 1 to {most}",
                camera.label, camera.size_px[0], camera.size_px[1]
            )));
        }
        let pixels = cameras.iter().map(|camera| camera.size_px.map(u64::from));
        Ok(pixels.map(|[width, height]| width * height * CAMERA_PIXEL_BYTES).sum())
    }
}
