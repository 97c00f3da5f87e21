//! One pane while the program runs: the pictures it shows and those it waits for.

use super::compare::Difference;
use super::darkroom::{Order, Place, Shot};
use super::detail::{Detail, Governor};
use super::timings::Timings;
use crate::clouds::Clouds;
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_engine::picture::Development;

/// A picture on the screen.
pub(crate) struct Shown {
    pub(crate) shot: Shot,
    pub(crate) renderer: String,
    pub(crate) serial: u64,
    pub(crate) texture: TextureHandle,
}

/// What a picture depends on, apart from its detail.
#[derive(Clone, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) renderer: String,
    pub(crate) values: Values,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) development: Development,
    pub(crate) view: View,
    /// Counts the loads of clouds.
    pub(crate) load: u64,
}

/// What was ordered.
struct Ordered {
    wanted: Wanted,
    detail: Detail,
    /// Whether the first frame was enough.
    moves: bool,
    serial: u64,
}

/// One side of a pane.
#[derive(Default)]
pub(crate) struct Side {
    pub(crate) shown: Option<Shown>,
    /// What was ordered last.
    ordered: Option<Ordered>,
    /// Number of the last order that was answered.
    answered: u64,
    changed: Option<Instant>,
    governor: Governor,
    pub(crate) timings: Timings,
    /// Why the last order failed, in one line.
    pub(crate) error: Option<String>,
    /// A renderer whose first picture is being prepared.
    pub(crate) preparing: Option<String>,
}

impl Side {
    /// Has a picture that failed ordered again.
    pub(crate) fn try_again(&mut self) {
        if self.error.take().is_some() {
            self.ordered = None;
        }
    }

    /// Whether a picture is on its way.
    pub(crate) fn waits(&self) -> bool {
        self.ordered.as_ref().is_some_and(|ordered| ordered.serial != self.answered)
    }

    /// The order to be placed now, if any; `adaptive` lets detail fall while something changes.
    ///
    /// Also says when to look again, where full detail follows later.
    pub(crate) fn next_order(
        &mut self,
        wanted: &Wanted,
        clouds: &Arc<Clouds>,
        adaptive: bool,
        serial: &mut u64,
    ) -> (Option<Order>, Option<Duration>) {
        let now = Instant::now();
        let changed = self.ordered.as_ref().is_none_or(|last| last.wanted != *wanted);
        if changed {
            self.changed = Some(now);
        }
        // What another renderer took says nothing of this one.
        if self.ordered.as_ref().is_some_and(|last| last.wanted.renderer != wanted.renderer) {
            self.governor = Governor::default();
        }
        let still = self.governor.still();
        let age = self.changed.map_or(still, |changed| now.duration_since(changed));
        // A first picture, a switch of renderers and a change of size are not motion.
        let moves = age < still && self.moved(wanted);
        let detail = if moves && adaptive { self.governor.detail() } else { Detail::FULL };
        let again = moves.then(|| still.saturating_sub(age) + Duration::from_millis(5));
        let ordered_detail = self.ordered.as_ref().map(|ordered| ordered.detail);
        if !changed && (moves || (ordered_detail == Some(detail) && !self.is_left_unrefined())) {
            return (None, again);
        }
        *serial += 1;
        self.ordered = Some(Ordered { wanted: wanted.clone(), detail, moves, serial: *serial });
        let order = Order {
            renderer: wanted.renderer.clone(),
            values: wanted.values.clone(),
            clouds: clouds.clone(),
            scene: wanted.scene.clone(),
            environment: wanted.environment.clone(),
            development: wanted.development,
            view: wanted.view,
            detail,
            moves,
            is_measured: false,
            serial: *serial,
        };
        (Some(order), again)
    }

    /// Whether what is shown now and what is wanted are the same renderer over the same clouds.
    fn moved(&self, wanted: &Wanted) -> bool {
        let same = |last: &Ordered| last.wanted.load == wanted.load;
        self.shown.as_ref().is_some_and(|shown| shown.renderer == wanted.renderer)
            && self.ordered.as_ref().is_some_and(same)
    }

    /// Whether the picture ordered last is there and is the first frame of one that would be refined,
    /// had something not moved.
    fn is_left_unrefined(&self) -> bool {
        self.shown.as_ref().zip(self.ordered.as_ref()).is_some_and(|(shown, ordered)| {
            ordered.moves && shown.serial == ordered.serial && shown.shot.refines
        })
    }

