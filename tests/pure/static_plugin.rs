//! A plugin registered inside the program: the whole boundary without loading a library, so that
//! Miri can check its pointers.

use std::cell::{Cell, RefCell};
use std::ops::Range;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::columns::{AO, POSITION, Values};
use surfelshop_api::graph::Structure;
use surfelshop_api::job::JobHost;
use surfelshop_api::params::{Value, Values as ParamValues};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::{EditHeader, NewColumn};
use surfelshop_api::{CloudFacts, FrameRequest, Scene, UnitKind, View, glam::DVec3, manifest};
use surfelshop_runtime::boundary::{Fault, Plugin};

params! {
    /// Parameters of the renderer.
    pub struct Settings {
        /// A factor.
        gain: f32 { default: 1.0, range: 0.0..=4.0 },
    }
}

struct Plain {
    n_frames: u32,
}

impl Renderer for Plain {
    const INFO: UnitInfo = UnitInfo::new("plain", "Plain", "Shows the albedo.");
    type Params = Settings;

    fn new(host: &HostInfo) -> Result<Self> {
        match host.adapter.as_str() {
            "" => Err(Error::new("expected an adapter, found none")),
            "panic" => panic!("no such adapter"),
            _ => Ok(Self { n_frames: 0 }),
        }
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        self.n_frames += 1;
        assert!(self.n_frames < 3, "frame {} is one too many", self.n_frames);
        let settings = graph.uniform(Uniform::new().f32(frame.params.gain));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("shade", "", "shade").target(color).bind("settings", settings));
        graph.output(Output::Color, color);
        Ok(())
    }
}

struct Sum;

impl Tracer for Sum {
    const INFO: UnitInfo = UnitInfo::new("sum", "Sum", "Adds up what it is given.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn tile(
        &self,
        _frame: &Frame<()>,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        job.check()?;
        let positions = scene.clouds.iter().flat_map(|cloud| cloud.vectors(POSITION));
        let sum: f32 = positions.map(|position| position.element_sum()).sum();
        pixels.fill(sum + tile.x as f32);
        Ok(())
    }
}

/// Stages an edit of every kind, with columns of every type.
struct Stager;

impl Tool for Stager {
    const INFO: UnitInfo = UnitInfo::new("stager", "Stager", "Stages edits.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        job.progress(0.5, "halfway");
        let values = vec![params.gain; cloud.len];
        let column = |values| NewColumn { name: AO, components: 1, values };
        job.edit(&Edit::Columns(vec![column(Values::F32(&values))]))?;
        job.edit(&Edit::Keep(vec![true, false].into()))?;
        let columns = vec![column(Values::U8(&[7])), column(Values::F64(&[1.0]))];
        job.edit(&Edit::NewCloud { origin: DVec3::X, columns })?;
        job.edit(&Edit::Columns(Vec::new()))
    }
}

/// Squares indices in a parallel loop, which goes wrong at item number `gain`, and has a graph run.
struct Looper;

impl Tool for Looper {
    const INFO: UnitInfo = UnitInfo::new("looper", "Looper", "Loops.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let squares = job.map(cloud.len, 0.25..0.75, |i| {
            assert!(i + 1 != params.gain as usize, "{i} goes wrong");
            (i * i) as u32
        })?;
        let mut graph = Graph::new();
        let [a, b] = [1, 2].map(|byte| graph.upload("upload", &[byte; 4]));
        let read = job.compute(&graph, &[b, a])?;
        assert_eq!(read, [[1; 4], [0; 4]], "the host below answers with the positions");
        let faces: Vec<u32> = cloud.faces.iter().flatten().copied().collect();
        let columns = vec![
            NewColumn { name: "squares", components: 1, values: Values::U32(&squares) },
            NewColumn { name: "faces", components: 1, values: Values::U32(&faces) },
        ];
        job.edit(&Edit::Columns(columns))
    }
}

surfelshop_api::static_plugin! {
    id: "org.surfelshop.test.static",
    renderers: [Plain],
    tracers: [Sum],
    tools: [Stager, Looper],
}

/// Positions of the units in the manifest.
const PLAIN: u32 = 0;
const SUM: u32 = 1;
const STAGER: u32 = 2;
const LOOPER: u32 = 3;

/// A host that accepts edits until it is told not to.
#[derive(Default)]
struct RecordingHost {
    refuses: bool,
    cancelled: Cell<bool>,
    progress: RefCell<Vec<(f64, String)>>,
    staged: RefCell<Vec<(EditHeader, Vec<Vec<u8>>)>>,
}

impl JobHost for RecordingHost {
    fn progress(&self, fraction: f64, message: &str) {
        self.progress.borrow_mut().push((fraction, message.to_owned()));
    }

