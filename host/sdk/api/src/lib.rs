//! What a Surfelshop plugin links: the unit traits, the graph a renderer describes its frame with,
//! parameters, columns and [`export_plugin!`].
//!
//! A plugin never touches the GPU. A [`Renderer`] receives a [`Frame`] (camera, lights, facts of
//! the cloud, its own parameters) and describes the frame as a [`Graph`]; the host checks it,
//! compiles it, leaves out what nobody reads, times every pass and runs it. A [`Tracer`] writes
//! pixels on the CPU, a [`Tool`] edits columns of a cloud, a [`Format`] reads and writes files.
//!
//! Invariants: this crate knows no graphics API, window or file; a plugin author writes no
//! `unsafe`; everything that crosses the boundary is either a C structure declared in [`abi`] or
//! msgpack with named fields, so that older and newer plugins can be read.
//!
//! ```
//! use surfelshop_api::prelude::*;
//!
//! params! {
//!     /// Settings of this renderer.
//!     pub struct Settings {
//!         /// Brightness of the result.
//!         gain: f32 { default: 1.0, range: 0.0..=4.0 },
//!     }
//! }
//!
//! struct Plain;
//!
//! impl Renderer for Plain {
//!     const INFO: UnitInfo = UnitInfo::new("plain", "Plain", "Shows the albedo.");
//!     type Params = Settings;
//!     fn new(_host: &HostInfo) -> Result<Self> { Ok(Plain) }
//!     fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
//!         let settings = graph.uniform(Uniform::new().f32(frame.params.gain));
//!         let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
//!         graph.pass(Pass::shading("shade", SHADER, "shade").target(color).bind("settings", settings));
//!         graph.output(Output::Color, color);
//!         Ok(())
//!     }
//! }
//!
//! const SHADER: &str = "
//!     #import surfelshop::surface::Surface
//!     struct Settings { gain: f32 }
//!     var<uniform> settings: Settings;
//!     fn shade(s: Surface) -> vec4<f32> { return vec4(s.albedo * settings.gain, 1.0); }
//! ";
//!
//! export_plugin! { id: "org.example.plain", renderers: [Plain] }
//! # fn main() {}
//! ```

pub mod abi;
pub mod columns;
mod error;
mod export;
pub mod format;
#[doc(hidden)]
pub mod frame;
pub mod graph;
pub mod guide;
pub mod job;
pub mod manifest;
mod need;
pub mod params;
mod scene;
mod stroke;
pub mod tool;
mod uniform;
mod unit;
mod unit_info;

pub use columns::{CloudView, ColumnView};
pub use error::{Error, Result, ResultExt};
pub use format::Format;
pub use frame::{DeviceLimits, Frame, FrameRequest, HostInfo};
pub use glam;
pub use graph::Graph;
pub use job::Job;
pub use need::{Need, NeedInfo};
pub use scene::camera::{Camera, Projection, View};
pub use scene::cloud_facts::{CloudFacts, CloudInfo, ColumnInfo};
pub use scene::environment::{Environment, EnvironmentFacts, EnvironmentView, Sun};
pub use scene::light::{Arriving, Lamp, Light};
pub use scene::object::ObjectFrame;
pub use scene::occlusion::{AoAffects, Occlusion};
pub use scene::phong::Phong;
pub use scene::{Scene, SurfaceSettings};
pub use stroke::{Dabs, Falloff, Handling, Reach, Stroke, StrokeCall, StrokeSample};
pub use tool::{Edit, Tile, Traced};
pub use uniform::Uniform;
pub use unit::{Limit, LimitInfo, Renderer, Scope, Tool, Tracer};
pub use unit_info::{UnitInfo, UnitKind};

/// Everything a plugin usually needs.
pub mod prelude {
    pub use crate::columns::{self, CloudView, ColumnView, Values};
    pub use crate::graph::{
        Buffer, BufferColumn, Columns, Composition, Footprint, Format, Graph, Groups, Members,
        Output, Pass, SamplerKind, SplatDepth, SurfaceMode, Target, Texture, TextureId,
    };
    pub use crate::params::FilePath;
    pub use crate::tool::NewColumn;
    pub use crate::{
        AoAffects, Camera, CloudFacts, CloudInfo, Edit, Environment, Error, Frame, Handling,
        HostInfo, Job, Light, LimitInfo, NeedInfo, Projection, Renderer, Result, ResultExt, Scope,
        Tile, Tool, Traced, Tracer, Uniform, UnitInfo, View, choices, export_plugin, params,
    };
}
