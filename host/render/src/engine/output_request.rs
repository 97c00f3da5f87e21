//! What is asked of a frame: which textures of its graph, and what of the host's surface.

use crate::graph::{
    LivePasses, Node, PassCamera, Plan, RenderError, SurfaceNeeds, needed, touched,
};
use crate::surfels::{ColumnDemand, SurfaceParts};
use surfelshop_api::graph::{Output, SurfaceMode};

/// What is asked of a graph, and besides of the host, by entry points of its shader; and what that takes.
pub(super) struct OutputRequest {
    pub(super) sources: Vec<Source>,
    pub(super) graph_outputs: Vec<usize>,
    pub(super) needed: LivePasses,
    pub(super) host_mode: SurfaceMode,
}

impl OutputRequest {
    /// # Errors
    /// Where neither the graph nor the host offers a requested output.
    pub(super) fn new(
        plan: &Plan,
        outputs: &[Output],
        besides: &[&'static str],
    ) -> Result<Self, RenderError> {
        let mut sources = sources(plan, outputs)?;
        sources.extend(besides.iter().map(|entry| Source::Surface(entry)));
        let of_graph = |source: &Source| match source {
            Source::Graph(texture) => Some(*texture),
            Source::Surface(_) => None,
        };
        let graph_outputs: Vec<usize> = sources.iter().filter_map(of_graph).collect();
        let needed = needed(plan, &graph_outputs);
        // What the host shows is seen from the view's own camera.
        let mut own = plan.passes.iter().filter(|pass| pass.seat == PassCamera::View);
        let host_mode = own.find_map(|pass| pass.surface).unwrap_or_default();
        Ok(Self { sources, graph_outputs, needed, host_mode })
    }

    /// Whether passes that run touch a resource.
    pub(super) fn touches(&self, plan: &Plan, node: Node) -> bool {
        touched(plan, &self.needed, &self.graph_outputs).contains(&node)
    }

    /// Columns that are read, of those that drawing can do without.
    pub(super) fn wanted(&self) -> ColumnDemand {
        let shown = |entry: &str| {
            self.sources.iter().any(|s| matches!(s, Source::Surface(shown) if *shown == entry))
        };
        ColumnDemand {
            color: self.needed.members.albedo || shown("albedo_only"),
            ao: self.needed.members.ao || shown("ao_only"),
            material: self.needed.looks.values().any(|look| look.material),
            fields: (self.needed.looks.values())
                .any(|look| look.surfaces.contains(&SurfaceMode::Fields))
                || self.host_mode == SurfaceMode::Fields && shown("normal_only"),
        }
    }
}

/// Where a requested output comes from.
pub(super) enum Source {
    /// A texture of the graph.
    Graph(usize),
    /// The host's surface buffer, through an entry point of the resolve shader.
    Surface(&'static str),
}

/// The entry point that shows distances.
pub(super) const DEPTH_ONLY: &str = "depth_only";

/// The entry point that shows distances and clouds of the nearest surfels.
pub(super) const OWNER_ONLY: &str = "owner_only";

/// Where each requested output comes from.
fn sources(plan: &Plan, outputs: &[Output]) -> Result<Vec<Source>, RenderError> {
    let offered = &plan.structure.outputs;
    let source = |wanted: &Output| {
        if let Some((_, texture)) = offered.iter().find(|(output, _)| output == wanted) {
            return Ok(Source::Graph(texture.index()));
        }
        match wanted {
            Output::Depth => Ok(Source::Surface(DEPTH_ONLY)),
            Output::Normal => Ok(Source::Surface("normal_only")),
            Output::Albedo => Ok(Source::Surface("albedo_only")),
            Output::Ao => Ok(Source::Surface("ao_only")),
            Output::Color | Output::Debug(_) => {
                let own = offered.iter().map(|(output, _)| output.name());
                let host = ["depth", "normal", "albedo", "ao"].map(str::to_owned);
                let mut names: Vec<_> = own.chain(host).collect();
                names.dedup();
                Err(RenderError::NoOutput { wanted: wanted.name(), offered: names.join(", ") })
            }
        }
    };
    outputs.iter().map(source).collect()
}

/// The parts of the surface that needed passes and requested outputs read.
pub(super) fn parts(
    look: &SurfaceNeeds,
    sources: &[Source],
    host_mode: SurfaceMode,
) -> SurfaceParts {
    let mut parts = SurfaceParts::default();
    for &mode in &look.surfaces {
        parts.add(mode);
    }
    parts.visibility |= look.surfels;
    if look.material {
        parts.visibility = true;
        parts.material = true;
    }
    if look.object {
        parts.visibility = true;
        parts.object = true;
    }
    for source in sources {
        match source {
            Source::Surface(DEPTH_ONLY) => {
                parts.visibility = true;
                parts.distances = true;
            }
            Source::Surface(OWNER_ONLY) => {
                parts.visibility = true;
                parts.winners = true;
                parts.object = true;
            }
            Source::Surface(_) => parts.add(host_mode),
            Source::Graph(_) => {}
        }
    }
    parts
}
