//! Compiling beside drawing: a pipeline that another can stand in for is made on a thread of its own.

use crate::graph::pipeline_desc::{Pipeline, Recipe};
use crate::graph::variants::Settings;
use crate::shader_compiler::STACK_BYTES;
use std::thread::JoinHandle;

/// Most pipelines made at a time; others wait for their next frame.
const AT_A_TIME: usize = 2;

struct Job<K> {
    of: K,
    settings: Settings,
    thread: JoinHandle<Result<Pipeline, String>>,
}

/// Pipelines of entry points `K` that are being made.
pub(super) struct Beside<K> {
    device: wgpu::Device,
    jobs: Vec<Job<K>>,
    /// Those that could not be made: to be made again where the error is waited for.
    failed: Vec<(K, Settings)>,
}

impl<K: Clone + PartialEq> Beside<K> {
    pub(super) fn new(device: wgpu::Device) -> Self {
        Self { device, jobs: Vec::new(), failed: Vec::new() }
    }

    /// Has a pipeline made, unless it is being made or would have to wait. Says whether it may come.
    pub(super) fn make(
        &mut self,
        of: &K,
        settings: &Settings,
        recipe: impl FnOnce() -> Recipe,
    ) -> bool {
        if self.failed.iter().any(|(key, values)| key == of && values == settings) {
            return false;
        }
        let is_made = |job: &Job<K>| job.of == *of && job.settings == *settings;
        if self.jobs.iter().any(is_made) || self.jobs.len() >= AT_A_TIME {
            return true;
        }
        let (device, recipe) = (self.device.clone(), recipe());
        let started = std::thread::Builder::new()
            .name("shader compiler".to_owned())
            .stack_size(STACK_BYTES)
            .spawn(move || recipe.make(&device));
        match started {
            Ok(thread) => {
                self.jobs.push(Job { of: of.clone(), settings: settings.clone(), thread });
                true
            }
            Err(_) => false,
        }
    }

    /// One that is being made, once it is there; nothing where it is not being made, or could not be.
    pub(super) fn wait_for(&mut self, of: &K, settings: &Settings) -> Option<Pipeline> {
        let at = self.jobs.iter().position(|job| job.of == *of && job.settings == *settings)?;
        self.jobs.swap_remove(at).thread.join().ok()?.ok()
    }

    /// Those that have come since.
    pub(super) fn made(&mut self) -> Vec<(K, Settings, Pipeline)> {
        let mut made = Vec::new();
        for job in self.jobs.extract_if(.., |job| job.thread.is_finished()) {
            match job.thread.join() {
                Ok(Ok(pipeline)) => made.push((job.of, job.settings, pipeline)),
                Ok(Err(_)) | Err(_) => self.failed.push((job.of, job.settings)),
            }
        }
        made
    }
}

impl<K> Drop for Beside<K> {
    /// A driver must not be unloaded while it compiles.
    fn drop(&mut self) {
        for job in self.jobs.drain(..) {
            // Nobody waits for what it made.
            drop(job.thread.join());
        }
    }
}
