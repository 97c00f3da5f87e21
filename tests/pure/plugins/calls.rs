//! Faults of a loaded plugin: each call fails with a line that says where, and nothing else
//! happens.

use crate::plugins::fixture::{
    assert_makes_graph, assert_says, faulty_registry, load, panic_line, request,
};
use std::sync::Mutex;
use surfelshop_api::columns::{AO, CloudView, ColumnView, Element, POSITION, Values};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::{Value, Values as ParamValues};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_api::{Error, HostInfo, Result, Tile, Traced, UnitKind};
use surfelshop_runtime::boundary::Fault;

/// A host that keeps what a tool stages if it fits the cloud.
#[derive(Default)]
struct RecordingHost {
    n_surfels: usize,
    staged: Mutex<Vec<(EditHeader, Vec<Vec<u8>>)>>,
    progress: Mutex<Vec<f64>>,
    cancelled: bool,
}

impl JobHost for RecordingHost {
    fn progress(&self, fraction: f64, _message: &str) {
        self.progress.lock().unwrap().push(fraction);
    }

    fn cancelled(&self) -> bool {
        self.cancelled
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let fits = values.iter().all(|bytes| bytes.len() == 4 * self.n_surfels);
        if !fits {
            return Err(Error::new(format!("a column must have {} values", self.n_surfels)));
        }
        let values = values.iter().map(|bytes| bytes.to_vec()).collect();
        self.staged.lock().unwrap().push((header.clone(), values));
        Ok(())
    }
}

fn cloud(positions: &[f32]) -> CloudView<'_> {
    let values = Values::F32(positions);
    let position = ColumnView { name: POSITION, components: 3, generation: 1, values };
    CloudView { len: positions.len() / 3, columns: vec![position], ..CloudView::default() }
}

const TILE: Tile = Tile { x: 2, y: 1, width: 2, height: 1, sample: 0 };

#[test]
fn panic_in_describe_names_plugin_file_and_place() {
    let registry = faulty_registry();
    let unit = registry.find(UnitKind::Renderer, "panics-in-describe").unwrap();
    let line = registry.load(&unit).unwrap_err().to_string();
    let file = unit.path.display().to_string();
    assert_says(&line, &["org.surfelshop.test.faulty/panics-in-describe", &file]);
    assert_says(&line, &["panicked at", "calls.rs:", "declare goes wrong"]);
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn panic_in_new() {
    let unit = load(UnitKind::Renderer, "panics-in-new");
    let line = panic_line(unit.create(&HostInfo::default()));
    assert_says(&line, &["panicked at", "calls.rs:", "new goes wrong"]);
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

/// Invariant: a plugin that panics harms nothing else
#[test]
fn panic_in_frame_every_time() {
    let unit = load(UnitKind::Renderer, "panics-in-frame");
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    for _ in 0..3 {
        let line = panic_line(instance.frame(&request()));
        assert_says(&line, &["panicked at", "calls.rs:", "frame goes wrong"]);
    }
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn panic_whose_payload_panics() {
    let unit = load(UnitKind::Renderer, "panics-twice");
    let line = panic_line(unit.create(&HostInfo::default()).unwrap().frame(&request()));
    assert_says(&line, &["panicked at", "calls.rs:", "a value that is not text"]);
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn panic_in_drop() {
    let unit = load(UnitKind::Renderer, "panics-in-drop");
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    assert!(instance.frame(&request()).is_ok());
    drop(instance);
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn panic_in_tile() {
    let unit = load(UnitKind::Tracer, "panics-in-tile");
    let instance = unit.create(&HostInfo::default()).unwrap();
    let mut pixels = [0.0; 8];
    let line = panic_line(instance.tile(
        &request(),
        &Traced::default(),
        TILE,
        &mut pixels,
        &RecordingHost::default(),
    ));
    assert_says(&line, &["panicked at", "calls.rs:", "tile goes wrong"]);
}

#[test]
fn panics_in_many_threads_keep_their_own_lines() {
    let tracer = load(UnitKind::Tracer, "panics-in-tile");
    let tracer = tracer.create(&HostInfo::default()).unwrap();
    let renderer = load(UnitKind::Renderer, "panics-in-frame");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..50 {
                    let desk = RecordingHost::default();
                    let traced =
                        tracer.tile(&request(), &Traced::default(), TILE, &mut [0.0; 8], &desk);
                    assert_says(&panic_line(traced), &["tile goes wrong"]);
                }
            });
            scope.spawn(|| {
                let mut instance = renderer.create(&HostInfo::default()).unwrap();
                for _ in 0..50 {
                    let line = panic_line(instance.frame(&request()));
                    assert_says(&line, &["frame goes wrong"]);
                }
            });
        }
    });
}

