//! What a graph's passes, resources and outputs were for in a frame.

use super::{OutputUse, PassUse};
use crate::graph::{LivePasses, Node, PassReport, PassState, Plan, needed, texels, touched};
use crate::resource_use::ResourceUse;
use surfelshop_api::graph::{Lifetime, Output, Work};

/// A checked graph and what was asked of it.
pub(super) struct Graph<'a> {
    plan: &'a Plan,
    wanted: &'a [Output],
    needed: LivePasses,
    requested: Vec<usize>,
    /// Each output's name, and what it needs.
    outputs: Vec<(String, LivePasses)>,
}

impl<'a> Graph<'a> {
    pub(super) fn new(plan: &'a Plan, wanted: &'a [Output]) -> Self {
        let offered = plan.structure.outputs.iter();
        let requested: Vec<usize> = offered
            .filter(|(output, _)| wanted.contains(output))
            .map(|(_, texture)| texture.index())
            .collect();
        let offered = plan.structure.outputs.iter();
        let outputs =
            offered.map(|(output, texture)| (output.name(), needed(plan, &[texture.index()])));
        let outputs = outputs.collect();
        Self { plan, wanted, needed: needed(plan, &requested), requested, outputs }
    }

    /// Names of the outputs that a pass feeds.
    fn fed_by(&self, pass: usize) -> Vec<String> {
        let fed = self.outputs.iter().filter(|(_, needed)| needed.passes.get(pass) == Some(&true));
        fed.map(|(name, _)| name.clone()).collect()
    }

    pub(super) fn passes(&self, reports: &[PassReport]) -> Vec<PassUse> {
        let own = &self.plan.structure.passes;
        let explained = |(number, report): (usize, &PassReport)| {
            let behind = &reports[number + 1..];
            let at = own.iter().position(|pass| pass.name == report.name);
            let outputs = at.map(|at| self.fed_by(at)).unwrap_or_default();
            let why = match (report.state, at) {
                (PassState::Ran, Some(_)) => format!("feeds output {}", listed(&outputs)),
                (PassState::Ran, None) if report.name.starts_with("host: splats") => {
                    "sorts and composes the splats of the pass above".to_owned()
                }
                (PassState::Ran, None) if report.name.starts_with("host:") => {
                    "makes an output that was asked for and that the renderer does not make"
                        .to_owned()
                }
                (PassState::Ran, None) => "draws surfels for what follows".to_owned(),
                (PassState::Reused, _) => {
                    "what it makes is kept, and nothing it is of has changed".to_owned()
                }
                (PassState::Culled, _) if outputs.is_empty() => "feeds no output".to_owned(),
                (PassState::Culled, _) => {
                    format!("feeds output {} alone, not asked for", listed(&outputs))
                }
            };
            let has_function = at.is_some_and(|at| self.plan.passes[at].per_pixel.is_some());
            let is_splats = at.is_some_and(|at| matches!(own[at].work, Work::Splats(_)));
            let why = match (report.state, is_splats, has_function) {
                (PassState::Ran, true, true) => format!(
                    "{why}; composed by the device, which alone calls a function of each pixel"
                ),
                (PassState::Ran, true, false) => format!("{why}; {}", composed(behind)),
                _ => why,
            };
            let constants = at.and_then(|at| own.get(at)).map(|pass| {
                pass.constants.iter().map(|(name, value)| (name.clone(), *value)).collect()
            });
            let features = at.and_then(|at| own.get(at)).map(|pass| {
                pass.features.iter().map(|(name, there)| (name.clone(), *there)).collect()
            });
            let chosen = at.and_then(|at| self.plan.passes[at].instead_of.as_deref());
            let why = match chosen {
                Some(instead_of) => format!("{why}; runs instead of {instead_of}"),
                None => why,
            };
            let needs = at.map(|at| own[at].needs.as_slice()).unwrap_or_default();
            let why = match needs.is_empty() {
                true => why,
                false => format!("{why}; needs {}", listed(needs)),
            };
            let stood_in = at.is_some_and(|at| self.plan.passes[at].stood_in.get());
            let why = match stood_in {
                true => {
                    format!("{why}; drawn by a shader with more in it while its own is compiled")
                }
                false => why,
            };
            PassUse {
                name: report.name.clone(),
                state: report.state,
                gpu_ms: report.gpu_ms,
                why,
                constants: constants.unwrap_or_default(),
                features: features.unwrap_or_default(),
            }
        };
        reports.iter().enumerate().map(explained).collect()
    }