    fn cancelled(&self) -> bool {
        self.cancelled.get()
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        if self.refuses {
            return Err(Error::new("the cloud is locked"));
        }
        let values = values.iter().map(|bytes| bytes.to_vec()).collect();
        self.staged.borrow_mut().push((header.clone(), values));
        Ok(())
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        self.progress(share.end, "looped");
        std::thread::scope(|scope| {
            for start in (0..count).rev().step_by(3) {
                scope.spawn(move || work((start + 1).saturating_sub(3)..start + 1));
            }
        });
        !self.cancelled()
    }

    fn compute(&self, graph: &EncodedGraph, buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        if self.refuses {
            return Err(Error::new("no device"));
        }
        assert_eq!(graph.data, [1, 1, 1, 1, 2, 2, 2, 2]);
        Ok(buffers.iter().map(|&buffer| vec![buffer as u8; 4]).collect())
    }
}

fn plugin() -> Plugin {
    Plugin::of::<SurfelshopPackage>()
}

fn host() -> HostInfo {
    HostInfo { adapter: "none".to_owned(), ..HostInfo::default() }
}

fn request() -> FrameRequest {
    let camera = Camera {
        eye: DVec3::Z,
        target: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 1.0 },
    };
    FrameRequest {
        view: View { camera, size_px: [2, 1], near: 0.1, far: 10.0 },
        scene: Scene::default(),
        cloud: CloudFacts::default(),
        frame_index: 0,
        values: ParamValues::from([("gain".to_owned(), Value::Float(2.0))]),
        environment: None,
    }
}

fn cloud(positions: &[f32]) -> CloudView<'_> {
    let values = Values::F32(positions);
    let position = ColumnView { name: POSITION, components: 3, generation: 1, values };
    CloudView { len: positions.len() / 3, columns: vec![position], ..CloudView::default() }
}

#[test]
fn manifest_lists_the_units_in_the_order_of_their_positions() {
    let manifest = manifest::decode(&SURFELSHOP_STATIC_MANIFEST).unwrap();
    let units: Vec<_> = manifest.units.iter().map(|u| (u.kind, u.id.as_str())).collect();
    let expected = [
        (UnitKind::Renderer, "plain"),
        (UnitKind::Tracer, "sum"),
        (UnitKind::Tool, "stager"),
        (UnitKind::Tool, "looper"),
    ];
    assert_eq!(units, expected);
    assert_eq!(manifest.license, env!("CARGO_PKG_LICENSE"));
}

#[test]
fn units_describe_their_parameters() {
    assert_eq!(plugin().describe(PLAIN).unwrap().params[0].id, "gain");
    assert!(plugin().describe(SUM).unwrap().params.is_empty());
    let fault = plugin().describe(4).unwrap_err();
    assert_eq!(fault, Fault::Error("unit 4 was asked for, the plugin has 4".to_owned()));
}

#[test]
fn renderer_describes_frames_and_its_panic_is_contained() {
    let mut instance = plugin().create(PLAIN, &host()).unwrap();
    for _ in 0..2 {
        let graph = instance.frame(&request()).unwrap();
        let structure: Structure = rmp_serde::from_slice(&graph.structure).unwrap();
        assert_eq!(structure.passes[0].name, "shade");
        assert_eq!(graph.data, 2.0f32.to_le_bytes());
    }
    let Err(Fault::Panic(line)) = instance.frame(&request()) else { panic!("expected a panic") };
    assert!(line.contains("static_plugin.rs:") && line.ends_with("3 is one too many"), "{line}");
}

#[test]
fn failures_to_make_an_instance_come_as_they_are() {
    let error = plugin().create(PLAIN, &HostInfo::default()).err();
    assert_eq!(error, Some(Fault::Error("expected an adapter, found none".to_owned())));
    let panics = HostInfo { adapter: "panic".to_owned(), ..HostInfo::default() };
    assert!(matches!(plugin().create(PLAIN, &panics).err(), Some(Fault::Panic(_))));
}

#[test]
fn tracer_reads_clouds_and_writes_its_tile_from_several_threads() {
    let instance = plugin().create(SUM, &host()).unwrap();
    let (near, far) = ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    std::thread::scope(|scope| {
        for x in 0..3u8 {
            let instance = &instance;
            let clouds = [cloud(&near), cloud(&far), CloudView::default()];
            scope.spawn(move || {
                let tile = Tile { x: x.into(), y: 0, width: 1, height: 2, sample: 0 };
                let mut pixels = [0.0; 8];
                instance
                    .tile(
                        &request(),
                        &Traced { clouds: &clouds, texels: &[] },
                        tile,
                        &mut pixels,
                        &RecordingHost::default(),
                    )
                    .unwrap();
                assert_eq!(pixels, [45.0 + f32::from(x); 8]);
            });
        }
    });
}

