//! A picture that several renderers draw: each its own clouds of one scene.
//!
//! All look at the same surface, made once, of every surfel that no graph draws itself. A renderer that shades it is
//! asked for its whole picture and shows in the pixels whose nearest surfel is its own, so that a cloud looks as it
//! does where one renderer draws the scene. A renderer that draws clouds itself is told of these alone, its splats are
//! hidden by the whole surface, what it shades of the surface is that of its own clouds, and its picture lies over what
//! is behind it.

mod companion;
mod compose;
mod facts;
mod own_surface;

pub(super) use own_surface::masked;

use crate::engine::output_request::{DEPTH_ONLY, OWNER_ONLY, OutputRequest};
use crate::engine::request::RendererPart;
use crate::engine::{Engine, RenderRequest, Rendered, RendererView, needs};
use crate::graph::{PassReport, Plan, RenderError};
use crate::surfels::ColumnDemand;
use companion::{Drawer, drawers};
use compose::{HostPictures, Layer, composed};
use glam::Vec2;
use surfelshop_api::graph::{Output, Work};
use surfelshop_api::{CloudFacts, CloudInfo, FrameRequest};
use surfelshop_image::Image;

/// What the renderers of a picture have in common.
#[derive(Clone, Debug, Default)]
pub(super) struct Shared {
    /// Clouds that graphs draw themselves.
    pub(super) taken: Vec<u32>,
    /// Whether a graph shades surfels one by one, which takes the device's quads.
    pub(super) one_by_one: bool,
    /// Whether surfels may be merged.
    pub(super) detailed: bool,
    /// Columns that are read; `None` where what is asked of the graph says it.
    pub(super) demand: Option<ColumnDemand>,
    /// The clouds whose surface a graph shades; `None` where it is all of it.
    pub(super) own: Option<Vec<u32>>,
    /// Pictures of the surface that the host makes besides, by the entry points of its shader.
    pub(super) entries: Vec<&'static str>,
    /// Where the picture is seen in each pixel, from its centre.
    pub(super) shift_px: Vec2,
}

impl Shared {
    /// For a renderer that draws the picture alone.
    pub(super) fn alone(plan: &Plan, detail_px: f32) -> Self {
        let one_by_one = plan.shades_surfels();
        Self {
            taken: plan.structure.taken.clone(),
            one_by_one,
            detailed: detail_px > 0.0 && plan.takes_merged_surfels() && !one_by_one,
            ..Self::default()
        }
    }
}

/// How the host makes an output of the surface.
fn entry_of(output: &Output) -> Option<&'static str> {
    match output {
        Output::Depth => Some(DEPTH_ONLY),
        Output::Normal => Some("normal_only"),
        Output::Albedo => Some("albedo_only"),
        Output::Ao => Some("ao_only"),
        Output::Color | Output::Debug(_) => None,
    }
}

/// The mean distance of what a graph draws, by which its pixels are ordered among others': an output that it may offer.
fn mean_distance() -> Output {
    Output::Debug("expected-depth".to_owned())
}

/// What is asked of one renderer.
struct Part {
    clouds: Vec<u32>,
    taken: Vec<u32>,
    is_hidden_by_surface: bool,
    is_encoded: bool,
    outputs: Vec<Output>,
}

impl Part {
    fn lies_over(&self) -> bool {
        !self.taken.is_empty()
    }
}

impl Engine {
    /// Has depths show the surface as well beside what a graph draws of its own clouds: those that say what is seen. They
    /// are the graph's own otherwise.
    pub fn show_whole_depths(&mut self, whole: bool) {
        self.whole_depths = whole;
    }

    /// Puts the surface into depths that a graph draws of its own clouds, where that is wanted.
    pub(super) fn draw_with_whole_depths(
        &mut self,
        renderer: &RendererView,
        request: &RenderRequest<'_>,
        mut shared: Shared,
    ) -> Result<Rendered, RenderError> {
        let depth = Output::Depth;
        let structure = renderer.plan.as_ref().map(|plan| &plan.structure);
        let is_own = structure.is_some_and(|structure| {
            !structure.taken.is_empty() && structure.outputs.iter().any(|(own, _)| *own == depth)
        });
        let is_surface =
            |(i, cloud): (u32, &CloudInfo)| cloud.n_surfels > 0 && !shared.taken.contains(&i);
        let has_surface = (0..).zip(&request.facts.clouds).any(is_surface);
        if self.whole_depths && is_own && has_surface && request.outputs.contains(&depth) {
            shared.entries = entry_of(&depth).into_iter().collect();
        }
        let (mut drawn, made) = self.draw_planned(renderer, request, &shared)?;
        let own = drawn.images.iter_mut().find(|(output, _)| *output == depth);
        if let (Some((_, own)), Some(surface)) = (own, made.first()) {
            compose::with_surface(own, surface);
        }
        Ok(drawn)
    }

