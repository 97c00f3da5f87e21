//! Views of textures, as passes bind them and draw into them.

use crate::graph::plan::{Node, Plan, targets_of};
use crate::graph::resources::FrameResources;
use std::collections::HashMap;
use surfelshop_api::graph::{Resource, Target};

/// Views of the textures a pass reads or stores into, by variable.
pub(in crate::graph) fn texture_views(
    plan: &Plan,
    resources: &FrameResources,
    index: usize,
) -> HashMap<String, wgpu::TextureView> {
    let pass = &plan.structure.passes[index];
    let mut views = HashMap::new();
    for (name, resource) in &pass.bindings {
        let Resource::Texture { id, mip } = resource else { continue };
        let Some(Some(texture)) = resources.textures.get(id.index()) else { continue };
        let described = &plan.structure.textures[id.index()];
        let dimension = match (described.volume, plan.extent(id.index())[2]) {
            (true, _) => wgpu::TextureViewDimension::D3,
            (false, 1) => wgpu::TextureViewDimension::D2,
            (false, _) => wgpu::TextureViewDimension::D2Array,
        };
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(dimension),
            base_mip_level: mip.unwrap_or(0),
            mip_level_count: mip.map(|_| 1),
            ..Default::default()
        });
        views.insert(name.clone(), view);
    }
    views
}

/// The views a pass draws into, whether each is cleared (where nothing has drawn into the texture
/// in this frame), and the slice of a volume.
pub(in crate::graph) fn target_views(
    plan: &Plan,
    resources: &FrameResources,
    index: usize,
    written: &[Node],
) -> Vec<(wgpu::TextureView, bool, Option<u32>)> {
    let view_of = |target: &Target| {
        let i = target.texture.index();
        let texture = resources.textures[i].as_ref()?;
        let volume = plan.structure.textures[i].volume;
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(if volume {
                wgpu::TextureViewDimension::D3
            } else {
                wgpu::TextureViewDimension::D2
            }),
            base_mip_level: target.mip,
            mip_level_count: Some(1),
            base_array_layer: if volume { 0 } else { target.layer },
            array_layer_count: if volume { None } else { Some(1) },
            ..Default::default()
        });
        let whole = plan.structure.textures[i].mips == 1 && plan.extent(i)[2] == 1;
        let clear = !(whole && written.contains(&Node::Texture(i)));
        Some((view, clear, volume.then_some(target.layer)))
    };
    targets_of(&plan.structure.passes[index]).iter().filter_map(view_of).collect()
}
