//! A renderer in a view, and those that draw clouds of the same picture beside it.

use crate::graph::Plan;
use surfelshop_api::Need;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::params::Values;
use surfelshop_runtime::plugins::Hosted;

/// A renderer in a view: its instance, on a thread of its own, and the plan of its last structure.
pub struct RendererView {
    pub(super) hosted: Hosted,
    pub(super) scope: String,
    /// Whether its graphs run within what sandboxed plugins may take of a device.
    pub(super) is_confined: bool,
    /// The columns that it reads of clouds.
    pub(super) needs: Vec<Need>,
    /// What it described last.
    pub(super) graph: EncodedGraph,
    pub(super) plan: Option<Plan>,
    /// The engine that made the plan, whose device its pipelines belong to.
    pub(super) planned_by: u64,
    /// Tells this view from all others.
    pub(super) serial: u64,
    /// Whether each graph has the bytes that stay on the device.
    pub(super) sends_all: bool,
    /// What it is called where several draw a picture.
    pub(super) name: String,
    /// Renderers that draw other clouds of the picture.
    pub(super) others: Vec<Companion>,
    /// What the renderer is called that the last frame failed by, where several draw it.
    pub(super) at_fault: Option<String>,
    /// Whether the plan has its splats hidden by surfels, whatever the graph says.
    pub(super) hidden: bool,
    /// Whether it was seen to draw clouds itself.
    pub(super) takes: bool,
}

impl RendererView {
    /// Puts an instance of a renderer into a view; `scope` keeps the persistent resources of
    /// different renderers apart and is usually
    /// [`LoadedUnit::scope`](surfelshop_runtime::plugins::LoadedUnit::scope).
    #[must_use]
    pub fn new(hosted: Hosted, scope: impl Into<String>) -> Self {
        Self {
            is_confined: hosted.is_sandboxed(),
            hosted,
            scope: scope.into(),
            needs: Vec::new(),
            graph: EncodedGraph::default(),
            plan: None,
            planned_by: 0,
            serial: next_serial(),
            sends_all: false,
            name: String::new(),
            others: Vec::new(),
            at_fault: None,
            hidden: false,
            takes: false,
        }
    }

    /// Has other renderers draw some clouds of the pictures from now on, instead of those that did before. This one
    /// draws the rest, and is called `name` beside them.
    pub fn share(&mut self, name: impl Into<String>, others: Vec<Companion>) -> Vec<Companion> {
        (self.name, self.at_fault) = (name.into(), None);
        std::mem::replace(&mut self.others, others)
    }

    /// The renderers that draw other clouds of the picture.
    #[must_use]
    pub fn others(&self) -> &[Companion] {
        &self.others
    }

    /// What the renderer is called that the last frame failed by, where several draw it.
    #[must_use]
    pub fn at_fault(&self) -> Option<&str> {
        self.at_fault.as_deref()
    }

    /// The same of a renderer that reads these columns: frames of clouds that lack them are refused by name.
    #[must_use]
    pub fn needing(mut self, needs: &[Need]) -> Self {
        self.needs = needs.to_vec();
        self
    }

    /// Has the bytes of [resident](surfelshop_api::Graph::resident) buffers sent in every frame, so that the graph
    /// holds all that it needs.
    pub fn send_all(&mut self) {
        self.sends_all = true;
    }

    /// Has graphs run within what sandboxed plugins may take of a device from the next structure on, whoever
    /// describes them: those of a sandboxed plugin do from the first.
    pub fn confine(&mut self) {
        self.is_confined = true;
        self.plan = None;
    }

    /// The graph of the last frame.
    #[must_use]
    pub fn graph(&self) -> &EncodedGraph {
        &self.graph
    }
}

/// A renderer that draws some clouds of a picture, where the view's own draws the others.
pub struct Companion {
    /// What it is called in passes and explanations: no two of a picture are called alike.
    pub name: String,
    /// Its instance.
    pub view: RendererView,
    /// Its parameters.
    pub values: Values,
    /// Numbers of its clouds, in [`CloudFacts::clouds`](surfelshop_api::CloudFacts::clouds).
    pub clouds: Vec<u32>,
}

/// Tells engines apart, and what was planned by one before it was to keep something else.
pub(super) fn next_serial() -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}