#[test]
fn panic_in_run_after_an_edit_was_staged() {
    let unit = load(UnitKind::Tool, "panics-in-run");
    let desk = RecordingHost { n_surfels: 2, ..RecordingHost::default() };
    let positions = [0.0; 6];
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    let line = panic_line(instance.run(&ParamValues::new(), &cloud(&positions), &desk));
    assert_says(&line, &["panicked at", "calls.rs:", "run goes wrong"]);
    assert_eq!(desk.staged.lock().unwrap().len(), 1, "it is the host that drops the edit");
}

#[test]
fn error_is_shown_on_one_line() {
    let unit = load(UnitKind::Renderer, "returns-error");
    let fault = unit.create(&HostInfo::default()).unwrap().frame(&request()).unwrap_err();
    assert_eq!(fault, Fault::Error("the moon is not full".to_owned()));
}

#[test]
fn refused_edit_reaches_the_tool_with_the_hosts_reason() {
    let unit = load(UnitKind::Tool, "wrong-length-edit");
    let desk = RecordingHost { n_surfels: 2, ..RecordingHost::default() };
    let positions = [0.0; 6];
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    let result = instance.run(&ParamValues::new(), &cloud(&positions), &desk);
    assert_eq!(result, Err(Fault::Error("a column must have 2 values".to_owned())));
    assert!(desk.staged.lock().unwrap().is_empty());
}

#[test]
fn good_tool_stages_its_column() {
    let unit = load(UnitKind::Tool, "stages-ao");
    let desk = RecordingHost { n_surfels: 2, ..RecordingHost::default() };
    let positions = [0.0; 6];
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    instance.run(&ParamValues::new(), &cloud(&positions), &desk).unwrap();
    let column = ColumnHeader { name: AO.to_owned(), components: 1, element: Element::F32 };
    let half = 0.5f32.to_le_bytes().repeat(2);
    let expected = [(EditHeader::Columns(vec![column]), vec![half])];
    assert_eq!(*desk.staged.lock().unwrap(), expected);
    assert_eq!(*desk.progress.lock().unwrap(), [0.0, 1.0]);
}

#[test]
fn good_tracer_fills_its_tile() {
    let unit = load(UnitKind::Tracer, "gradient");
    let instance = unit.create(&HostInfo::default()).unwrap();
    let mut pixels = [0.0; 8];
    let desk = RecordingHost::default();
    instance.tile(&request(), &Traced::default(), TILE, &mut pixels, &desk).unwrap();
    assert_eq!(pixels, [0.625, 0.75, 0.0, 1.0, 0.875, 0.75, 0.0, 1.0]);
    let short =
        instance.tile(&request(), &Traced::default(), TILE, &mut pixels[..4], &desk).unwrap_err();
    assert_says(&short.to_string(), &["2 x 1 needs 8 floats, 4 given"]);
    let desk = RecordingHost { cancelled: true, ..desk };
    let cancelled = instance.tile(&request(), &Traced::default(), TILE, &mut pixels, &desk);
    assert_eq!(cancelled, Err(Fault::Error("cancelled".to_owned())));
}

#[test]
fn calls_of_another_kind_of_unit_are_errors() {
    let mut renderer = load(UnitKind::Renderer, "fine").create(&HostInfo::default()).unwrap();
    let desk = RecordingHost::default();
    let tile = renderer.tile(&request(), &Traced::default(), TILE, &mut [0.0; 8], &desk);
    assert_says(&tile.unwrap_err().to_string(), &["not a tracer"]);
    let run = renderer.run(&ParamValues::new(), &cloud(&[]), &desk);
    assert_says(&run.unwrap_err().to_string(), &["not a tool"]);
    let mut tool = load(UnitKind::Tool, "stages-ao").create(&HostInfo::default()).unwrap();
    assert_says(&tool.frame(&request()).unwrap_err().to_string(), &["not a renderer"]);
}

#[test]
fn values_of_wrong_kind_or_range_are_brought_into_range() {
    let unit = load(UnitKind::Renderer, "fine");
    let ids: Vec<&str> = unit.description.params.iter().map(|p| p.id.as_str()).collect();
    assert_eq!(ids, ["gain", "steps"]);
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    let mut gain = |value: Value| {
        let mut request = request();
        request.values.insert("gain".to_owned(), value);
        let data = instance.frame(&request).unwrap().data;
        f32::from_le_bytes(data.try_into().unwrap())
    };
    assert_eq!(gain(Value::Float(2.5)), 2.5);
    assert_eq!(gain(Value::Float(1e30)), 4.0);
    assert_eq!(gain(Value::Float(f64::NAN)), 1.0);
    assert_eq!(gain(Value::Text("loud".to_owned())), 1.0);
}
