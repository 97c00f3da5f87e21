//! Graphs in files: kept by `--save-graph`, and drawn by `--graph` without the plugin that described them.

use crate::output::files;
use crate::session::LoadedRenderer;
use anyhow::anyhow;
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::manifest::Refusal;
use surfelshop_api::params::Values;
use surfelshop_render::RendererView;
use surfelshop_runtime::boundary::{MAX_OUTPUT_BYTES, MAX_STRUCTURE_BYTES};
use surfelshop_runtime::plugins::{Hosted, LoadedUnit, UnitRef};

/// More than any graph that is taken from a plugin.
const LARGEST_FILE: u64 = (MAX_OUTPUT_BYTES + MAX_STRUCTURE_BYTES + 1024) as u64;

/// Writes the graph of a frame.
pub fn save(path: &Path, graph: &EncodedGraph) -> anyhow::Result<()> {
    files::write_whole(path, &graph.to_file())
}

/// A renderer whose every frame is the graph in this file.
pub fn renderer(path: &Path) -> anyhow::Result<LoadedRenderer> {
    let name = path.display();
    let bytes = files::read_short(path, LARGEST_FILE)?;
    files::protect([path]);
    let graph = EncodedGraph::from_file(&bytes).map_err(|refusal| match refusal {
        Refusal::Malformed(what) => {
            anyhow!("{name}: expected a graph as --save-graph writes it: {what}")
        }
        Refusal::Incompatible { .. } => anyhow!("{name}: {refusal}"),
    })?;
    let hosted = Hosted::replaying(graph).map_err(|fault| anyhow!("{name}: {fault}"))?;
    let id = path.file_stem().unwrap_or_default().to_string_lossy();
    let reference = UnitRef::named(UnitKind::Renderer, "graph", &id, path);
    let view = RendererView::new(hosted, reference.to_string());
    let (unit, values, beside) = (LoadedUnit::of_graph(&id), Values::new(), Vec::new());
    Ok(LoadedRenderer { unit, reference, values, view, beside })
}
