//! What plugins are told of a device.

use crate::gpu::Gpu;
use crate::graph::{MAX_GRAPH_BYTES, MAX_RESOURCE_BYTES};
use crate::shader_features::ShaderFeature;
use surfelshop_api::{DeviceLimits, HostInfo};

impl Gpu {
    /// What plugins are told of the device.
    #[must_use]
    pub fn host_info(&self) -> HostInfo {
        HostInfo {
            host_version: env!("CARGO_PKG_VERSION").to_owned(),
            adapter: self.describe(),
            software_adapter: self.is_software(),
            features: self.feature_words().map(str::to_owned).collect(),
            limits: self.limits(),
        }
    }

    /// What the device has, as plugins call it.
    pub(crate) fn feature_words(&self) -> impl Iterator<Item = &'static str> {
        let has = self.device.features();
        let others = [
            ("volume-storage", self.stores_into_volumes()),
            ("float32-blendable", self.blends_f32),
            ("float32-filterable", has.contains(wgpu::Features::FLOAT32_FILTERABLE)),
        ];
        let of_shaders = ShaderFeature::ALL.map(|feature| (feature.word, feature.is_of(has)));
        others.into_iter().chain(of_shaders).filter(|(_, here)| *here).map(|(word, _)| word)
    }

    /// How much the device takes, and this host of graphs on it.
    fn limits(&self) -> DeviceLimits {
        let limits = self.device.limits();
        let bound = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let has_subgroups = self.device.features().contains(wgpu::Features::SUBGROUP);
        let subgroup_size = [self.info.subgroup_min_size, self.info.subgroup_max_size];
        DeviceLimits {
            buffer_bytes: bound.min(MAX_RESOURCE_BYTES),
            columns_bytes: MAX_GRAPH_BYTES,
            graph_bytes: MAX_GRAPH_BYTES,
            uniform_bytes: limits.max_uniform_buffer_binding_size,
            storage_buffers: limits.max_storage_buffers_per_shader_stage,
            storage_textures: limits.max_storage_textures_per_shader_stage,
            textures: limits.max_sampled_textures_per_shader_stage,
            samplers: limits.max_samplers_per_shader_stage,
            uniforms: limits.max_uniform_buffers_per_shader_stage,
            texture_side: limits.max_texture_dimension_2d,
            volume_side: limits.max_texture_dimension_3d,
            texture_layers: limits.max_texture_array_layers,
            workgroup_invocations: limits.max_compute_invocations_per_workgroup,
            workgroup_size: [
                limits.max_compute_workgroup_size_x,
                limits.max_compute_workgroup_size_y,
                limits.max_compute_workgroup_size_z,
            ],
            workgroup_bytes: limits.max_compute_workgroup_storage_size,
            subgroup_size: if has_subgroups { subgroup_size } else { [0; 2] },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plugins_are_told_what_a_device_has_and_takes() {
        // wgpu's no-op device has every feature and the limits that WebGPU promises.
        let info = Gpu::noop().unwrap().host_info();
        for feature in ShaderFeature::ALL {
            assert!(info.features.iter().any(|word| word == feature.word), "{feature:?}");
        }
        let limits = info.limits;
        assert_eq!((limits.storage_buffers, limits.storage_textures), (8, 4));
        assert_eq!((limits.buffer_bytes, limits.workgroup_bytes), (128 << 20, 16 << 10));
        assert_eq!((limits.workgroup_invocations, limits.texture_side), (256, 8192));
    }
}
