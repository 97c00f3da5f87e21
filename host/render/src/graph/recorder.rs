//! Records a frame's passes, submits them and times each.

use crate::gpu::Gpu;
use crate::transfer;
use surfelshop_raster::Rectangle;

/// One pass of a frame, as reported.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassReport {
    /// The pass's name; those of the host start with `surfels:` or `host:`.
    pub name: String,
    /// Whether and why it ran.
    pub state: PassState,
    /// Time on the device in milliseconds, where it ran and the device can tell.
    pub gpu_ms: Option<f64>,
}

/// Whether a pass ran.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PassState {
    /// It ran.
    Ran,
    /// No requested output depends on it.
    Culled,
    /// What it makes is kept from an earlier frame or another view.
    Reused,
}

/// A colour attachment.
pub(crate) struct Attachment<'a> {
    pub(crate) view: &'a wgpu::TextureView,
    pub(crate) clear: bool,
    /// Slice of a volume.
    pub(crate) slice: Option<u32>,
}

impl<'a> Attachment<'a> {
    /// An attachment cleared to zero.
    pub(crate) fn cleared(view: &'a wgpu::TextureView) -> Self {
        Self { view, clear: true, slice: None }
    }
}

/// What a pass is called as a stage of a frame.
fn stage_of(pass: &str) -> String {
    let is_of_host = pass.starts_with("surfels: ") || pass.starts_with("host: ");
    if is_of_host { pass.to_owned() } else { format!("pass {pass}") }
}

/// Passes a frame may time; later ones run untimed.
const MAX_TIMED: u32 = 512;

/// One frame's commands.
pub(crate) struct Recorder<'g> {
    pub(crate) gpu: &'g Gpu,
    pub(crate) encoder: wgpu::CommandEncoder,
    pub(crate) passes: Vec<PassReport>,
    queries: Option<wgpu::QuerySet>,
    /// For each timed pass, its position in `passes`.
    timed: Vec<usize>,
    /// Whether anything was drawn that the device was not made to finish.
    drawn: bool,
    /// Buffers that commands read which are not submitted yet.
    uploads: Vec<wgpu::Buffer>,
    /// Which camera passes are recorded for, where that is not the view's own.
    pub(crate) seen_from: Option<String>,
}

