//! A pane: the pictures it shows, and the requests that are pending.

use super::compare::Difference;
use super::timings::Timings;
use crate::document::{Mode, PaneSettings};
use crate::render_thread::{Detail, Governor};
use crate::render_thread::{RenderedView, ViewRequest, ViewSlot};
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_image::EyeDome;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::scenes::NamedRenderer;

/// A picture of a side, as a texture.
pub(crate) struct PaneImage {
    pub(crate) rendered: RenderedView,
    pub(crate) renderer: String,
    pub(crate) serial: u64,
    pub(crate) texture: TextureHandle,
    /// Whether nothing behind it is seen.
    is_opaque: bool,
}

/// What a picture depends on, apart from its detail.
#[derive(Clone, PartialEq)]
pub(crate) struct ViewInputs {
    pub(crate) renderer: String,
    pub(crate) values: Values,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) display: DisplayTransform,
    pub(crate) view: View,
    /// Settled pictures that it is the mean of at rest.
    pub(crate) antialias: u32,
    pub(crate) tint_backs: bool,
    /// How it is darkened by what is nearer, if it is.
    pub(crate) eye_dome: Option<EyeDome>,
    /// The revision of the clouds.
    pub(crate) revision: u64,
    /// What each of the clouds names to draw it.
    pub(crate) named: Vec<Option<NamedRenderer>>,
    /// The cloud that is shown alone, by its place among the visible ones.
    pub(crate) alone: Option<usize>,
}

/// The last request of a side.
struct LastRequest {
    inputs: ViewInputs,
    detail: Detail,
    /// Whether the first frame was enough.
    in_motion: bool,
    serial: u64,
}

/// One side of a pane.
#[derive(Default)]
pub(crate) struct Side {
    pub(crate) shown: Option<PaneImage>,
    last_request: Option<LastRequest>,
    /// The number of the last reply.
    last_reply: u64,
    changed: Option<Instant>,
    governor: Governor,
    pub(crate) timings: Timings,
    /// Why the last request failed, in one line.
    pub(crate) error: Option<String>,
    /// A renderer that is preparing its first picture.
    pub(crate) preparing: Option<String>,
}

impl Side {
    /// Requests a failed picture again.
    pub(crate) fn retry_failed(&mut self) {
        if self.error.take().is_some() {
            self.last_request = None;
        }
    }

    /// Whether a picture is pending.
    pub(crate) fn waits(&self) -> bool {
        self.last_request
            .as_ref()
            .is_some_and(|last_request| last_request.serial != self.last_reply)
    }

    /// Whether a picture in motion is pending.
    pub(crate) fn waits_in_motion(&self) -> bool {
        self.waits() && self.last_request.as_ref().is_some_and(|last| last.in_motion)
    }

    /// The request to be sent now, if any; `adaptive` allows a coarser level of detail in motion. What a hand is changing
    /// is in motion, too (`is_led`).
    ///
    /// Also returns the time after which to call again, where full detail follows later.
    pub(crate) fn next_request(
        &mut self,
        inputs: &ViewInputs,
        clouds: &Arc<Clouds>,
        (adaptive, is_led): (bool, bool),
        serial: &mut u64,
    ) -> (Option<ViewRequest>, Option<Duration>) {
        let now = Instant::now();
        let changed = self.last_request.as_ref().is_none_or(|last| last.inputs != *inputs);
        if changed {
            self.changed = Some(now);
        }
        // Times of another renderer say nothing of this one.
        if self.last_request.as_ref().is_some_and(|last| last.inputs.renderer != inputs.renderer) {
            self.governor = Governor::default();
        }
        let still = self.governor.still_delay();
        let age = self.changed.map_or(still, |changed| now.duration_since(changed));
        // A first picture, a switch of renderers and a change of size are not motion.
        let in_motion = age < still && self.moved(inputs, is_led);
        let detail = if in_motion && adaptive { self.governor.detail() } else { Detail::FULL };
        let again = in_motion.then(|| still.saturating_sub(age) + Duration::from_millis(5));
        let last_detail = self.last_request.as_ref().map(|last_request| last_request.detail);
        if !changed && (in_motion || (last_detail == Some(detail) && !self.is_left_unrefined())) {
            return (None, again);
        }
        *serial += 1;
        self.last_request =
            Some(LastRequest { inputs: inputs.clone(), detail, in_motion, serial: *serial });
        let request = ViewRequest {
            renderer: inputs.renderer.clone(),
            values: inputs.values.clone(),
            clouds: clouds.clone(),
            named: inputs.named.clone(),
            scene: inputs.scene.clone(),
            environment: inputs.environment.clone(),
            display: inputs.display,
            view: inputs.view,
            antialias: inputs.antialias,
            tint_backs: inputs.tint_backs,
            eye_dome: inputs.eye_dome,
            detail,
            in_motion,
            for_measurement: false,
            serial: *serial,
        };
        (Some(request), again)
    }

