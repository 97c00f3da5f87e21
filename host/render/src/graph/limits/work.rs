//! How much a graph of a sandboxed unit may have the device do.

use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::graph::plan::{Plan, Planned, targets_of};
use crate::graph::readback::map;
use crate::graph::recorder::Recorder;
use crate::shader_compiler::MAX_OF_INVOCATION;
use std::time::{Duration, Instant};
use surfelshop_api::graph::{Groups, Pass, Work};

/// How long the device may be at work on the passes of a frame.
const DEVICE_TIME: Duration = Duration::from_secs(10);

/// Most bytes of all textures and buffers.
const MAX_BYTES: u64 = 1 << 30;
/// Most passes.
const MAX_PASSES: usize = 256;
/// Units of work, of 2^14 operations each, that all loops of a frame share on the CPU: about 10 s of two cores.
const UNITS_ON_CPU: u32 = 1 << 23;
/// The same on graphics cards, which are a hundred times as fast and more.
const UNITS_ON_CARD: u32 = 1 << 28;
/// Operations of a unit of work.
const OPERATIONS: u64 = 1 << 14;

/// Whether what shaders of strangers do stays within what they are lent, and ends.
///
/// # Errors
/// What the device lacks for that, as a clause. OpenGL's shading language has no check of indices into buffers.
pub(crate) fn confines(gpu: &Gpu) -> Result<(), String> {
    let device = gpu.describe();
    if gpu.info.backend == wgpu::Backend::Gl {
        return Err(format!("{device} does not check the bounds of buffers"));
    }
    match gpu.counts_in_fragments {
        true => Ok(()),
        false => Err(format!("{device} cannot count what shaders of pixels do")),
    }
}

/// Units of work that all loops of a frame share.
pub(crate) fn loop_units(gpu: &Gpu) -> u32 {
    if gpu.is_software() { UNITS_ON_CPU } else { UNITS_ON_CARD }
}

impl Plan {
    /// # Errors
    /// Where a graph of a sandboxed unit has the device do more than such units may, or the device does not confine
    /// what they do.
    pub(in crate::graph) fn check_sandboxed(&self, gpu: &Gpu) -> Result<(), RenderError> {
        let refuse = |what: String| Err(RenderError::Graph(what));
        if let Err(lacks) = confines(gpu) {
            return refuse(format!(
                "it comes from a sandboxed plugin, and {lacks}: use Vulkan, Metal or Direct3D, or a plugin that is a \
                 library"
            ));
        }
        let n_passes = self.structure.passes.len();
        if n_passes > MAX_PASSES {
            return refuse(format!(
                "it has {n_passes} passes; a sandboxed plugin's has at most {MAX_PASSES}"
            ));
        }
        let bytes = self.declared_bytes();
        if bytes > MAX_BYTES {
            return refuse(format!(
                "its textures, buffers and cameras have {bytes} bytes; a sandboxed plugin's have at most {MAX_BYTES}"
            ));
        }
        let most = u64::from(loop_units(gpu)) * OPERATIONS;
        let passes = self.structure.passes.iter().zip(&self.passes);
        let operations = passes.map(|(pass, planned)| self.operations(pass, planned));
        let operations = operations.fold(0, u64::saturating_add);
        if operations > most {
            return refuse(format!(
                "its passes run {operations} operations, loops taken once; those of a sandboxed plugin run at most \
                 {most} on this device: draw smaller pictures, or in fewer invocations"
            ));
        }
        Ok(())
    }

