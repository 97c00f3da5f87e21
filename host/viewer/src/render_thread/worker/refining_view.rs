//! A picture that is refined frame by frame, and how far it is.

use super::frames::Frames;
use crate::render_thread::rendered_view::RenderedView;
use crate::render_thread::view_request::ViewSlot;
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_image::{Image, PictureMean};
use surfelshop_render::{Explanation, RenderError};
use surfelshop_session::antialias::{add_color, replace_color};
use surfelshop_session::session::ConvergedFrame;

/// A picture that is refined frame by frame.
///
/// Without antialiasing one settled picture is all there is. With it others follow, each seen at another place of every
/// pixel, and what is shown is the mean of those that are settled.
pub(super) struct RefiningView {
    pub(super) slot: ViewSlot,
    /// Settled pictures so far.
    sample: u32,
    /// Frames of the next one drawn so far: the index of its next frame.
    pub(super) n_frames: u32,
    /// Frames of the settled ones.
    n_frames_before: u32,
    /// What settled; none before the first, and without antialiasing.
    settled: Option<SettledSamples>,
    /// When the window got a frame last.
    pub(super) sent: Instant,
    /// [`RenderWorker::n_drawn`](super::state::RenderWorker::n_drawn) after its last frame.
    pub(super) n_drawn: u64,
}

/// Settled pictures of different places in each pixel.
struct SettledSamples {
    mean: PictureMean,
    /// Of the first.
    depth: Option<Image>,
    explained: Option<Arc<Explanation>>,
}

/// What a frame is good for.
pub(super) struct FrameUse {
    /// Whether another frame would change the picture.
    pub(super) refines: bool,
    /// Whether it shows more than the one before.
    pub(super) may_be_shown: bool,
    pub(super) explained: Option<Arc<Explanation>>,
}

impl RefiningView {
    /// A picture of which the first frame is drawn, after so many frames of all pictures.
    pub(super) fn new(slot: ViewSlot, first: &RenderedView, n_drawn: u64) -> Self {
        let [sample, _] = first.samples;
        let settled = (sample > 0).then(|| SettledSamples {
            mean: PictureMean::of(&first.color),
            depth: first.depth.clone(),
            explained: first.explained.clone(),
        });
        let (n_frames, n_frames_before) = match sample {
            0 => (first.n_frames, 0),
            _ => (0, first.n_frames),
        };
        let sent = Instant::now();
        Self { slot, sample, n_frames, n_frames_before, settled, sent, n_drawn }
    }

    /// The frame that is drawn next.
    pub(super) fn next_frames(&self) -> Frames {
        Frames::One { sample: self.sample, frame: self.n_frames }
    }

    /// Takes in that frame, of which the picture is to be the mean of `antialias` settled ones.
    ///
    /// # Errors
    /// Where its colour has another shape than those before.
    pub(super) fn take(
        &mut self,
        frame: &mut ConvergedFrame,
        explained: Option<Explanation>,
        antialias: u32,
    ) -> Result<FrameUse, RenderError> {
        let (is_settled, is_first) = (!frame.refines(), self.sample == 0);
        let mut explained = explained.map(Arc::new);
        self.n_frames = frame.n_frames;
        frame.n_frames = frame.n_frames.saturating_add(self.n_frames_before);
        if is_settled {
            match &mut self.settled {
                Some(settled) => {
                    add_color(&mut settled.mean, &frame.rendered)?;
                    explained.clone_from(&settled.explained);
                }
                None if antialias > 1 => {
                    let image = |output: &Output| frame.rendered.image(output);
                    self.settled = image(&Output::Color).map(|color| SettledSamples {
                        mean: PictureMean::of(color),
                        depth: image(&Output::Depth).cloned(),
                        explained: explained.clone(),
                    });
                }
                None => {}
            }
            (self.sample, self.n_frames) = (self.sample + 1, 0);
            self.n_frames_before = frame.n_frames;
        }
        let refines = self.sample < antialias;
        Ok(FrameUse { refines, may_be_shown: is_first || is_settled, explained })
    }

    /// The frame as it is shown: with the mean of what is settled.
    pub(super) fn shown(&self, mut frame: ConvergedFrame) -> ConvergedFrame {
        if let Some(settled) = self.settled.as_ref().filter(|settled| settled.mean.n_pictures() > 1)
        {
            replace_color(&mut frame.rendered, settled.mean.mean());
            let depth = settled.depth.clone().map(|depth| (Output::Depth, depth));
            frame.rendered.images.extend(depth);
        }
        frame
    }
}
