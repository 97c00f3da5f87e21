//! Frames as they are asked for and as they come back.

use crate::graph::PassReport;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudFacts, CloudView, EnvironmentView, Scene, View};
use surfelshop_image::{EyeDome, Image};

/// A frame to be rendered.
#[derive(Clone, Copy)]
pub struct RenderRequest<'a> {
    /// The clouds of the scene.
    pub clouds: &'a [CloudView<'a>],
    /// Facts of the clouds.
    pub facts: &'a CloudFacts,
    /// Lights, exposure and surface settings.
    pub scene: &'a Scene,
    /// Camera, size and depth range.
    pub view: View,
    /// The light around the scene, where it has one.
    pub environment: Option<EnvironmentView<'a>>,
    /// The renderer's parameters.
    pub values: &'a Values,
    /// The pictures wanted.
    pub outputs: &'a [Output],
    /// Frames since something in this view changed.
    pub frame_index: u32,
    /// One surfel of so many is drawn, evenly along the curve that orders them in space, and so
    /// much larger that they cover the same area: a preview where 1, the whole, takes too long. 0
    /// is taken as 1. Where surfels are merged, it makes these coarser instead.
    pub stride: u32,
    /// Several surfels are drawn as one where that has at most this radius in pixels; 0, or a renderer
    /// that does not take merged surfels, draws all.
    pub detail_px: f32,
    /// Where clouds are parts of others that do not fit into memory as a whole, what they are parts of.
    pub parts: Option<Parts<'a>>,
    /// Has the colour darkened by what is nearer beside it, whatever draws it; distances show the whole scene then.
    pub eye_dome: Option<EyeDome>,
}

/// Clouds that are parts of others.
#[derive(Clone, Copy)]
pub struct Parts<'a> {
    /// For each cloud of the request the object that it belongs to, as the facts have them; parts are drawn as they
    /// are, and never merged.
    pub objects: &'a [PartOf],
    /// What graphs that ask for surfels as data get instead of the clouds: as many as the facts say.
    pub data: &'a [CloudView<'a>],
}

/// What a cloud belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartOf {
    /// Number of the object.
    pub object: u32,
    /// Whether it is a part of it rather than the whole.
    pub is_part: bool,
    /// Whether its surfels stand for several: round splats of such a part are as large as they are, however near.
    pub is_merged: bool,
}

/// Merged surfels of this radius in pixels are about as many as the pixels that they cover.
const MOVING_DETAIL_PX: f32 = 1.0;

impl<'a> RenderRequest<'a> {
    /// What a cloud of the request belongs to.
    pub(crate) fn part_of(&self, cloud: usize) -> PartOf {
        let object = u32::try_from(cloud).unwrap_or(u32::MAX);
        let own = PartOf { object, is_part: false, is_merged: false };
        self.parts.and_then(|parts| parts.objects.get(cloud).copied()).unwrap_or(own)
    }

    /// The clouds that are given as data.
    pub(crate) fn data(&self) -> &'a [CloudView<'a>] {
        self.parts.map_or(self.clouds, |parts| parts.data)
    }

    /// The request as surfels are drawn: a preview has fewer and larger ones, or merged ones where
    /// these can be had.
    pub(crate) fn drawn(&self, merged: bool, scene: &'a mut Scene) -> Self {
        let stride = self.stride.max(1);
        let coarser = (stride as f32).sqrt();
        if merged {
            let least = if stride > 1 { MOVING_DETAIL_PX * coarser } else { 0.0 };
            return RenderRequest { stride: 1, detail_px: self.detail_px.max(least), ..*self };
        }
        scene.surface.radius_scale *= coarser;
        RenderRequest { scene, stride, detail_px: 0.0, ..*self }
    }
}

/// A rendered frame.
#[derive(Clone, Debug, Default)]
pub struct Rendered {
    /// The requested pictures, in the order of the request.
    pub images: Vec<(Output, Image)>,
    /// The passes in the order they stand in the frame.
    pub passes: Vec<PassReport>,
    /// Bytes of the textures and buffers of the renderer's graph that the frame used, kept ones
    /// included.
    pub graph_bytes: u64,
    /// Whether surfels were merged where a detail asked for it: not all renderers take merged ones.
    pub merged: bool,
    /// Milliseconds in which columns were put in order and brought to where they are drawn.
    pub columns_ms: f64,
    /// Whether the renderer says that another frame would refine the picture.
    pub wants_another_frame: bool,
    /// Where several renderers drew it, what each drew; empty where one drew all. The passes of their graphs are
    /// called `RENDERER: PASS` then.
    pub parts: Vec<RendererPart>,
}

impl Rendered {
    /// The picture of an output, where it was requested.
    #[must_use]
    pub fn image(&self, output: &Output) -> Option<&Image> {
        self.images.iter().find(|(other, _)| other == output).map(|(_, image)| image)
    }
}

/// Which clouds of a picture a renderer draws, and what it draws itself of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct RendererPart {
    /// What the renderer is called.
    pub renderer: String,
    /// Numbers of its clouds.
    pub clouds: Vec<u32>,
    /// Those of them that its graph draws; the others are surfels of the host's surface, which it shades.
    pub taken: Vec<u32>,
    /// Bytes of its graph's textures and buffers that the frame used.
    pub graph_bytes: u64,
}
