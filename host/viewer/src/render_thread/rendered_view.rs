//! A picture that the thread has drawn, and the reply that carries it.

use super::level_of_detail::Detail;
use super::view_request::ViewSlot;
use std::sync::Arc;
use surfelshop_api::View;
use surfelshop_image::Image;
use surfelshop_render::{Explanation, PassReport, PassState};

/// A picture with what is known of it.
#[derive(Clone)]
pub(crate) struct RenderedView {
    pub(crate) size: [u32; 2],
    /// Display colours, four 8-bit values a pixel; empty for measured pictures.
    pub(crate) levels: Vec<u8>,
    /// Linear radiance and coverage.
    pub(crate) color: Image,
    /// Distances along the viewing axis, 0 where nothing is; only of still pictures.
    pub(crate) depth: Option<Image>,
    pub(crate) view: View,
    pub(crate) passes: Vec<PassReport>,
    /// From request to picture, milliseconds.
    pub(crate) milliseconds: f64,
    /// Drawing time, milliseconds: of this frame, or of all frames where the picture is measured or
    /// exported.
    pub(crate) frame_ms: f64,
    /// The part of that which the renderer's own passes took on the device, milliseconds, where known.
    pub(crate) own_passes_ms: Option<f64>,
    /// Frames drawn so far.
    pub(crate) n_frames: u32,
    /// Whether another frame would refine the picture.
    pub(crate) refines: bool,
    /// Settled pictures whose mean it is, each seen at another place of every pixel, and how many there are to be; zeros
    /// where a tracer makes it.
    pub(crate) samples: [u32; 2],
    pub(crate) detail: Detail,
    /// What the picture consists of; only of still pictures.
    pub(crate) explained: Option<Arc<Explanation>>,
    /// Stride of the surfels that stand in for a large cloud during its upload; 1 without one.
    pub(crate) upload_stride: u32,
    /// How far it is, where a tracer makes it.
    pub(crate) traced: Option<TracedState>,
}

/// How far a traced picture is.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TracedState {
    /// The renderer whose picture is shown, or stands behind tiles that are not traced yet.
    pub(crate) stand_in: Option<String>,
    /// The share that is traced, 0 to 1.
    pub(crate) fraction: f64,
    /// Samples that every pixel has, and will have; 0 before it began.
    pub(crate) samples: u32,
    pub(crate) of: u32,
}

impl TracedState {
    /// In a few words.
    pub(crate) fn describe(&self) -> String {
        let traced = match (self.of, self.fraction >= 1.0) {
            (0, _) => "not traced yet".to_owned(),
            (1, true) => "1 sample".to_owned(),
            (n, true) => format!("{n} samples"),
            (of, false) => {
                format!("{:.0} % traced, {} of {of} samples", 100.0 * self.fraction, self.samples)
            }
        };
        match &self.stand_in {
            Some(stand_in) => format!("{traced}, {stand_in} stands in"),
            None => traced,
        }
    }
}

impl RenderedView {
    /// Whether it shows all surfels and pixels.
    pub(crate) fn is_full(&self) -> bool {
        self.detail.is_full() && self.upload_stride == 1
    }

    /// Whether its surfels are those of the picture before: another light falls on them.
    pub(crate) fn keeps_surfels(&self) -> bool {
        let mut of_surfels =
            self.passes.iter().filter(|pass| pass.name.starts_with("surfels:")).peekable();
        of_surfels.peek().is_some() && of_surfels.all(|pass| pass.state != PassState::Ran)
    }

    /// Whether it shows everything and is final.
    pub(crate) fn is_final(&self) -> bool {
        self.is_full() && !self.refines
    }

    /// The level of detail in a few words.
    pub(crate) fn describe_detail(&self) -> String {
        Detail { stride: self.detail.stride * self.upload_stride, ..self.detail }.describe()
    }

    /// The display colours as an image of values in [0, 1].
    pub(crate) fn visible(&self) -> Image {
        let [width, height] = self.size;
        let data = self.levels.iter().map(|&level| f32::from(level) / 255.0).collect();
        Image { width, height, components: 4, data }
    }
}

/// The reply to a view request.
pub(crate) struct ViewReply {
    pub(crate) slot: ViewSlot,
    pub(crate) serial: u64,
    pub(crate) renderer: String,
    /// The picture, or the error in one line.
    pub(crate) outcome: Result<RenderedView, String>,
}
