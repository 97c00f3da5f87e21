//! What the window knows of its render thread.

use crate::render_thread::RenderThread;
use std::time::Instant;
use surfelshop_render::Counters;

/// The render thread and its last reports.
pub(crate) struct Render {
    pub(crate) thread: RenderThread,
    /// The progress of a large cloud's upload in [0, 1].
    pub(crate) upload_progress: Option<f32>,
    pub(crate) adapter: String,
    /// Whether there is no device; the reason was a message.
    pub(crate) no_device: bool,
    /// Whether the window draws on the CPU.
    pub(crate) software: bool,
    pub(crate) counters: Counters,
    /// The number of the last request.
    pub(crate) serial: u64,
    /// When the window's last frame began.
    pub(crate) last_frame: Instant,
}

impl Render {
    pub(crate) fn new(thread: RenderThread) -> Self {
        Self {
            thread,
            upload_progress: None,
            adapter: String::new(),
            no_device: false,
            software: false,
            counters: Counters::default(),
            serial: 0,
            last_frame: Instant::now(),
        }
    }
}
