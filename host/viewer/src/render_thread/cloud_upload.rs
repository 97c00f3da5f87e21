//! Large clouds are uploaded in the background.
//!
//! A thread sorts a cloud's surfels and uploads them to the device. Until it ends, pictures show a
//! subset of the surfels, enlarged to cover the same area.

use super::abandoned::mark_abandoned;
use super::command::{CommandQueue, RenderCommand, UploadedCloud};
use super::view_request::ViewRequest;
use anyhow::Context as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_api::columns::{RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, Loaded};
use surfelshop_render::{ColumnUploader, Engine, PreparedColumns};
use surfelshop_session::input::clouds::Clouds;

/// Surfels from which a cloud is uploaded in the background: fewer are sorted in a tenth of a second.
pub(super) const LARGE: usize = 1_000_000;

/// About so many surfels stand in for the whole cloud.
const SUBSET: usize = 200_000;

/// A large cloud and its subset.
struct CoarseCloud {
    whole: Cloud,
    subset: Cloud,
}

/// The clouds to be uploaded, one after the other.
#[derive(Default)]
pub(super) struct CloudUpload {
    /// Clouds of the last request that are not on the device yet.
    missing: Vec<CoarseCloud>,
    /// The one being uploaded, by the generations of its columns.
    current: Option<Vec<u64>>,
    /// Stops the current thread.
    stop: Arc<AtomicBool>,
    /// The number of the current thread: commands of an earlier one are ignored.
    serial: u64,
    /// Clouds whose upload failed: the next picture uploads them itself or says why not.
    refused: Vec<Vec<u64>>,
}

