//! Resources that no frame uses, for those to come.

use crate::gpu::Gpu;
use crate::graph::resources::{GpuResource, Shape, Use, make};
use std::collections::HashMap;
use std::sync::Arc;
use surfelshop_raster::Coverage;

/// A resource that no frame uses.
pub(super) struct Free {
    pub(super) made: GpuResource,
    pub(super) last_used: Use,
    /// Where a texture holds something but zeros, where that is known.
    pub(super) held: Option<Arc<Coverage>>,
}

/// Such resources by their shapes.
#[derive(Default)]
pub(super) struct FreeResources(HashMap<Shape, Vec<Free>>);

impl FreeResources {
    /// One of a shape, and where it holds something but zeros, where that is known.
    pub(super) fn take(
        &mut self,
        gpu: &Gpu,
        shape: &Shape,
        label: &str,
    ) -> (GpuResource, Option<Arc<Coverage>>) {
        match self.0.get_mut(shape).and_then(Vec::pop) {
            Some(Free { made, held, .. }) => (made, held),
            None => (make(gpu, shape, label), None),
        }
    }

    /// Takes one over.
    pub(super) fn add(&mut self, shape: Shape, free: Free) {
        self.0.entry(shape).or_default().push(free);
    }

    /// Lets go of those whose last use says so.
    pub(super) fn keep(&mut self, is_kept: &dyn Fn(&Use) -> bool) {
        self.0.retain(|_, list| {
            list.retain(|free| is_kept(&free.last_used));
            !list.is_empty()
        });
    }

    /// Bytes of all of them, without what the driver adds.
    pub(super) fn bytes(&self) -> u64 {
        self.0.values().flatten().map(|free| free.made.bytes()).sum()
    }
}