    /// Has each renderer describe a frame of its clouds, runs all and puts the pictures together.
    pub(super) fn attempt_several(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, RenderError> {
        let mut others = std::mem::take(&mut renderer.others);
        let mut all = drawers(renderer, request.values, &mut others, request.facts);
        let drawn = match all.as_mut_slice() {
            [only] => {
                let request = RenderRequest { values: only.values, ..*request };
                let drawn = self.attempt_one(only.view, &request, shift_px);
                drawn.map_err(|error| (only.name.clone(), error))
            }
            all => self.draw_together(all, request, shift_px),
        };
        drop(all);
        renderer.others = others;
        renderer.at_fault = None;
        drawn.map_err(|(name, error)| {
            renderer.at_fault = Some(name);
            error
        })
    }

    fn draw_together(
        &mut self,
        all: &mut [Drawer<'_>],
        request: &RenderRequest<'_>,
        shift_px: Vec2,
    ) -> Result<Rendered, (String, RenderError)> {
        self.ask(all, request)?;
        let fail = |drawer: &Drawer<'_>, error| (drawer.name.clone(), error);
        let mut parts = Vec::with_capacity(all.len());
        for drawer in all.iter() {
            parts.push(part_of(drawer, request, all.len()).map_err(|error| fail(drawer, error))?);
        }
        let offers = |wanted: &Output| {
            entry_of(wanted).is_some() || parts.iter().any(|part| part.outputs.contains(wanted))
        };
        if let Some(wanted) = request.outputs.iter().find(|wanted| !offers(wanted)) {
            let first = all.first().map(|drawer| drawer.name.clone()).unwrap_or_default();
            return Err((first, not_offered(wanted, all)));
        }
        let mut shared = shared(all, &parts, request).map_err(|(i, error)| {
            (all.get(i).map(|drawer| drawer.name.clone()).unwrap_or_default(), error)
        })?;
        shared.shift_px = shift_px;
        let (mut layers, mut host) = (Vec::new(), None);
        let mut whole = Rendered::default();
        for (i, (drawer, part)) in all.iter_mut().zip(&parts).enumerate() {
            shared.own = part.lies_over().then(|| part.clouds.clone());
            shared.entries = if i == 0 { host_entries(request.outputs) } else { Vec::new() };
            let left_out = left_out(part, &parts, request.facts);
            let known = facts::without(request.facts, &left_out);
            let data = facts::data_without(request.data(), &left_out);
            let objects: Vec<_> = (0..request.clouds.len()).map(|i| request.part_of(i)).collect();
            let asked = RenderRequest {
                facts: &known,
                values: drawer.values,
                outputs: &part.outputs,
                parts: Some(crate::engine::Parts { objects: &objects, data: &data }),
                ..*request
            };
            let (drawn, made) = self
                .draw_planned(drawer.view, &asked, &shared)
                .map_err(|error| (drawer.name.clone(), error))?;
            if i == 0 {
                host = host_pictures(made, request.outputs);
            }
            add(&mut whole, &drawn, drawer, part);
            layers.push(layer(part, drawn, request.facts));
        }
        let host = host.ok_or_else(|| {
            (String::new(), RenderError::Host("the surface was not made".to_owned()))
        })?;
        let picture = |output: &Output| (output.clone(), composed(output, &host, &layers));
        whole.images = request.outputs.iter().map(picture).collect();
        Ok(whole)
    }

    /// Has each renderer describe its frame: those that need columns first, since what they draw themselves is no surface
    /// that the others know.
    fn ask(
        &mut self,
        all: &mut [Drawer<'_>],
        request: &RenderRequest<'_>,
    ) -> Result<(), (String, RenderError)> {
        let n_clouds = request.facts.clouds.len() as u32;
        let mut order: Vec<usize> = (0..all.len()).collect();
        let needs = |drawer: &Drawer<'_>| drawer.view.needs.iter().any(|need| need.required);
        order.sort_by_key(|i| all.get(*i).is_none_or(|drawer| !needs(drawer)));
        let mut taken: Vec<u32> = Vec::new();
        for i in order {
            let Some(drawer) = all.get_mut(i) else { continue };
            let is_own = |cloud: &u32| drawer.clouds.contains(cloud);
            let own_alone = needs(drawer) || drawer.view.takes;
            let foreign: Vec<u32> = (0..n_clouds).filter(|cloud| !is_own(cloud)).collect();
            let left_out = if own_alone { foreign.clone() } else { taken.clone() };
            let name = drawer.name.clone();
            let fail = |error| (name.clone(), error);
            self.ask_one(drawer, request, &left_out).map_err(fail)?;
            // One that draws clouds itself is told of its own alone; from then on at once.
            if !own_alone && !drawer.taken().is_empty() {
                drawer.view.takes = true;
                self.ask_one(drawer, request, &foreign).map_err(fail)?;
            }
            taken.extend(drawer.taken());
        }
        Ok(())
    }

    fn ask_one(
        &mut self,
        drawer: &mut Drawer<'_>,
        request: &RenderRequest<'_>,
        left_out: &[u32],
    ) -> Result<(), RenderError> {
        let known = facts::without(request.facts, left_out);
        if let Some(missing) = needs::missing(&drawer.view.needs, &known) {
            return Err(RenderError::Needs(missing));
        }
        let asked = FrameRequest {
            view: request.view,
            scene: request.scene.clone(),
            cloud: known,
            frame_index: request.frame_index,
            values: drawer.values.clone(),
            environment: request.environment.map(|light| light.environment.clone()),
        };
        let on_device = self.on_device(drawer.view);
        let encoded = drawer.view.hosted.frame_on_device(asked, request.stride, on_device);
        let encoded = encoded.map_err(RenderError::Plugin)?;
        let planned = self.replan(drawer.view, &encoded, request, true);
        drawer.view.graph = encoded;
        planned
    }
}

impl Drawer<'_> {
    /// The clouds that its graph draws itself.
    fn taken(&self) -> Vec<u32> {
        self.view.plan.as_ref().map(|plan| plan.structure.taken.clone()).unwrap_or_default()
    }
}

/// What is asked of a renderer, by the graph that it described.
fn part_of(
    drawer: &Drawer<'_>,
    request: &RenderRequest<'_>,
    n_drawers: usize,
) -> Result<Part, RenderError> {
    let none = || RenderError::Graph("there is none".to_owned());
    let structure = &drawer.view.plan.as_ref().ok_or_else(none)?.structure;
    let offers = |wanted: &Output| structure.outputs.iter().any(|(own, _)| own == wanted);
    let lies_over = !structure.taken.is_empty();
    let of_splats = |work: &Work| matches!(work, Work::Splats(_));
    let is_hidden_by_surface = structure.passes.iter().any(|pass| of_splats(&pass.work));
    let is_made = |wanted: &&Output| offers(wanted) || !lies_over && entry_of(wanted).is_some();
    let mut outputs: Vec<Output> = request.outputs.iter().filter(is_made).cloned().collect();
    if !offers(&Output::Color) && request.outputs.contains(&Output::Color) {
        let offered: Vec<String> = structure.outputs.iter().map(|(own, _)| own.name()).collect();
        let (wanted, offered) = (Output::Color.name(), offered.join(", "));
        return Err(RenderError::NoOutput { wanted, offered });
    }
    let mut besides = |output: Output| {
        if offers(&output) && !outputs.contains(&output) {
            outputs.push(output);
        }
    };
    let shows_values = request.outputs.iter().any(|output| *output != Output::Color);
    if lies_over && (shows_values || !is_hidden_by_surface) {
        besides(Output::Depth);
    }
    // Of two that lie over the surface one lies over the other.
    if lies_over && n_drawers > 1 && request.outputs.contains(&Output::Color) {
        besides(if offers(&mean_distance()) { mean_distance() } else { Output::Depth });
    }
    Ok(Part {
        clouds: drawer.clouds.clone(),
        taken: structure.taken.clone(),
        is_hidden_by_surface,
        is_encoded: structure.encoded_over,
        outputs,
    })
}

/// The clouds that a renderer is not told of.
fn left_out(part: &Part, parts: &[Part], facts: &CloudFacts) -> Vec<u32> {
    match part.lies_over() {
        true => {
            (0..facts.clouds.len() as u32).filter(|cloud| !part.clouds.contains(cloud)).collect()
        }
        false => parts.iter().flat_map(|part| part.taken.clone()).collect(),
    }
}

/// What all renderers' surfaces are drawn with.
///
/// # Errors
/// With the number of the renderer that offers no such output.
fn shared(
    all: &[Drawer<'_>],
    parts: &[Part],
    request: &RenderRequest<'_>,
) -> Result<Shared, (usize, RenderError)> {
    let mut shared = Shared { detailed: request.detail_px > 0.0, ..Shared::default() };
    let mut demand = ColumnDemand::default();
    for (i, (drawer, part)) in all.iter().zip(parts).enumerate() {
        let Some(plan) = &drawer.view.plan else { continue };
        let entries = if i == 0 { host_entries(request.outputs) } else { Vec::new() };
        let asked = OutputRequest::new(plan, &part.outputs, &entries).map_err(|e| (i, e))?;
        demand = demand.or(asked.wanted());
        shared.taken.extend(&part.taken);
        shared.one_by_one |= plan.shades_surfels();
        shared.detailed &= plan.takes_merged_surfels();
    }
    shared.detailed &= !shared.one_by_one;
    shared.demand = Some(demand);
    Ok(shared)
}

/// The pictures of the surface that the host makes for putting pictures together.
fn host_entries(outputs: &[Output]) -> Vec<&'static str> {
    std::iter::once(OWNER_ONLY).chain(outputs.iter().filter_map(entry_of)).collect()
}

fn host_pictures(made: Vec<Image>, outputs: &[Output]) -> Option<HostPictures> {
    let mut made = made.into_iter();
    let owner = made.next()?;
    let of_surface = outputs.iter().filter(|output| entry_of(output).is_some());
    Some(HostPictures { owner, others: of_surface.cloned().zip(made).collect() })
}

fn not_offered(wanted: &Output, all: &[Drawer<'_>]) -> RenderError {
    let plans = all.iter().filter_map(|drawer| drawer.view.plan.as_ref());
    let own = plans.flat_map(|plan| plan.structure.outputs.iter().map(|(output, _)| output.name()));
    let mut offered: Vec<String> = own.collect();
    offered.extend(["depth", "normal", "albedo", "ao"].map(str::to_owned));
    let mut known = std::collections::BTreeSet::new();
    offered.retain(|name| known.insert(name.clone()));
    RenderError::NoOutput { wanted: wanted.name(), offered: offered.join(", ") }
}

/// A renderer's pictures among the others'.
fn layer(part: &Part, drawn: Rendered, facts: &CloudFacts) -> Layer {
    let order = drawn.image(&mean_distance()).or_else(|| drawn.image(&Output::Depth)).cloned();
    Layer {
        own: (0..facts.clouds.len() as u32).map(|cloud| part.clouds.contains(&cloud)).collect(),
        lies_over: part.lies_over(),
        is_hidden_by_surface: part.is_hidden_by_surface,
        is_encoded: part.is_encoded,
        order: order.filter(|_| part.lies_over()),
        pictures: drawn.images,
    }
}

/// Whether a pass is the host's.
pub(super) fn is_of_host(pass: &str) -> bool {
    pass.starts_with("surfels:") || pass.starts_with("host:")
}

/// Adds what a renderer's part of a frame took.
fn add(whole: &mut Rendered, drawn: &Rendered, drawer: &Drawer<'_>, part: &Part) {
    let named = |pass: &PassReport| match is_of_host(&pass.name) {
        true => pass.clone(),
        false => PassReport { name: format!("{}: {}", drawer.name, pass.name), ..pass.clone() },
    };
    whole.passes.extend(drawn.passes.iter().map(named));
    whole.graph_bytes += drawn.graph_bytes;
    whole.merged |= drawn.merged;
    whole.columns_ms += drawn.columns_ms;
    whole.wants_another_frame |= drawn.wants_another_frame;
    whole.parts.push(RendererPart {
        renderer: drawer.name.clone(),
        clouds: part.clouds.clone(),
        taken: part.taken.clone(),
        graph_bytes: drawn.graph_bytes,
    });
}