    /// Most operations of a pass, with each loop taken once.
    fn operations(&self, pass: &Pass, planned: &Planned) -> u64 {
        let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        let of_group = planned.workgroup_size.iter().map(|n| u64::from(*n)).product::<u64>();
        let seen = pixels(self.size_of(pass));
        let invocations = match &pass.work {
            Work::Compute { groups: Groups::Fixed(groups), .. } => {
                groups.iter().fold(of_group, |n, side| n.saturating_mul(u64::from(*side)))
            }
            Work::Compute { groups: Groups::Counted { at_most, .. }, .. } => {
                u64::from(*at_most).next_multiple_of(of_group.max(1))
            }
            Work::Compute { groups: Groups::PerPixel { divisor }, .. } => {
                let [x, y, z] = planned.workgroup_size;
                let across = |side: u32, group: u32| {
                    u64::from(side.div_ceil((*divisor).max(1)).div_ceil(group.max(1)))
                        * u64::from(group)
                };
                let [width, height] = self.size_of(pass);
                (across(width, x) * across(height, y)).saturating_mul(u64::from(z))
            }
            Work::Splats(splats) => {
                // Each pixel calls the function once for each splat that it meets, at most for all.
                let of_pixels = splats.per_pixel.as_ref().map_or(0, |_| seen);
                splats.n.saturating_add(of_pixels)
            }
            Work::Shading { .. } => seen,
            Work::Fullscreen { .. } => targets_of(pass)
                .first()
                .map(|target| {
                    let [width, height, _] = self.extent(target.texture.index());
                    pixels([width, height].map(|side| (side >> target.mip).max(1)))
                })
                .unwrap_or(seen),
            // The host's own, as long as their buffers.
            Work::Sort(_) | Work::Scan(_) => 0,
        };
        invocations.saturating_mul(planned.shader.composed.n_operations)
    }
}

/// The device at work on a sandboxed unit's graph.
pub(crate) struct Watched {
    started: Instant,
    /// The pass that was submitted last.
    last: Option<(wgpu::SubmissionIndex, String)>,
    /// Units of work that loops have spent.
    pub(crate) spent: wgpu::Buffer,
    most: u32,
}

impl Watched {
    /// Has the device finish what is recorded, which is the host's own, and begins.
    pub(crate) fn new(recorder: &mut Recorder<'_>) -> Self {
        recorder.finish();
        let gpu = recorder.gpu;
        // wgpu makes buffers of zeros.
        let spent = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("units of work"),
            size: 4,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Self { started: Instant::now(), last: None, spent, most: loop_units(gpu) }
    }

    /// Submits a pass and waits for the one before, so that the device always has something to do.
    ///
    /// # Errors
    /// Where the graph has taken its time.
    pub(crate) fn passed(
        &mut self,
        pass: &str,
        recorder: &mut Recorder<'_>,
    ) -> Result<(), RenderError> {
        let submitted = (recorder.submit_part(), pass.to_owned());
        match self.last.replace(submitted) {
            Some(before) => self.wait(before, recorder.gpu),
            None => Ok(()),
        }
    }

    fn wait(
        &self,
        (submission, pass): (wgpu::SubmissionIndex, String),
        gpu: &Gpu,
    ) -> Result<(), RenderError> {
        let left = DEVICE_TIME.saturating_sub(self.started.elapsed());
        let waited = gpu
            .device
            .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(left) });
        match waited {
            // A lost device is noticed when the frame is submitted.
            Err(wgpu::PollError::Timeout) => Err(RenderError::Overran {
                limit: DEVICE_TIME,
                message: format!(
                    "pass `{pass}`: the device is still at work after {} s, which is what a frame of a sandboxed \
                     plugin may take",
                    DEVICE_TIME.as_secs()
                ),
            }),
            _ => Ok(()),
        }
    }

    /// Waits for the last pass.
    ///
    /// # Errors
    /// Where the graph has taken its time, or its loops were left before they had ended.
    pub(crate) fn end(mut self, recorder: &mut Recorder<'_>) -> Result<(), RenderError> {
        let read = recorder.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("units of work, read back"),
            size: 4,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        recorder.encoder.copy_buffer_to_buffer(&self.spent, 0, &read, 0, 4);
        let submission = recorder.submit_part();
        if let Some((_, pass)) = self.last.take() {
            self.wait((submission, pass), recorder.gpu)?;
        }
        let bytes = map(recorder.gpu, &read).map_err(RenderError::Device)?;
        let spent = bytes.first_chunk().map_or(0, |word| u32::from_le_bytes(*word));
        if spent < self.most {
            return Ok(());
        }
        Err(RenderError::Overran {
            limit: DEVICE_TIME,
            message: format!(
                "its loops were ended after {} operations, or {} of one invocation, the most that those of a sandboxed \
                 plugin's frame may run on this device",
                u64::from(self.most) * OPERATIONS,
                u64::from(MAX_OF_INVOCATION) * OPERATIONS
            ),
        })
    }
}
