//! Open clouds as what differs from others, for steps of undo.

use super::open_clouds::{OpenCloud, OpenClouds};
use surfelshop_cloud::{Cloud, CloudDelta};

/// Open clouds that are made again from those of the step beside.
pub(super) struct PackedClouds {
    all: Vec<(OpenCloud, Packed)>,
    removed: OpenClouds,
}

/// A cloud, which the open cloud beside it lacks.
enum Packed {
    Whole(Cloud),
    Delta(CloudDelta),
}

impl PackedClouds {
    /// What of open clouds differs from a base; `None` where that would take no less memory.
    pub(super) fn between(clouds: &OpenClouds, base: &OpenClouds) -> Option<Self> {
        // Placed clouds hold another one besides.
        if clouds.all().iter().any(OpenCloud::is_placed) {
            return None;
        }
        let mut is_less = false;
        let all = clouds.all().iter().enumerate().map(|(i, open_cloud)| {
            let cloud = &open_cloud.loaded.cloud;
            let base = base.all().get(i).map(|base| &base.loaded.cloud);
            let packed = match base.and_then(|base| CloudDelta::between(cloud, base)) {
                Some(delta) => {
                    is_less = true;
                    Packed::Delta(delta)
                }
                None => Packed::Whole(cloud.clone()),
            };
            (open_cloud.holding(Cloud::default()), packed)
        });
        let all: Vec<_> = all.collect();
        is_less.then(|| Self { all, removed: clouds.without_clouds() })
    }

    /// The open clouds again, of the base that they were packed against; `None` where there is no memory.
    pub(super) fn unpacked(&self, base: &OpenClouds) -> Option<OpenClouds> {
        let mut all = Vec::with_capacity(self.all.len());
        for (i, (open_cloud, packed)) in self.all.iter().enumerate() {
            let cloud = match packed {
                Packed::Whole(cloud) => cloud.clone(),
                Packed::Delta(delta) => delta.applied(&base.all().get(i)?.loaded.cloud).ok()?,
            };
            all.push(open_cloud.holding(cloud));
        }
        Some(self.removed.with_all(all, base))
    }

    /// Generation and bytes of the columns that are here whole.
    pub(super) fn columns(&self) -> impl Iterator<Item = (u64, u64)> {
        self.all.iter().flat_map(|(_, packed)| -> Vec<(u64, u64)> {
            match packed {
                Packed::Delta(delta) => delta.columns().collect(),
                Packed::Whole(cloud) => columns_of(cloud).collect(),
            }
        })
    }

    /// Bytes of what differs.
    pub(super) fn patch_bytes(&self) -> u64 {
        let parts = self.all.iter().map(|(_, packed)| match packed {
            Packed::Delta(delta) => delta.patch_bytes(),
            Packed::Whole(_) => 0,
        });
        parts.sum()
    }
}

/// The generation and bytes of every column.
pub(super) fn columns_of(cloud: &Cloud) -> impl Iterator<Item = (u64, u64)> {
    cloud.columns().iter().map(|column| {
        let bytes = column.values().len() * column.values().element().size();
        (column.generation(), bytes as u64)
    })
}