impl<'g> Recorder<'g> {
    pub(crate) fn new(gpu: &'g Gpu) -> Self {
        let queries = gpu.times_passes.then(|| {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_TIMED,
            })
        });
        let encoder = gpu.device.create_command_encoder(&Default::default());
        let (passes, timed) = (Vec::new(), Vec::new());
        let (drawn, uploads) = (false, Vec::new());
        Self { gpu, encoder, passes, queries, timed, drawn, uploads, seen_from: None }
    }

    /// Brings parts of a picture without gaps, so many bytes a pixel, into the first level of a texture.
    pub(crate) fn upload(
        &mut self,
        texture: &wgpu::Texture,
        bytes: &[u8],
        texel: u32,
        parts: &[Rectangle],
    ) {
        let upload = transfer::upload(self.gpu, &mut self.encoder, texture, bytes, texel, parts);
        // Where the device is lost there is none, which submitting reports.
        self.uploads.extend(upload);
        self.end_stage("surfels: upload");
    }

    /// Where stages are told apart, has the device finish what is recorded, which ends one.
    pub(crate) fn end_stage(&mut self, name: &str) {
        if self.gpu.stages.are_told() {
            self.finish();
            self.gpu.stages.end(name);
        }
    }

    /// Notes a pass that does not run.
    pub(crate) fn note(&mut self, name: &str, state: PassState) {
        let name = match &self.seen_from {
            Some(camera) => format!("{name} ({camera})"),
            None => name.to_owned(),
        };
        self.passes.push(PassReport { name, state, gpu_ms: None });
    }

    /// The query indices of the next pass.
    fn time_next(&mut self, name: &str) -> Option<[u32; 2]> {
        self.note(name, PassState::Ran);
        let slot = self.timed.len() as u32;
        if self.queries.is_none() || slot >= MAX_TIMED {
            return None;
        }
        self.timed.push(self.passes.len() - 1);
        Some([2 * slot, 2 * slot + 1])
    }

    /// Records a render pass; `depth` is a view and whether to clear it (it is read-only
    /// otherwise).
    pub(crate) fn render(
        &mut self,
        name: &str,
        colors: &[Attachment<'_>],
        depth: Option<(&wgpu::TextureView, bool)>,
        record: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        self.render_parts(name, colors, depth, [record]);
    }

    /// Records a render pass in parts, and has the device finish one before it gets the next.
    pub(crate) fn render_parts<F: FnOnce(&mut wgpu::RenderPass<'_>)>(
        &mut self,
        name: &str,
        colors: &[Attachment<'_>],
        depth: Option<(&wgpu::TextureView, bool)>,
        parts: impl IntoIterator<Item = F>,
    ) {
        self.drawn = true;
        let times = self.time_next(name);
        let mut parts = parts.into_iter().peekable();
        let mut first = true;
        while let Some(record) = parts.next() {
            if !first {
                self.finish();
            }
            let colors: Vec<_> = colors
                .iter()
                .map(|attachment| {
                    let load = if attachment.clear && first {
                        wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT)
                    } else {
                        wgpu::LoadOp::Load
                    };
                    Some(wgpu::RenderPassColorAttachment {
                        view: attachment.view,
                        depth_slice: attachment.slice,
                        resolve_target: None,
                        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
                    })
                })
                .collect();
            let begin = times.filter(|_| first).map(|[begin, _]| begin);
            let end = times.filter(|_| parts.peek().is_none()).map(|[_, end]| end);
            let timestamp_writes = match &self.queries {
                Some(query_set) if begin.or(end).is_some() => {
                    Some(wgpu::RenderPassTimestampWrites {
                        query_set,
                        beginning_of_pass_write_index: begin,
                        end_of_pass_write_index: end,
                    })
                }
                _ => None,
            };
            let depth_stencil_attachment =
                depth.map(|(view, written)| wgpu::RenderPassDepthStencilAttachment {
                    view,
                    // Reverse-Z: zero is infinitely far.
                    depth_ops: written.then_some(wgpu::Operations {
                        load: if first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load },
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                });
            let mut pass = self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(name),
                color_attachments: &colors,
                depth_stencil_attachment,
                timestamp_writes,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            record(&mut pass);
            first = false;
        }
        self.end_stage(&stage_of(name));
    }

    /// Submits what is recorded and waits for it. A lost device is noticed when the frame is
    /// submitted.
    pub(crate) fn finish(&mut self) {
        self.submit_part();
        drop(self.gpu.device.poll(wgpu::PollType::wait_indefinitely()));
    }

    /// Submits what is recorded.
    pub(crate) fn submit_part(&mut self) -> wgpu::SubmissionIndex {
        let next = self.gpu.device.create_command_encoder(&Default::default());
        let recorded = std::mem::replace(&mut self.encoder, next);
        let submitted = self.gpu.queue.submit([recorded.finish()]);
        self.gpu.transfers.keep(self.uploads.drain(..));
        submitted
    }

    /// Records a compute pass.
    pub(crate) fn compute(&mut self, name: &str, record: impl FnOnce(&mut wgpu::ComputePass<'_>)) {
        // Mesa's software OpenGL begins to compute while textures that it reads are still drawn.
        if self.drawn && self.gpu.computes_early() {
            self.finish();
            self.drawn = false;
        }
        // Drivers in software compute while what is to be drawn before waits, and tell the time when they
        // draw it: such a frame has no times.
        if self.gpu.is_software() {
            self.queries = None;
            self.timed.clear();
        }
        let times = self.time_next(name);
        let timestamp_writes = match (&self.queries, times) {
            (Some(query_set), Some([first, last])) => Some(wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(last),
            }),
            _ => None,
        };
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(name),
            timestamp_writes,
        });
        record(&mut pass);
        drop(pass);
        self.end_stage(&stage_of(name));
    }

    /// Submits everything and waits; returns the passes with their times.
    ///
    /// # Errors
    /// One line where the device reports a mistake, runs out of memory or is lost.
    pub(crate) fn submit(mut self) -> Result<Vec<PassReport>, String> {
        let n = self.timed.len() as u64;
        let bytes = 16 * n;
        let times = self.queries.as_ref().filter(|_| n > 0).map(|queries| {
            let resolved = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("resolved pass times"),
                size: bytes,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let read = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: bytes,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            self.encoder.resolve_query_set(queries, 0..2 * n as u32, &resolved, 0);
            self.encoder.copy_buffer_to_buffer(&resolved, 0, &read, 0, bytes);
            read
        });
        self.gpu.queue.submit([self.encoder.finish()]);
        self.gpu.transfers.keep(self.uploads);
        if let Some(times) = times {
            let ticks = crate::graph::readback::map(self.gpu, &times)?;
            let period_ms = f64::from(self.gpu.queue.get_timestamp_period()) * 1e-6;
            for (slot, &pass) in self.timed.iter().enumerate() {
                let tick = |i: usize| -> u64 {
                    let at = 8 * (2 * slot + i);
                    ticks[at..at + 8].iter().rev().fold(0, |sum, &b| sum << 8 | u64::from(b))
                };
                self.passes[pass].gpu_ms = Some(tick(1).saturating_sub(tick(0)) as f64 * period_ms);
            }
        }
        Ok(self.passes)
    }
}
