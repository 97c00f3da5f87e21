//! How a picture is made: a renderer is started where another one or none is, and draws.

use super::{InUse, Worker};
use crate::pictures;
use crate::studio::Settled;
use crate::surroundings::Surroundings;
use crate::viewer::darkroom::{News, Order, Place, Shot};
use crate::viewer::export;
use anyhow::anyhow;
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::graph::Output;
use surfelshop_engine::plugins::Contents;
use surfelshop_engine::{Explanation, RenderError, RenderRequest, RendererView};

const OUTPUTS: [Output; 2] = [Output::Color, Output::Depth];

/// What is drawn of a picture that gets better from frame to frame.
#[derive(Clone, Copy)]
pub(super) enum Frames {
    /// All, until it does not change any more.
    All,
    /// The one of this index.
    One(u32),
}

impl Frames {
    /// What is drawn at first: nobody waits for pictures that are measured or written.
    pub(super) fn of(place: Place, order: &Order) -> Self {
        if order.is_measured || place == export::PLACE { Self::All } else { Self::One(0) }
    }
}

impl Worker {
    /// Makes a picture with the renderer that is at the place, or another one; `drawn` is what is drawn
    /// for the order, itself or with a few of its surfels.
    ///
    /// The renderer that was there is let go only when the other one has made its picture.
    pub(super) fn make(
        &mut self,
        place: Place,
        order: &Order,
        drawn: &Order,
    ) -> anyhow::Result<Shot> {
        let started = Instant::now();
        let here = self.in_use.remove(&place);
        let (mut in_use, before) = match here {
            Some(in_use) if in_use.name == order.renderer => (in_use, None),
            before => match self.start(place, order) {
                Ok(in_use) => (in_use, before),
                Err(error) => {
                    self.in_use.extend(before.map(|before| (place, before)));
                    return Err(error);
                }
            },
        };
        in_use.order = order.clone();
        if let Err(barred) = self.conduct.check(&in_use.reference) {
            self.in_use.extend(before.map(|before| (place, before)));
            return Err(barred.into());
        }
        self.follow(&in_use);
        match self.render(&mut in_use.view, drawn, Frames::of(place, order)) {
            Ok((settled, explained)) => {
                in_use.mark = None;
                self.conduct.succeeded(&in_use.reference, in_use.unit.contents);
                self.in_use.insert(place, in_use);
                shot(&settled, explained, order, started)
            }
            Err(error) => {
                let fault = self.faulted(&in_use, error);
                self.in_use.insert(place, before.unwrap_or(in_use));
                fault
            }
        }
    }

    /// Notes that a frame failed, and opens a device that was lost again.
    pub(super) fn faulted<T>(&mut self, in_use: &InUse, error: RenderError) -> anyhow::Result<T> {
        if !in_use.is_of_a_file(&error) {
            self.failed(&in_use.reference, in_use.unit.contents, &fault_of(&error));
        }
        if matches!(error, RenderError::DeviceLost(_)) {
            self.open_again()?;
        }
        Err(error.into())
    }

    /// Loads a renderer and makes an instance.
    fn start(&mut self, place: Place, order: &Order) -> anyhow::Result<InUse> {
        let name = order.renderer.clone();
        let reference = self.registry.find(UnitKind::Renderer, &name)?;
        anyhow::ensure!(
            !self.avoided.contains(&name),
            "{reference} was at work when the program crashed; the plugin list switches it on"
        );
        self.conduct.check(&reference)?;
        self.teller.tell(News::Preparing { place, renderer: name.clone() });
        // Without the mark a crash is not noticed, which is no reason not to draw.
        let mark = self.marks.as_ref().and_then(|marks| marks.leave(&reference).ok());
        let unit = match reference.load(&self.plugins.patience()) {
            Ok(unit) => unit,
            Err(error) => {
                if let Some(fault) = error.fault() {
                    self.failed(&reference, Contents::of_file(&reference.path), fault);
                }
                return Err(error.into());
            }
        };
        let host = self.studio.engine.gpu().host_info();
        let hosted = match unit.start(&host, &self.plugins.patience()) {
            Ok(hosted) => hosted,
            Err(fault) => {
                self.failed(&reference, unit.contents, &fault);
                return Err(anyhow!("{reference} could not start: {fault}"));
            }
        };
        let parameters = unit.description.params.clone();
        self.teller.tell(News::Declared { renderer: name.clone(), parameters });
        let view = RendererView::new(hosted, unit.scope());
        Ok(InUse { name, reference, unit, view, mark, order: order.clone() })
    }