    /// Whether the picture shown is by the same renderers, of the same clouds but for what a hand changes.
    fn moved(&self, inputs: &ViewInputs, is_led: bool) -> bool {
        let same = |last: &LastRequest| {
            let (last, now) = (&last.inputs, inputs);
            (is_led || last.revision == now.revision)
                && last.alone == now.alone
                && last.named == now.named
        };
        self.shown.as_ref().is_some_and(|shown| shown.renderer == inputs.renderer)
            && self.last_request.as_ref().is_some_and(same)
    }

    /// Whether the last picture is the first frame of one that refines, and stayed so because something
    /// moved.
    fn is_left_unrefined(&self) -> bool {
        self.shown.as_ref().zip(self.last_request.as_ref()).is_some_and(|(shown, last_request)| {
            last_request.in_motion && shown.serial == last_request.serial && shown.rendered.refines
        })
    }

    /// Stops the refinement of a hidden side until it is visible again; returns whether it was being
    /// refined.
    pub(crate) fn stops_refining(&mut self) -> bool {
        let refines =
            !self.waits() && self.shown.as_ref().is_some_and(|shown| shown.rendered.refines);
        let Some(last_request) =
            self.last_request.as_mut().filter(|last_request| refines && !last_request.in_motion)
        else {
            return false;
        };
        last_request.in_motion = true;
        true
    }

    /// Drops the picture of a hidden side if it is larger than the pane; returns whether it was. One that
    /// fits may be shown again.
    pub(crate) fn release_larger(&mut self, size_px: [u32; 2]) -> bool {
        let [width, height] = size_px;
        let is_larger =
            |shown: &PaneImage| shown.rendered.size[0] > width || shown.rendered.size[1] > height;
        let goes = !self.waits() && self.shown.as_ref().is_some_and(is_larger);
        if goes {
            (self.shown, self.last_request) = (None, None);
        }
        goes
    }

    /// Takes in a picture, or the reason why there is none.
    pub(crate) fn take_reply(
        &mut self,
        ctx: &Context,
        slot: ViewSlot,
        renderer: String,
        serial: u64,
        outcome: Result<RenderedView, String>,
    ) {
        self.last_reply = serial;
        self.preparing = None;
        match outcome {
            Ok(rendered) => {
                // A picture of the former renderer may come late.
                let is_of_this =
                    self.last_request.as_ref().is_some_and(|last| last.inputs.renderer == renderer);
                // In motion the first frame is the only one.
                // What a tracer takes says nothing of what is drawn in motion; its stand-in does.
                let is_traced = rendered.traced.as_ref().is_some_and(|traced| traced.of > 0);
                let is_of_this = is_of_this && !is_traced;
                if is_of_this && rendered.n_frames == 1 {
                    let reused = rendered.keeps_surfels();
                    self.governor.adapt(rendered.detail, rendered.milliseconds, reused);
                } else if is_of_this {
                    self.governor.record_full_frame(rendered.detail, rendered.milliseconds);
                }
                self.error = None;
                // Medians are of pictures of one kind; each traced one has more samples.
                if rendered.traced.is_none() {
                    self.timings.add(&renderer, &rendered);
                }
                let size = rendered.size.map(|side| side as usize);
                // What is opaque is the same either way, and quicker.
                let is_opaque = rendered.levels.chunks_exact(4).all(|pixel| pixel[3] == u8::MAX);
                let image = match is_opaque {
                    true => ColorImage::from_rgba_premultiplied(size, &rendered.levels),
                    false => ColorImage::from_rgba_unmultiplied(size, &rendered.levels),
                };
                // Pixels stay pixels where sizes agree; coarser pictures are smoothed.
                let options = if rendered.detail.coarseness > 1 {
                    TextureOptions::LINEAR
                } else {
                    TextureOptions::NEAREST
                };
                let name = format!("pane {} side {}", slot.pane, slot.side);
                let texture = ctx.load_texture(name, image, options);
                self.shown = Some(PaneImage { rendered, renderer, serial, texture, is_opaque });
            }
            Err(error) => self.error = Some(error),
        }
    }

