//! Events that the thread sends to the window.

use super::rendered_view::ViewReply;
use super::view_request::ViewSlot;
use std::sync::mpsc::Sender;
use surfelshop_api::params::ParamDecl;
use surfelshop_render::Counters;
use surfelshop_runtime::plugins::Registry;

/// What happened on the thread.
pub(crate) enum RenderEvent {
    /// The device is open.
    DeviceOpened {
        adapter: String,
        /// Whether it computes on the CPU.
        software: bool,
    },
    /// There is no device; the reason in one line.
    NoDevice(String),
    /// The parameters of a renderer.
    Declared { renderer: String, parameters: Vec<ParamDecl> },
    /// A renderer is loaded and its shaders are compiled for the first time.
    Preparing { slot: ViewSlot, renderer: String },
    /// The progress of a large cloud's upload in [0, 1]; none when it is over. Until then pictures
    /// show a part of its surfels.
    UploadProgress(Option<f32>),
    /// A picture, or why there is none.
    Reply(Box<ViewReply>),
    /// The engine's counters.
    Counters(Counters),
    /// The installed plugins, after one changed.
    Plugins(Registry),
    /// A rebuilt renderer is in use, in one line; [`RenderEvent::Declared`] came before.
    Reloaded(String),
    /// All units that failed or are switched off.
    PluginHealth(Vec<UnitHealth>),
    /// A warning in one line.
    Message(String),
}

/// A unit that failed or is switched off.
#[derive(Clone, Debug)]
pub(crate) struct UnitHealth {
    pub(crate) renderer: String,
    /// How, in one line.
    pub(crate) text: String,
    pub(crate) off: bool,
}

/// The thread's end of the event channel.
pub(super) struct EventSender {
    pub(super) send: Sender<RenderEvent>,
    pub(super) wake: Box<dyn Fn() + Send>,
}

impl EventSender {
    pub(super) fn send(&self, event: RenderEvent) {
        // The window may be closed already.
        drop(self.send.send(event));
        (self.wake)();
    }
}
