//! Graphs as plugins write them, decoded and held to limits that no honest one comes near.

use crate::boundary::{Fault, MAX_STRUCTURE_BYTES};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::graph::Structure;
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};

/// Most passes of a graph, and most modules that one brings along.
const MAX_PASSES: usize = 1024;
/// Most messages within each other. A graph's deepest are passes instead of others, of which there are few.
const MAX_DEPTH: usize = 128;
/// Most textures, buffers, uniforms and outputs of a graph, each.
const MAX_RESOURCES: usize = 4096;

/// Decodes a graph's structure. Fields that this host does not know are left out; a kind of work, a
/// format or another choice that it does not know is refused by its name.
///
/// # Errors
/// Where the bytes are no structure, or there is too much of something.
pub fn decode(graph: &EncodedGraph) -> Result<Structure, Fault> {
    let misbehaved = |line: String| Err(Fault::Misbehaved(line));
    if graph.structure.len() > MAX_STRUCTURE_BYTES {
        let found = graph.structure.len();
        return misbehaved(format!(
            "its graph has {found} bytes of structure, at most {MAX_STRUCTURE_BYTES} are taken"
        ));
    }
    if graph.structure.is_empty() {
        return misbehaved("it wrote no graph".to_owned());
    }
    let mut decoder = rmp_serde::Deserializer::from_read_ref(&graph.structure);
    decoder.set_max_depth(MAX_DEPTH);
    let structure: Structure = match serde::Deserialize::deserialize(&mut decoder) {
        Ok(structure) => structure,
        Err(error) => {
            let line = error.to_string();
            let newer = match line.contains("unknown variant") {
                true => {
                    format!(" (this host speaks ABI {ABI_MAJOR}.{ABI_MINOR}; update Surfelshop)")
                }
                false => String::new(),
            };
            return misbehaved(format!("its graph is unreadable: {line}{newer}"));
        }
    };
    let members = structure.members.values().map(Vec::len).max().unwrap_or(0);
    let modules = structure.passes.iter().map(|pass| pass.modules.len()).max().unwrap_or(0);
    for (what, found, most) in [
        ("passes", structure.passes.len(), MAX_PASSES),
        ("modules of a pass", modules, MAX_PASSES),
        ("members of a uniform", members, MAX_PASSES),
        ("textures", structure.textures.len(), MAX_RESOURCES),
        ("buffers", structure.buffers.len(), MAX_RESOURCES),
        ("uniforms", structure.uniforms.len(), MAX_RESOURCES),
        ("outputs", structure.outputs.len(), MAX_RESOURCES),
    ] {
        if found > most {
            return misbehaved(format!("its graph has {found} {what}, at most {most} are taken"));
        }
    }
    Ok(structure)
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::graph::{Graph, Groups, Pass};

    fn encoded(graph: &Graph) -> EncodedGraph {
        EncodedGraph {
            structure: rmp_serde::to_vec_named(graph.structure()).unwrap(),
            data: graph.data().to_vec(),
        }
    }

    fn refusal(graph: &EncodedGraph) -> String {
        decode(graph).unwrap_err().to_string()
    }

    /// Invariant: what a host does not know is refused by its name
    #[test]
    fn a_choice_of_a_newer_host_is_refused_by_its_name() {
        let mut graph = Graph::new();
        graph.pass(Pass::compute("sort", "", "sort", Groups::Fixed([1; 3])));
        let known = encoded(&graph);
        assert_eq!(&decode(&known).unwrap(), graph.structure());
        let at = known.structure.windows(7).position(|window| window == b"Compute").unwrap();
        let mut newer = known;
        newer.structure[at..at + 7].copy_from_slice(b"RayTest");
        let line = refusal(&newer);
        assert!(line.contains("`RayTest`") && line.contains("update Surfelshop"), "{line}");
    }

    #[test]
    fn passes_instead_of_passes_go_so_deep() {
        let deep = |n: usize| {
            let pass = || Pass::compute("a", "", "b", Groups::Fixed([1; 3]));
            let within = |within: Pass, _| Pass { instead: Some(Box::new(within)), ..pass() };
            let mut graph = Graph::new();
            graph.pass((0..n).fold(pass(), within));
            encoded(&graph)
        };
        assert!(decode(&deep(16)).is_ok());
        let line = refusal(&deep(200));
        assert!(line.contains("its graph is unreadable") && line.contains("depth"), "{line}");
    }

    #[test]
    fn graphs_beyond_all_measure_are_refused() {
        let mut graph = Graph::new();
        for _ in 0..=MAX_PASSES {
            graph.pass(Pass::compute("a", "", "b", Groups::Fixed([1; 3])));
        }
        let line = refusal(&encoded(&graph));
        assert!(line.contains("1025 passes, at most 1024"), "{line}");
        let structure = vec![0xc0; MAX_STRUCTURE_BYTES + 1];
        let line = refusal(&EncodedGraph { structure, data: Vec::new() });
        assert!(line.contains("16777217 bytes of structure"), "{line}");
        // An announced length takes no memory before the bytes are there.
        let structure = vec![
            0x81, 0xa8, b't', b'e', b'x', b't', b'u', b'r', b'e', b's', 0xdd, 255, 255, 255, 255,
        ];
        assert!(refusal(&EncodedGraph { structure, data: Vec::new() }).contains("unreadable"));
    }
}