    pub(super) fn resources(&self) -> Vec<ResourceUse> {
        let nodes = touched(self.plan, &self.needed, &self.requested);
        let structure = &self.plan.structure;
        let why = |made: bool, node: Node| match made {
            true => "a pass that runs reads or writes it".to_owned(),
            false => format!("only {} would touch it", listed(&self.touching(node))),
        };
        let textures = structure.textures.iter().enumerate().map(|(i, texture)| {
            let node = Node::Texture(i);
            let made = nodes.contains(&node);
            let [width, height, depth] = self.plan.extent(i);
            let texels = texels([width, height, depth], texture.mips, texture.volume);
            ResourceUse {
                label: texture.label.clone(),
                what: format!("{width} x {height} x {depth} {:?}", texture.format),
                bytes: texels * u64::from(texture.format.bytes_per_texel()),
                made,
                why: why(made, node),
            }
        });
        let buffers = structure.buffers.iter().enumerate().map(|(i, buffer)| {
            let node = Node::Buffer(i);
            let made = nodes.contains(&node);
            let what = match (buffer.surfels, &buffer.lifetime) {
                _ if buffer.columns.is_some() => "buffer of columns of clouds",
                _ if buffer.resident.is_some() => "buffer, sent once and resident under its key",
                (Some(_), _) => "buffer of the scene's surfels",
                (None, Lifetime::History) => "buffer, kept from frame to frame",
                (None, Lifetime::Persistent { .. }) => "buffer, kept under its key",
                (None, Lifetime::Frame) => "buffer",
            };
            ResourceUse {
                label: buffer.label.clone(),
                what: what.to_owned(),
                bytes: buffer.size,
                made,
                why: why(made, node),
            }
        });
        textures.chain(buffers).collect()
    }

    /// Names of the passes that touch a resource.
    fn touching(&self, node: Node) -> Vec<String> {
        let passes = self.plan.structure.passes.iter().zip(&self.plan.passes);
        let touches =
            passes.filter(|(_, pass)| pass.reads.contains(&node) || pass.writes.contains(&node));
        touches.map(|(pass, _)| pass.name.clone()).collect()
    }

    pub(super) fn outputs_used(&self) -> Vec<OutputUse> {
        let one = |(output, _): &(Output, _)| OutputUse {
            name: output.name(),
            wanted: self.wanted.contains(output),
        };
        let own: Vec<OutputUse> = self.plan.structure.outputs.iter().map(one).collect();
        let is_own = |output: &Output| own.iter().any(|known| known.name == output.name());
        let of_host = self.wanted.iter().filter(|output| !is_own(output));
        let of_host: Vec<OutputUse> = of_host
            .map(|output| OutputUse {
                name: format!("{}, by the host", output.name()),
                wanted: true,
            })
            .collect();
        own.into_iter().chain(of_host).collect()
    }
}

/// How splats of a pass were composed, by the passes of the host behind it.
fn composed(behind: &[PassReport]) -> &'static str {
    let steps = behind.iter().take_while(|report| report.name.starts_with("host:"));
    let mut names = steps.map(|report| report.name.as_str());
    match names.find(|name| name.ends_with(" quads") || name.ends_with(", compose")) {
        Some(name) if name.ends_with(" quads") => "composed by the device, as quads",
        Some(_) => "composed by the device, tile by tile",
        None => "composed by the processor",
    }
}

/// Names as a sentence has them.
fn listed(names: &[String]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    if quoted.is_empty() { "nothing".to_owned() } else { quoted.join(", ") }
}
