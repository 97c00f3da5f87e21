//! The whole of a graph but for its bytes.

use crate::graph::cameras::SeenFrom;
use crate::graph::members::Member;
use crate::graph::passes::Pass;
use crate::graph::resources::{Buffer, Span, Texture, TextureId};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A picture a renderer offers.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Output {
    /// Linear Rec. 709 radiance and coverage in alpha, before exposure and tone mapping.
    Color,
    /// Distance along the viewing axis, scene units, in the first component; 0 where empty.
    Depth,
    /// Unit normal in world space; zero where empty.
    Normal,
    /// Linear Rec. 709 albedo.
    Albedo,
    /// Ambient accessibility in the first component.
    Ao,
    /// Something to look at while developing.
    Debug(String),
}

impl Output {
    /// The name on the command line and in files: `color`, `depth`, `debug.NAME`.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Color => "color".to_owned(),
            Self::Depth => "depth".to_owned(),
            Self::Normal => "normal".to_owned(),
            Self::Albedo => "albedo".to_owned(),
            Self::Ao => "ao".to_owned(),
            Self::Debug(name) => format!("debug.{name}"),
        }
    }

    /// The output of a name as in [`Output::name`]; `None` where there is none, and for `debug.`
    /// without a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "color" => Self::Color,
            "depth" => Self::Depth,
            "normal" => Self::Normal,
            "albedo" => Self::Albedo,
            "ao" => Self::Ao,
            _ => {
                let name = name.strip_prefix("debug.").filter(|name| !name.is_empty())?;
                Self::Debug(name.to_owned())
            }
        })
    }
}

/// Everything about a frame but the bytes of its uniforms and uploads.
///
/// Two frames with equal structure differ only in those bytes, so the host recompiles and
/// replans nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Structure {
    /// Textures, by [`TextureId`].
    pub textures: Vec<Texture>,
    /// Buffers, by [`BufferId`](super::BufferId).
    pub buffers: Vec<Buffer>,
    /// Where each uniform's bytes lie, by [`UniformId`](super::UniformId).
    pub uniforms: Vec<Span>,
    /// Passes in the order they run.
    pub passes: Vec<Pass>,
    /// What the renderer offers; the host adds depth, normal, albedo and ao of the surface.
    pub outputs: Vec<(Output, TextureId)>,
    /// Whether another frame would refine the picture.
    pub wants_another_frame: bool,
    /// Cameras besides the view's own, by [`CameraId`](super::CameraId). ABI 3.5.
    pub cameras: Vec<SeenFrom>,
    /// The members of uniforms that are given by name, by [`UniformId`](super::UniformId): their bytes lie
    /// packed in the uniform's, and the host lays them out. ABI 3.7.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub members: BTreeMap<u32, Vec<Member>>,
    /// Clouds that the graph draws itself, by their number in [`CloudFacts::clouds`](crate::CloudFacts::clouds). ABI 3.9.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub taken: Vec<u32>,
    /// Whether the colour goes over what other renderers draw behind it as sRGB-encoded numbers. ABI 3.10.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub encoded_over: bool,
}
