//! Tools of the faulty plugin, and a cloud for them.

use glam::DVec3;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::GpuOptions;
use surfelshop_runtime::plugins::{
    LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust, UnitRef,
};
use surfelshop_runtime::tools::{Done, Ended, Running, ToolOptions};
use surfelshop_tests::stage::build_folder;

/// Short, so that a test that must wait for a deadline does not take long, and long enough for a
/// busy machine to stop a tool that does as it is told.
pub(crate) const CANCEL: Duration = Duration::from_secs(2);

/// A tool of the faulty plugin, found and loaded.
pub(crate) fn tool(id: &str) -> (UnitRef, LoadedUnit) {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = build_folder().join("examples").join(format!("{prefix}faulty{suffix}"));
    assert!(path.is_file(), "{} is not built; `cargo verify` builds it", path.display());
    let files = vec![Place::new(path, Origin::CommandLine)];
    let registry =
        Registry::scan(&SearchPath { files, trust: Trust::everything(), ..SearchPath::default() });
    let reference = registry.find(UnitKind::Tool, id).unwrap();
    let unit = registry.load(&reference).unwrap_or_else(|error| panic!("{error}"));
    (reference, unit)
}

/// Surfels on a spiral, with radii that differ.
pub(crate) fn cloud(n_surfels: usize) -> Cloud {
    let at = |i: usize| (i as f32 * 0.1, 1.0 + i as f32 * 1e-3);
    let place = |i| [at(i).1 * at(i).0.cos(), at(i).1 * at(i).0.sin(), at(i).1];
    let position = (0..n_surfels).flat_map(place).collect();
    let normal = [0.0, 0.0, 1.0].repeat(n_surfels);
    let radius = (0..n_surfels).map(|i| 0.01 + i as f32 * 1e-5).collect();
    let column = |name: &str, n, values| Column::new(name, n, Buffer::F32(values));
    let columns = vec![
        column("position", 3, position),
        column("normal", 3, normal),
        column("radius", 1, radius),
    ];
    Cloud::new(DVec3::new(1e6, 0.0, 0.0), columns).unwrap()
}

/// Generations of all columns: equal ones mean the very same values.
pub(crate) fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

pub(crate) fn options() -> ToolOptions {
    let patience = Timeouts { cancel: CANCEL, ..Timeouts::default() };
    ToolOptions { patience, device: GpuOptions::default().into(), ..ToolOptions::default() }
}

pub(crate) fn values<const N: usize>(values: [(&str, Value); N]) -> Values {
    values.into_iter().map(|(id, value)| (id.to_owned(), value)).collect()
}

/// Starts a tool.
pub(crate) fn start(id: &str, values: &Values, cloud: &Cloud, options: &ToolOptions) -> Running {
    Running::start(&tool(id).1, values, cloud, options).unwrap()
}

/// Waits for the end of a run, a minute at most.
#[track_caller]
pub(crate) fn end(mut running: Running) -> Ended {
    let ended = running.wait(Duration::from_secs(60));
    ended.unwrap_or_else(|| panic!("still at work: {:?}", running.progress()))
}

/// Runs a tool that does its work.
#[track_caller]
pub(crate) fn done(id: &str, values: &Values, cloud: &Cloud, options: &ToolOptions) -> Done {
    match end(start(id, values, cloud, options)) {
        Ended::Done(done) => *done,
        other => panic!("{other:?}"),
    }
}
