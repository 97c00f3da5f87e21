//! The last step of the device: it goes through the tiles' lists, and pictures come out.

use crate::graph::bind;
use crate::graph::execute::Variables;
use crate::graph::splats::device::{Device, name_of};
use crate::graph::splats::parameters::Parameters;
use crate::graph::splats::source::{COMPOSE, Form, PREFIX, compose_defines, compose_source};
use crate::graph::splats::{Made, part_of, surface};
use surfelshop_api::graph::{SplatDepth, Splats, TextureId};

impl Device<'_, '_> {
    /// Goes through all tiles' lists and brings the pictures into the pass's textures.
    pub(super) fn draw(
        &mut self,
        splats: &Splats,
        variables: &Variables<'_>,
        made: &Made,
        view: &Parameters,
        entries: &wgpu::Buffer,
        ranges: &wgpu::Buffer,
    ) -> Result<(), String> {
        let height = view.size[1];
        let n_payloads = splats.targets.len() as u32;
        let surface = match splats.tested {
            true => {
                let Self { recorder, pipelines, scratch, .. } = self;
                let depths = surface::depths(variables, view.size, recorder, pipelines, scratch)?;
                self.taken.push(depths.clone());
                depths
            }
            false => self.numbers("no surface", 1),
        };
        let sums = self.numbers("sums of splats", 4 * n_payloads * view.stride * height);
        let form = Form::of(self.recorder.gpu);
        let defines = compose_defines(splats, form);
        let n_depths = 2 + u32::from(defines.contains(&"DISTORTION"));
        let depths = self.numbers("depths of splats", n_depths * view.depth_stride * height);
        let params = self.uniform(&view.words(made.n));
        let bound = [
            ("params", &params),
            ("footprints", &made.footprints),
            ("payloads", &made.payloads),
            ("entries", entries),
            ("ranges", ranges),
            ("surface", &surface),
            ("sums", &sums),
            ("depths", &depths),
        ];
        let groups = [view.across, view.down];
        match self.per_pixel {
            None => {
                let text = compose_source(splats, form);
                self.run_with(&text, &defines, COMPOSE, groups, &bound)?;
            }
            Some(pipeline) => {
                let group = bind(self.recorder.gpu, pipeline, |name| {
                    let own = name.strip_prefix(PREFIX).unwrap_or_default();
                    if let Some((_, buffer)) = bound.iter().find(|(name, _)| *name == own) {
                        return Some(buffer.as_entire_binding());
                    }
                    match part_of(variables, name, 0) {
                        Some(part) => Some(part.buffer.as_entire_binding()),
                        None => variables.resource(name),
                    }
                })?;
                self.dispatch(&name_of(COMPOSE), pipeline, &group, groups);
            }
        }
        copy_pictures(splats, variables, self, view, &sums, &depths);
        Ok(())
    }
}

/// Brings pictures that lie in buffers into the pass's textures.
pub(super) fn copy_pictures(
    splats: &Splats,
    variables: &Variables<'_>,
    device: &mut Device<'_, '_>,
    view: &Parameters,
    sums: &wgpu::Buffer,
    depths: &wgpu::Buffer,
) {
    let height = view.size[1];
    let mut copy = |target: TextureId, buffer: &wgpu::Buffer, picture: u32, row: u32| {
        // One that nobody reads was not made.
        let texture = variables.resources.textures.get(target.index());
        let Some(Some(texture)) = texture else { return };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: u64::from(picture) * u64::from(row) * u64::from(height),
            bytes_per_row: Some(row),
            rows_per_image: Some(height),
        };
        device.recorder.encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo { buffer, layout },
            texture.as_image_copy(),
            texture.size(),
        );
    };
    for (k, target) in (0..).zip(&splats.targets) {
        copy(*target, sums, k, 16 * view.stride);
    }
    for (which, target) in &splats.depths {
        let picture = match which {
            SplatDepth::Expected => 0,
            SplatDepth::Median => 1,
            SplatDepth::Distortion => 2,
        };
        copy(*target, depths, picture, 4 * view.depth_stride);
    }
}
