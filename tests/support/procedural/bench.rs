//! Runs the plugin's tool at chosen places.

use super::noise::Place;
use super::patterns::Settings;
use crate::stage;
use glam::{DMat3, DVec3, Vec3};
use std::cell::RefCell;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS, Values as ColumnValues};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{CloudView, ColumnView, Error, ObjectFrame, Result, UnitKind};
use surfelshop_render::{Engine, GpuOptions};
use surfelshop_runtime::boundary::{Fault, Instance};

/// A surfel of a cloud to be baked.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// From the cloud's origin, scene units.
    pub offset: Vec3,
    /// Unit length.
    pub normal: Vec3,
    /// Scene units.
    pub radius: f32,
    /// Linear albedo.
    pub albedo: Vec3,
}

impl Spot {
    /// The place in a pattern, not turned and not scaled, that the tool has for it: the same square
    /// in its plane.
    #[must_use]
    pub fn place(&self, origin: DVec3, object: &ObjectFrame, filtered: bool) -> Place {
        let position = object.box_from_world(origin + self.offset.as_dvec3());
        let (u, v) = self.normal.as_dvec3().normalize_or(DVec3::Y).any_orthonormal_pair();
        let width = if filtered { f64::from(self.radius) } else { 0.0 };
        let to_box = DMat3::from_quat(object.rotation.inverse()) * (width / object.size);
        Place { position, across: to_box * u, along: to_box * v, jitter: DVec3::ZERO }
    }
}

/// The tool on a device.
pub struct Bench {
    engine: RefCell<Engine>,
    tool: Instance,
}

struct RecordingHost<'a> {
    engine: &'a RefCell<Engine>,
    colors: RefCell<Vec<f32>>,
}

impl JobHost for RecordingHost<'_> {
    fn progress(&self, _fraction: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let EditHeader::Columns(columns) = header else { return Err(Error::new("columns")) };
        assert!(columns.len() == 1 && columns[0].name == COLOR, "{columns:?}");
        let floats = values[0].as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        *self.colors.borrow_mut() = floats.collect();
        Ok(())
    }

    fn compute(&self, graph: &EncodedGraph, buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        let computed = self.engine.borrow_mut().compute(graph, buffers);
        computed.map_err(|error| Error::new(error.to_string()))
    }
}

impl Bench {
    /// The tool on the adapter of these options.
    ///
    /// # Panics
    /// Where there is none, or the plugin was not built.
    #[must_use]
    pub fn new(gpu: &GpuOptions) -> Self {
        let engine = stage::engine_with(gpu, &surfelshop_render::EngineOptions::default());
        let loaded = stage::built_unit("surfelshop-procedural", UnitKind::Tool, "procedural");
        let tool = loaded.create(&engine.gpu().host_info()).expect("the tool starts");
        Self { engine: RefCell::new(engine), tool }
    }

    /// The device's own description.
    #[must_use]
    pub fn device(&self) -> String {
        self.engine.borrow().gpu().describe()
    }

    /// The colours of spots around an origin.
    ///
    /// # Errors
    /// The tool's own.
    pub fn colors(
        &mut self,
        spots: &[Spot],
        origin: DVec3,
        object: ObjectFrame,
        values: &Values,
    ) -> std::result::Result<Vec<DVec3>, Fault> {
        let vectors = |of: &dyn Fn(&Spot) -> Vec3| -> Vec<f32> {
            spots.iter().flat_map(|spot| of(spot).to_array()).collect()
        };
        let radii: Vec<f32> = spots.iter().map(|spot| spot.radius).collect();
        let columns = [
            (POSITION, 3, vectors(&|spot| spot.offset)),
            (NORMAL, 3, vectors(&|spot| spot.normal)),
            (COLOR, 3, vectors(&|spot| spot.albedo)),
            (RADIUS, 1, radii),
        ];
        let columns: Vec<ColumnView<'_>> = columns
            .iter()
            .map(|(name, components, values)| ColumnView {
                name,
                components: *components,
                generation: 1,
                values: ColumnValues::F32(values),
            })
            .collect();
        let cloud = CloudView { origin, len: spots.len(), columns, object, ..CloudView::default() };
        let desk = RecordingHost { engine: &self.engine, colors: RefCell::default() };
        self.tool.run(values, &cloud, &desk)?;
        let colors = desk.colors.into_inner();
        Ok(colors.as_chunks::<3>().0.iter().map(|c| Vec3::from(*c).as_dvec3()).collect())
    }
}

impl Settings {
    /// The parameters that ask for the same of the plugin.
    #[must_use]
    pub fn values(&self, pattern: &str) -> Values {
        let float = |value: f32| Value::Float(f64::from(value));
        [
            ("pattern", Value::Text(pattern.to_owned())),
            ("frequency", float(self.frequency)),
            ("octaves", Value::Int(i64::from(self.octaves))),
            ("lacunarity", float(self.lacunarity)),
            ("gain", float(self.gain)),
            ("warp", float(self.warp)),
            ("seed", Value::Int(i64::from(self.seed))),
        ]
        .into_iter()
        .map(|(id, value)| (id.to_owned(), value))
        .collect()
    }
}