/// Identifies a cloud as it is drawn.
fn key(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

impl CloudUpload {
    /// A request for subsets of the large clouds that the engine lacks, and the stride of the largest
    /// subset; `None` where everything can be drawn at once.
    pub(super) fn substitute(
        &mut self,
        request: &ViewRequest,
        engine: &mut Engine,
    ) -> Result<Option<(ViewRequest, u32)>, CloudError> {
        let mut is_missing = |cloud: &Cloud| {
            let refused = || self.refused.contains(&key(cloud));
            cloud.len() >= LARGE && !engine.holds(&[cloud.view()]) && !refused()
        };
        let missing: Vec<Cloud> = (request.clouds.loaded.iter())
            .map(|loaded| &loaded.cloud)
            .filter(|cloud| is_missing(cloud))
            .cloned()
            .collect();
        let missing_now = |key_of: &Vec<u64>| missing.iter().any(|cloud| key(cloud) == *key_of);
        self.missing.retain(|coarse| missing_now(&key(&coarse.whole)));
        if self.current.as_ref().is_some_and(|current| !missing_now(current)) {
            self.cancel();
        }
        if missing.is_empty() {
            return Ok(None);
        }
        let mut stride = 1;
        let mut loaded = request.clouds.loaded.clone();
        for Loaded { cloud, .. } in &mut loaded {
            if !missing_now(&key(cloud)) {
                continue;
            }
            stride = stride.max(stride_of(cloud));
            let known = self.missing.iter().find(|known| key(&known.whole) == key(cloud));
            let subset = match known {
                Some(known) => known.subset.clone(),
                None => {
                    let subset = subset(cloud)?;
                    self.missing.push(CoarseCloud { whole: cloud.clone(), subset: subset.clone() });
                    subset
                }
            };
            *cloud = subset;
        }
        // The facts stay those of the whole clouds.
        let clouds = Arc::new(Clouds {
            loaded,
            facts: request.clouds.facts.clone(),
            pyramids: request.clouds.pyramids.clone(),
            standpoint: request.clouds.standpoint,
        });
        let mut coarse = ViewRequest { clouds, ..request.clone() };
        coarse.detail.stride = 1;
        Ok(Some((coarse, u32::try_from(stride).unwrap_or(u32::MAX))))
    }

    /// Starts the next upload, unless one runs.
    pub(super) fn advance(&mut self, engine: &Engine, queue: &CommandQueue) -> anyhow::Result<()> {
        if self.current.is_some() {
            return Ok(());
        }
        let Some(coarse) = self.missing.first() else { return Ok(()) };
        self.serial += 1;
        self.stop = Arc::default();
        self.current = Some(key(&coarse.whole));
        let work = UploadJob {
            uploader: engine.supplier(),
            cloud: coarse.whole.clone(),
            queue: queue.clone(),
            serial: self.serial,
            stop: self.stop.clone(),
        };
        let started =
            std::thread::Builder::new().name("cloud upload".to_owned()).spawn(|| work.run());
        if let Err(error) = started {
            self.refused.extend(self.current.take());
            return Err(error).context("the surfels cannot be put in order beside the window");
        }
        Ok(())
    }

    /// Whether an upload runs.
    pub(super) fn is_running(&self) -> bool {
        self.current.is_some()
    }

    /// Whether this is the number of the running upload.
    pub(super) fn is_current(&self, serial: u64) -> bool {
        self.is_running() && serial == self.serial
    }

    /// Ends an upload and returns the engine's part; `None` for an earlier thread or a failure.
    pub(super) fn take(&mut self, uploaded: UploadedCloud) -> Option<PreparedColumns> {
        if !self.is_current(uploaded.serial) {
            return None;
        }
        let current = self.current.take()?;
        self.missing.retain(|coarse| key(&coarse.whole) != current);
        match uploaded.prepared {
            Ok(prepared) => Some(prepared),
            Err(reason) => {
                tracing::debug!("a cloud is drawn without having been put in order: {reason}");
                self.refused.push(current);
                None
            }
        }
    }

    /// Stops the running upload.
    pub(super) fn cancel(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.current = None;
    }
}

impl Drop for CloudUpload {
    fn drop(&mut self) {
        if self.is_running() {
            mark_abandoned();
        }
        self.cancel();
    }
}

/// The work of an upload thread.
struct UploadJob {
    uploader: ColumnUploader,
    cloud: Cloud,
    queue: CommandQueue,
    serial: u64,
    stop: Arc<AtomicBool>,
}

impl UploadJob {
    fn run(self) {
        let Self { uploader, cloud, queue, serial, stop } = self;
        let report = |fraction| {
            queue.add(RenderCommand::UploadProgress(serial, fraction));
            !stop.load(Ordering::Relaxed)
        };
        // A thread pool of its own: the shared one also draws pictures and looks up surfels, which would
        // wait for the whole upload.
        let n_threads = rayon::current_num_threads().saturating_sub(1).max(1);
        let prepared = match rayon::ThreadPoolBuilder::new().num_threads(n_threads).build() {
            Ok(pool) => pool.install(|| uploader.supply(&[cloud.view()], &report)),
            Err(_none) => uploader.supply(&[cloud.view()], &report),
        };
        let prepared = prepared.map_err(|error| error.to_string());
        queue.add(RenderCommand::UploadFinished(Box::new(UploadedCloud { serial, prepared })));
    }
}

fn stride_of(cloud: &Cloud) -> usize {
    cloud.len().div_ceil(SUBSET)
}

/// One of every `stride` surfels of a cloud, enlarged to cover the same area.
fn subset(cloud: &Cloud) -> Result<Cloud, CloudError> {
    let stride = stride_of(cloud);
    // The offset varies from run to run: scans have rows, and a fixed stride would keep single columns.
    let chosen = |run: usize| run * stride + (run.wrapping_mul(0x9E37_79B9) >> 7) % stride;
    let mask: Vec<bool> = (0..cloud.len()).map(|i| chosen(i / stride) == i).collect();
    let subset = cloud.keep(&mask)?;
    let factor = (stride as f32).sqrt();
    let larger = [RADIUS, TANGENT_U, TANGENT_V].into_iter().filter_map(|name| {
        let column = subset.column(name)?;
        let Buffer::F32(values) = column.values() else { return None };
        let values = values.iter().map(|value| value * factor).collect();
        Some(Column::new(name, column.components(), Buffer::F32(values)))
    });
    subset.with_columns(larger.collect())
}
