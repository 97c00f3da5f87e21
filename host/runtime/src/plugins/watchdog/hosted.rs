//! Renderers on threads of their own.
//!
//! Lifecycle: the thread makes the instance, describes frames one at a time, and ends the instance
//! when the host lets go of it. The host waits for an answer as long as its [`Timeouts`] lasts and
//! never for the end.
//!
//! Invariants: neither a call nor dropping ever waits longer than stated; after one missed
//! deadline the plugin is not asked again, so a late answer can never be taken for another one's.

use super::timeouts::{Timeouts, missing, on_own_thread};
use crate::boundary::{Fault, Plugin};
use crate::plugins::load::LoadedUnit;
use std::fmt;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::frame::OnDevice;
use surfelshop_api::{FrameRequest, HostInfo};
use surfelshop_cloud::files::return_to_folder;

/// A request for a frame: with of how many surfels one is drawn, and what is on the device.
type FrameMessage = (FrameRequest, u32, OnDevice);

/// An instance of a renderer that runs on a thread of its own.
pub struct Hosted {
    /// With of how many surfels one is drawn, and what is on the device.
    requests: Sender<FrameMessage>,
    answers: Receiver<Result<EncodedGraph, Fault>>,
    limit: Duration,
    is_sandboxed: bool,
    /// Why it is not asked any more.
    given_up: Option<Fault>,
}

impl fmt::Debug for Hosted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Hosted").field("given_up", &self.given_up).finish_non_exhaustive()
    }
}

impl Hosted {
    /// Makes an instance of a unit, by its position in its package, on a thread of its own.
    ///
    /// # Errors
    /// Where the plugin fails or does not answer in time.
    pub fn start(
        plugin: Plugin,
        unit_index: u32,
        host: &HostInfo,
        patience: &Timeouts,
    ) -> Result<Self, Fault> {
        let (requests, asked) = mpsc::channel::<FrameMessage>();
        let (answer, answers) = mpsc::channel();
        let (start, started) = mpsc::channel();
        let is_sandboxed = plugin.is_sandboxed();
        let host = host.clone();
        on_own_thread(move || {
            let created = plugin.create(unit_index, &host);
            return_to_folder();
            match created {
                Err(fault) => drop(start.send(Err(fault))),
                Ok(mut instance) => {
                    drop(start.send(Ok(())));
                    for (request, stride, on_device) in asked {
                        let described = instance.frame_on_device(&request, stride, &on_device);
                        return_to_folder();
                        // Nobody receives where the host stopped waiting; then it asks no more, too.
                        drop(answer.send(described));
                    }
                }
            }
        })?;
        started
            .recv_timeout(patience.create)
            .unwrap_or_else(|error| Err(missing(error, patience.create)))?;
        Ok(Self { requests, answers, limit: patience.frame, is_sandboxed, given_up: None })
    }

    /// Stands in for a renderer whose graph was captured: every frame is that graph.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn replaying(graph: EncodedGraph) -> Result<Self, Fault> {
        let (requests, asked) = mpsc::channel::<FrameMessage>();
        let (answer, answers) = mpsc::channel();
        on_own_thread(move || {
            for _request in asked {
                drop(answer.send(Ok(graph.clone())));
            }
        })?;
        let limit = Timeouts::default().frame;
        Ok(Self { requests, answers, limit, is_sandboxed: false, given_up: None })
    }

    /// Has the renderer describe a frame.
    ///
    /// # Errors
    /// As [`frame_on_device`](Self::frame_on_device).
    pub fn frame(&mut self, request: FrameRequest) -> Result<EncodedGraph, Fault> {
        self.frame_on_device(request, 1, OnDevice::default())
    }

    /// Has the renderer describe a frame in which one surfel of `stride` is drawn, 0 taken as 1, where bytes of
    /// [resident](surfelshop_api::Graph::resident) buffers are on the device already.
    ///
    /// # Errors
    /// Where the plugin fails or does not answer in time, and at once ever after the latter.
    pub fn frame_on_device(
        &mut self,
        request: FrameRequest,
        stride: u32,
        on_device: OnDevice,
    ) -> Result<EncodedGraph, Fault> {
        if let Some(fault) = &self.given_up {
            return Err(Fault::NotAsked(format!("it {fault}")));
        }
        // Where the thread has ended, there is no answer either.
        drop(self.requests.send((request, stride, on_device)));
        self.answers.recv_timeout(self.limit).unwrap_or_else(|error| {
            let fault = missing(error, self.limit);
            self.given_up = Some(fault.clone());
            Err(fault)
        })
    }

    /// Whether the renderer runs in a sandbox, and its graphs within what such plugins may take of a device.
    #[must_use]
    pub fn is_sandboxed(&self) -> bool {
        self.is_sandboxed
    }

    /// Why the renderer is not asked any more, where it missed a deadline.
    #[must_use]
    pub fn given_up(&self) -> Option<&Fault> {
        self.given_up.as_ref()
    }
}

impl LoadedUnit {
    /// Makes an instance on a thread of its own.
    ///
    /// # Errors
    /// Where the plugin fails or does not answer in time.
    pub fn start(&self, host: &HostInfo, patience: &Timeouts) -> Result<Hosted, Fault> {
        Hosted::start(self.plugin, self.unit_index, host, patience)
    }
}