    /// Whether the picture ordered last, which is not on show, is being refined: from now on it is left
    /// as it is, until it is on show again.
    pub(crate) fn is_to_rest(&mut self) -> bool {
        let refines = !self.waits() && self.shown.as_ref().is_some_and(|shown| shown.shot.refines);
        let Some(ordered) = self.ordered.as_mut().filter(|ordered| refines && !ordered.moves)
        else {
            return false;
        };
        ordered.moves = true;
        true
    }

    /// Lets go of a picture that is larger than its pane, which is not on show; says whether there was
    /// one. Those that fit may be shown again as they are.
    pub(crate) fn let_larger_go(&mut self, size_px: [u32; 2]) -> bool {
        let [width, height] = size_px;
        let is_larger = |shown: &Shown| shown.shot.size[0] > width || shown.shot.size[1] > height;
        let goes = !self.waits() && self.shown.as_ref().is_some_and(is_larger);
        if goes {
            (self.shown, self.ordered) = (None, None);
        }
        goes
    }

    /// Takes a picture, or the reason why there is none.
    pub(crate) fn take(
        &mut self,
        ctx: &Context,
        place: Place,
        renderer: String,
        serial: u64,
        outcome: Result<Shot, String>,
    ) {
        self.answered = serial;
        self.preparing = None;
        match outcome {
            Ok(shot) => {
                // A picture of the renderer that was here before may come late.
                let is_of_this =
                    self.ordered.as_ref().is_some_and(|last| last.wanted.renderer == renderer);
                // In motion the first frame is the only one.
                if is_of_this && shot.n_frames == 1 {
                    self.governor.learn(shot.detail, shot.milliseconds);
                } else if is_of_this {
                    self.governor.learn_whole(shot.detail, shot.milliseconds);
                }
                self.error = None;
                self.timings.add(&renderer, &shot);
                let size = shot.size.map(|side| side as usize);
                let image = ColorImage::from_rgba_unmultiplied(size, &shot.levels);
                // Pixels stay pixels where sizes agree; coarser pictures are smoothed.
                let options = if shot.detail.coarseness > 1 {
                    TextureOptions::LINEAR
                } else {
                    TextureOptions::NEAREST
                };
                let name = format!("pane {} side {}", place.pane, place.side);
                let texture = ctx.load_texture(name, image, options);
                self.shown = Some(Shown { shot, renderer, serial, texture });
            }
            Err(error) => self.error = Some(error),
        }
    }

    /// Whether a picture is on its way or will be ordered in full detail.
    pub(crate) fn works(&self) -> bool {
        self.waits() || (self.error.is_none() && self.ordered.is_some() && !self.settled())
    }

    /// Whether the picture shown is the one ordered last, in full detail.
    pub(crate) fn settled(&self) -> bool {
        !self.waits()
            && self.shown.as_ref().is_some_and(|shown| {
                shown.shot.is_whole()
                    && self.ordered.as_ref().is_some_and(|last| last.serial == shown.serial)
            })
    }
}

/// A pane's two sides and how they differ.
#[derive(Default)]
pub(crate) struct Pane {
    pub(crate) sides: [Side; 2],
    difference: Option<([TextureId; 2], Difference)>,
    heat: Option<([TextureId; 2], f32, TextureHandle)>,
    /// Whether a flicker shows the second picture.
    pub(crate) flicker: bool,
    /// Size of the pictures in pixels.
    pub(crate) size_px: [u32; 2],
    /// Difference of the brightest colour of the heat map, in [0, 1].
    pub(crate) heat_full: f32,
}

impl Pane {
    /// A pane that shows nothing yet.
    pub(crate) fn new() -> Self {
        Self { heat_full: 0.1, ..Self::default() }
    }

    /// Lets go of how the pictures differ, where there are not two any more.
    pub(crate) fn let_comparison_go(&mut self) {
        (self.difference, self.heat) = (None, None);
    }

    /// How the two pictures shown differ; `None` until there are two of equal size.
    pub(crate) fn difference(&mut self) -> Option<&Difference> {
        let [a, b] = [self.sides[0].shown.as_ref()?, self.sides[1].shown.as_ref()?];
        // Each picture has a texture of its own, while one that is refined keeps its number.
        let pictures = [a.texture.id(), b.texture.id()];
        if self.difference.as_ref().is_none_or(|(of, _)| *of != pictures) {
            // Pictures of two moments of a movement are not compared.
            let of = |shot: &Shot| (shot.view, shot.detail, shot.one_of);
            let same = of(&a.shot) == of(&b.shot);
            let difference = Difference::new(a.shot.size, &a.shot.levels, &b.shot.levels);
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
