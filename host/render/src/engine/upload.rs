//! Columns for an engine, made on other threads: putting the surfels of large clouds in order takes
//! seconds, in which the engine can draw something else.

use crate::engine::Engine;
use crate::graph::{RenderError, checked};
use crate::surfels::Columns;
use surfelshop_api::columns::CloudView;

/// Makes what an engine draws clouds from.
pub struct ColumnUploader {
    engine: u64,
    columns: Columns,
    device: wgpu::Device,
    on_host: bool,
}

/// What an engine draws clouds from.
pub struct PreparedColumns {
    engine: u64,
    columns: Columns,
}

impl Engine {
    /// Whether clouds can be drawn without finding the order of their surfels first: parts that merged ones stand for are put
    /// in order when they are drawn.
    pub fn holds(&mut self, clouds: &[CloudView<'_>]) -> bool {
        let on_host = self.surfels.on_host(&self.gpu);
        clouds.iter().all(|cloud| self.columns.holds(cloud, on_host))
    }

    /// What makes columns for this engine.
    #[must_use]
    pub fn supplier(&self) -> ColumnUploader {
        ColumnUploader {
            engine: self.serial,
            columns: self.columns.another(),
            device: self.gpu.device.clone(),
            on_host: self.surfels.on_host(&self.gpu),
        }
    }

    /// Makes what frames of a larger [`stride`](crate::RenderRequest::stride) are drawn from, so that the first one does
    /// not wait for it: where the CPU draws, surfels that stand for several. Nothing where it is there.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type, or the device fails.
    pub fn prepare_strides(&mut self, clouds: &[CloudView<'_>]) -> Result<(), RenderError> {
        if !self.surfels.on_host(&self.gpu) {
            return Ok(());
        }
        let columns = &mut self.columns;
        let mut make = || {
            clouds.iter().try_for_each(|cloud| columns.on_host(cloud, true, &|_| true).map(drop))
        };
        checked(&self.gpu.device, &mut make).map_err(RenderError::Device)?
    }

    /// Takes what was made for this engine; what was made for another one is dropped.
    pub fn take(&mut self, supply: PreparedColumns) {
        if supply.engine == self.serial {
            self.columns.absorb(supply.columns);
        }
    }
}

impl ColumnUploader {
    /// Makes the columns of clouds; `tell` hears how far that is, in [0, 1], and says whether to go on.
    /// Where the CPU draws, merged surfels are among them, which it takes while something moves.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type, the device fails, or it was not to
    /// go on.
    pub fn supply(
        mut self,
        clouds: &[CloudView<'_>],
        tell: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<PreparedColumns, RenderError> {
        let n: usize = clouds.iter().map(|cloud| cloud.len).sum();
        let device = self.device.clone();
        let mut before = 0;
        for cloud in clouds {
            let share = |n_surfels: usize| n_surfels as f32 / n.max(1) as f32;
            let told = |fraction: f32| tell(share(before) + share(cloud.len) * fraction);
            let make = || match self.on_host {
                true => self.columns.on_host(cloud, true, &told),
                false => self.columns.cloud(cloud, false, &told),
            };
            checked(&device, make).map_err(RenderError::Device)??;
            before += cloud.len;
        }
        Ok(PreparedColumns { engine: self.engine, columns: self.columns })
    }
}
