//! Large clouds on their way to where they are drawn: their surfels are put in order on a thread of their
//! own, and until that is done a few of them stand for all.

use super::darkroom::{Order, Queue, Task};
use crate::clouds::Clouds;
use anyhow::Context as _;
use std::sync::Arc;
use surfelshop_cloud::{CloudError, Loaded};
use surfelshop_engine::{Engine, Supply};

/// Clouds of fewer surfels are in order in a tenth of a second.
const LARGE: u64 = 1_000_000;

/// About so many surfels stand for all.
const FEW: u64 = 200_000;

/// Clouds whose surfels are being put in order.
pub(super) struct Arriving {
    clouds: Arc<Clouds>,
    /// One surfel of so many, evenly by their place in the file.
    stride: u32,
    few: Arc<Clouds>,
}

/// What came of it.
pub(crate) struct Arrived {
    clouds: Arc<Clouds>,
    pub(super) supply: Result<Supply, String>,
}

impl Arrived {
    /// Whether it is of these clouds.
    pub(super) fn is_of(&self, clouds: &Arc<Clouds>) -> bool {
        Arc::ptr_eq(&self.clouds, clouds)
    }
}

impl Arriving {
    /// Starts where these clouds are large and the engine does not have them; `None` where they can be
    /// drawn at once.
    pub(super) fn start(
        clouds: &Arc<Clouds>,
        engine: &Engine,
        queue: &Queue,
    ) -> anyhow::Result<Option<Self>> {
        let n_surfels = clouds.facts.n_surfels;
        if n_surfels < LARGE || engine.holds(&clouds.views()) {
            return Ok(None);
        }
        let stride = n_surfels.div_ceil(FEW);
        let few = Arc::new(few(clouds, stride as usize)?);
        let (supplier, queue, all) = (engine.supplier(), queue.clone(), clouds.clone());
        let work = move || {
            let tell = |fraction| queue.add(Task::Arriving(fraction));
            let supply = supplier.supply(&all.views(), &tell).map_err(|error| error.to_string());
            queue.add(Task::Arrived(Box::new(Arrived { clouds: all, supply })));
        };
        std::thread::Builder::new()
            .name("arriving".to_owned())
            .spawn(work)
            .context("the surfels cannot be put in order beside the window")?;
        let stride = u32::try_from(stride).unwrap_or(u32::MAX);
        Ok(Some(Self { clouds: clouds.clone(), stride, few }))
    }

    /// The clouds that are on their way.
    pub(super) fn clouds(&self) -> &Arc<Clouds> {
        &self.clouds
    }

    /// An order for a few surfels, which cover as much as all.
    pub(super) fn order(&self, order: &Order) -> Order {
        let mut few = Order { clouds: self.few.clone(), ..order.clone() };
        few.scene.surface.radius_scale *= (self.stride as f32).sqrt();
        few.detail.stride = 1;
        few
    }

    /// One surfel of so many is drawn.
    pub(super) fn stride(&self) -> u32 {
        self.stride
    }
}

/// One surfel of so many of each cloud; what is known of all stays what it is of the whole.
fn few(clouds: &Clouds, stride: usize) -> Result<Clouds, CloudError> {
    let each = clouds.loaded.iter().map(|Loaded { cloud, summary }| {
        let mask: Vec<bool> = (0..cloud.len()).map(|i| i % stride == 0).collect();
        Ok(Loaded { cloud: cloud.keep(&mask)?, summary: summary.clone() })
    });
    let loaded = each.collect::<Result<Vec<_>, CloudError>>()?;
    Ok(Clouds { loaded, facts: clouds.facts.clone() })
}