    /// Whether a picture is pending or will be requested in full detail.
    pub(crate) fn works(&self) -> bool {
        self.waits()
            || (self.error.is_none() && self.last_request.is_some() && !self.is_converged())
    }

    /// Whether the picture of the last request is shown and final.
    pub(crate) fn is_converged(&self) -> bool {
        !self.waits()
            && self.shown.as_ref().is_some_and(|shown| {
                shown.rendered.is_final()
                    && self.last_request.as_ref().is_some_and(|last| last.serial == shown.serial)
            })
    }
}

/// A pane's two sides and how they differ.
#[derive(Default)]
pub(crate) struct Pane {
    pub(crate) sides: [Side; 2],
    difference: Option<([TextureId; 2], Difference)>,
    heat: Option<([TextureId; 2], f32, TextureHandle)>,
    /// Whether flicker mode shows the second picture.
    pub(crate) flicker: bool,
    /// Size of the pictures in pixels.
    pub(crate) size_px: [u32; 2],
    /// The difference that the heat map shows brightest, in [0, 1].
    pub(crate) heat_full: f32,
}

impl Pane {
    /// A pane that shows nothing yet.
    pub(crate) fn new() -> Self {
        Self { heat_full: 0.1, ..Self::default() }
    }

    /// Whether a single opaque picture is all that is seen: what would lie below it need not be painted, which on
    /// software drivers takes as long as the picture.
    pub(crate) fn covers(&self, settings: &PaneSettings) -> bool {
        let shown = self.sides[0].shown.as_ref();
        settings.mode == Mode::Single && shown.is_some_and(|shown| shown.is_opaque)
    }

    /// Drops the comparison, where one side is hidden.
    pub(crate) fn clear_comparison(&mut self) {
        (self.difference, self.heat) = (None, None);
    }

    /// The difference of the two pictures; `None` until there are two of equal size.
    pub(crate) fn difference(&mut self) -> Option<&Difference> {
        let [a, b] = [self.sides[0].shown.as_ref()?, self.sides[1].shown.as_ref()?];
        // Textures identify pictures: a refined picture keeps its number.
        let pictures = [a.texture.id(), b.texture.id()];
        if self.difference.as_ref().is_none_or(|(of, _)| *of != pictures) {
            // Pictures of different moments in motion are not compared.
            let of =
                |rendered: &RenderedView| (rendered.view, rendered.detail, rendered.upload_stride);
            let same = of(&a.rendered) == of(&b.rendered);
            let difference =
                Difference::new(a.rendered.size, &a.rendered.levels, &b.rendered.levels);
            self.difference = difference.filter(|_| same).map(|difference| (pictures, difference));
        }
        self.difference.as_ref().map(|(_, difference)| difference)
    }

    /// The heat map of the difference.
    pub(crate) fn heat(&mut self, ctx: &Context) -> Option<TextureHandle> {
        self.difference()?;
        let full = self.heat_full;
        let (pictures, difference) = self.difference.as_ref()?;
        let known =
            self.heat.as_ref().is_some_and(|(of, scale, _)| of == pictures && *scale == full);
        if !known {
            let size = difference.size.map(|side| side as usize);
            let image = ColorImage::new(size, difference.heat(full));
            let texture = ctx.load_texture("difference", image, TextureOptions::NEAREST);
            self.heat = Some((*pictures, full, texture));
        }
        self.heat.as_ref().map(|(_, _, texture)| texture.clone())
    }
}