#[test]
fn tracer_without_clouds_or_pixels_is_fine_and_sees_the_cancellation() {
    let instance = plugin().create(SUM, &host()).unwrap();
    let tile = Tile { x: 0, y: 0, width: 0, height: 3, sample: 0 };
    let desk = RecordingHost::default();
    instance.tile(&request(), &Traced::default(), tile, &mut [], &desk).unwrap();
    assert!(instance.tile(&request(), &Traced::default(), tile, &mut [0.0], &desk).is_err());
    desk.cancelled.set(true);
    let cancelled = instance.tile(&request(), &Traced::default(), tile, &mut [], &desk);
    assert_eq!(cancelled, Err(Fault::Error("cancelled".to_owned())));
}

#[test]
fn tool_stages_edits_of_every_kind() {
    let mut instance = plugin().create(STAGER, &host()).unwrap();
    let (desk, positions) = (RecordingHost::default(), [0.0; 6]);
    instance.run(&request().values, &cloud(&positions), &desk).unwrap();
    let staged = desk.staged.borrow();
    assert_eq!(*desk.progress.borrow(), [(0.5, "halfway".to_owned())]);
    assert_eq!(staged[0].1, [2.0f32.to_le_bytes().repeat(2)]);
    assert_eq!(staged[1], (EditHeader::Keep, vec![vec![1, 0]]));
    let EditHeader::NewCloud { origin, columns } = &staged[2].0 else { panic!("{staged:?}") };
    assert_eq!((*origin, columns.len()), (DVec3::X, 2));
    assert_eq!(staged[2].1, [vec![7], 1.0f64.to_le_bytes().to_vec()]);
    assert_eq!(staged[3], (EditHeader::Columns(Vec::new()), Vec::new()));
}

#[test]
fn refusal_of_an_edit_reaches_the_tool() {
    let mut instance = plugin().create(STAGER, &host()).unwrap();
    let (desk, positions) = (RecordingHost { refuses: true, ..RecordingHost::default() }, [0.0; 6]);
    let result = instance.run(&ParamValues::new(), &cloud(&positions), &desk);
    assert_eq!(result, Err(Fault::Error("the cloud is locked".to_owned())));
}

#[test]
fn calls_of_another_kind_are_errors() {
    let mut instance = plugin().create(STAGER, &host()).unwrap();
    let fault = instance.frame(&request()).unwrap_err();
    assert_eq!(fault, Fault::Error("this unit is not a renderer".to_owned()));
}

#[test]
fn loop_covers_every_index_once_on_other_threads_and_a_graph_runs() {
    let mut instance = plugin().create(LOOPER, &host()).unwrap();
    let (desk, positions) = (RecordingHost::default(), [0.0; 30]);
    let mesh = CloudView { faces: &[[0, 1, 2], [2, 1, 3]], ..cloud(&positions) };
    let values = ParamValues::from([("gain".to_owned(), Value::Float(0.0))]);
    instance.run(&values, &mesh, &desk).unwrap();
    let squares: Vec<u8> = (0..10u32).flat_map(|i| (i * i).to_le_bytes()).collect();
    let corners: Vec<u8> = [0u32, 1, 2, 2, 1, 3].into_iter().flat_map(u32::to_le_bytes).collect();
    assert_eq!(desk.staged.borrow()[0].1, [squares, corners]);
    assert_eq!(*desk.progress.borrow(), [(0.75, "looped".to_owned())]);
}

#[test]
fn panic_in_a_loop_on_another_thread_is_contained() {
    let mut instance = plugin().create(LOOPER, &host()).unwrap();
    let values = ParamValues::from([("gain".to_owned(), Value::Float(4.0))]);
    let (desk, positions) = (RecordingHost::default(), [0.0; 30]);
    let fault = instance.run(&values, &cloud(&positions), &desk).unwrap_err();
    let Fault::Panic(line) = fault else { panic!("expected a panic, got {fault:?}") };
    assert!(line.contains("static_plugin.rs:") && line.ends_with("3 goes wrong"), "{line}");
    assert!(desk.staged.borrow().is_empty());
}

#[test]
fn cancelled_loop_and_refused_graph_are_errors() {
    let mut instance = plugin().create(LOOPER, &host()).unwrap();
    let values = ParamValues::from([("gain".to_owned(), Value::Float(0.0))]);
    let positions = [0.0; 30];
    let desk = RecordingHost { refuses: true, ..RecordingHost::default() };
    let refused = instance.run(&values, &cloud(&positions), &desk);
    assert_eq!(refused, Err(Fault::Error("no device".to_owned())));
    let desk = RecordingHost { cancelled: Cell::new(true), ..RecordingHost::default() };
    let cancelled = instance.run(&values, &cloud(&positions), &desk);
    assert_eq!(cancelled, Err(Fault::Error("cancelled".to_owned())));
}