    /// Renders a frame, or as many as change the picture. Still pictures that do not change any more are
    /// explained.
    pub(super) fn render(
        &mut self,
        view: &mut RendererView,
        order: &Order,
        frames: Frames,
    ) -> Result<(Settled, Option<Explanation>), RenderError> {
        // What is timed is what was asked for.
        self.studio.engine.compile_beside(!order.is_measured);
        if order.is_measured {
            // A view may have drawn the same surfels, and what is timed pays for its own.
            self.studio.engine.forget_surfaces();
        }
        let surroundings = self.surroundings(order);
        let request = RenderRequest {
            clouds: &order.clouds.views(),
            facts: &order.clouds.facts,
            scene: &order.scene,
            view: order.detail.view(order.view),
            values: &order.values,
            // What lies under the pointer is only asked for of still pictures.
            outputs: match order.detail.is_full() && !order.is_measured {
                true => &OUTPUTS,
                false => &OUTPUTS[..1],
            },
            frame_index: 0,
            environment: surroundings.as_ref().map(Surroundings::view),
            stride: order.detail.stride,
            detail_px: 0.0,
        };
        let settled = match frames {
            Frames::All => self.studio.settle_view(view, &request)?,
            Frames::One(frame_index) => {
                self.studio.frame_view(view, &RenderRequest { frame_index, ..request })?
            }
        };
        self.drawn = Some(Instant::now());
        self.n_drawn += match frames {
            Frames::All => u64::from(settled.n_frames),
            Frames::One(_) => 1,
        };
        let is_still = order.detail.is_full() && !order.is_measured && !settled.refines();
        let explained =
            is_still.then(|| self.studio.engine.explain(view, &request, &settled.rendered));
        Ok((settled, explained))
    }

    /// The light around the scene; none where its probe cannot be read, which is told once.
    pub(super) fn surroundings(&mut self, order: &Order) -> Option<Surroundings> {
        let (probes, teller) = (&mut self.probes, &self.teller);
        probes.light_or_none(order.environment.as_ref()?, |line| teller.tell(News::Message(line)))
    }
}

/// What a failed frame says of the plugin. A lost device is answered as a hang is: the next frame
/// of the same renderer would probably lose it again.
fn fault_of(error: &RenderError) -> Fault {
    match error {
        RenderError::Plugin(fault) => fault.clone(),
        RenderError::DeviceLost(_) => Fault::TimedOut(std::time::Duration::ZERO),
        RenderError::Graph(_) | RenderError::Pass { .. } | RenderError::NoOutput { .. } => {
            Fault::Error(error.to_string())
        }
        // Neither the cloud nor the host's own shaders are the plugin's doing.
        _ => Fault::NotAsked(error.to_string()),
    }
}

/// The picture of a frame.
pub(super) fn shot(
    settled: &Settled,
    explained: Option<Explanation>,
    order: &Order,
    started: Instant,
) -> anyhow::Result<Shot> {
    let rendered = &settled.rendered;
    let image = |output: &Output| {
        let found = rendered.image(output).cloned();
        found.ok_or_else(|| anyhow!("the renderer gave no output `{}`", output.name()))
    };
    let color = image(&Output::Color)?;
    Ok(Shot {
        size: [color.width, color.height],
        levels: match order.is_measured {
            true => Vec::new(),
            false => pictures::levels(&color, &order.development),
        },
        color,
        depth: rendered.image(&Output::Depth).cloned(),
        view: order.detail.view(order.view),
        passes: rendered.passes.clone(),
        milliseconds: started.elapsed().as_secs_f64() * 1e3,
        frame_ms: settled.milliseconds,
        own_passes_ms: settled.own_passes_ms,
        n_frames: settled.n_frames,
        refines: settled.refines(),
        detail: order.detail,
        explained: explained.map(Arc::new),
        one_of: 1,
    })
}
