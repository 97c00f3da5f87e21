//! The tools of `plugins/preparation` as the host has them: loaded from their library, over clouds
//! read from files.

use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions};
use surfelshop_runtime::plugins::{LoadedUnit, Origin, Place, Registry, SearchPath, Trust};
use surfelshop_tests::recording_host::RecordingHost;
use surfelshop_tests::stage;

/// Edits with the bytes of their columns.
type StagedColumns = Vec<(EditHeader, Vec<Vec<u8>>)>;

const TOOLS: [&str; 5] = ["normals", "radii", "outliers", "thin", "sample"];

/// The tools, loaded.
fn tools() -> Vec<LoadedUnit> {
    let (before, after) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = stage::build_folder().join(format!("{before}surfelshop_preparation{after}"));
    assert!(path.exists(), "{} is missing: `cargo verify` builds it", path.display());
    let files = vec![Place::new(path, Origin::CommandLine)];
    let registry =
        Registry::scan(&SearchPath { files, trust: Trust::everything(), ..SearchPath::default() });
    let load = |id: &&str| registry.load(&registry.find(UnitKind::Tool, id).unwrap()).unwrap();
    TOOLS.iter().map(load).collect()
}

/// What a tool stages.
fn run(tool: &LoadedUnit, cloud: &Cloud, values: &Values, threads: usize) -> StagedColumns {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let desk = RecordingHost::default();
    let mut instance = tool.create(&HostInfo::default()).unwrap();
    pool.install(|| instance.run(values, &cloud.view(), &desk)).unwrap();
    let staged = desk.staged.into_inner().unwrap();
    assert!(!staged.is_empty(), "{}", tool.unit.id);
    staged
}

/// A bumpy patch with colours, as an OBJ file.
fn patch() -> Cloud {
    const SIDE: u32 = 60;
    let mut text = String::new();
    for i in 0..SIDE * SIDE {
        let (x, y) = (f64::from(i % SIDE), f64::from(i / SIDE));
        let z = (x * 0.3).sin() + (y * 0.2).cos();
        let red = x / f64::from(SIDE);
        text += &format!("v {x} {y} {z} {red} 0.5 0.25\n");
    }
    for i in 0..SIDE * (SIDE - 1) {
        if i % SIDE != SIDE - 1 {
            text += &format!("f {} {} {} {}\n", i + 1, i + 2, i + 2 + SIDE, i + 1 + SIDE);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("patch.obj");
    std::fs::write(&path, text).unwrap();
    let loaded = surfelshop_cloud::read(path, &ReadOptions::default()).unwrap();
    assert_eq!(loaded.summary.n_triangles, 59 * 59 * 2);
    loaded.cloud
}

#[test]
fn results_are_the_same_on_any_number_of_threads() {
    let cloud = patch();
    let values = Values::from([("count".to_owned(), Value::Int(900))]);
    for tool in tools() {
        let one = run(&tool, &cloud, &values, 1);
        for threads in [2, 5] {
            let other = run(&tool, &cloud, &values, threads);
            assert!(one == other, "{}", tool.unit.id);
        }
    }
}

#[test]
fn a_sampled_mesh_can_be_drawn() {
    let cloud = patch();
    let tools = tools();
    let values = Values::from([("count".to_owned(), Value::Int(5000))]);
    let staged = run(&tools[4], &cloud, &values, 2);
    let (EditHeader::NewCloud { origin, columns }, values) = &staged[0] else { panic!() };
    let column = |(header, bytes): (&ColumnHeader, &Vec<u8>)| {
        let values = Buffer::from_little_endian(header.element, bytes);
        Column::new(header.name.as_str(), header.components, values)
    };
    let sampled =
        Cloud::new(*origin, columns.iter().zip(values).map(column).collect::<Vec<_>>()).unwrap();
    assert_eq!(sampled.len(), 5000);
    let names: Vec<&str> = sampled.columns().iter().map(Column::name).collect();
    assert_eq!(names, ["position", "normal", "radius", "area", "color"]);
    assert!(sampled.normals().iter().all(|normal| normal.z > 0.5));
    // The patch is 59 x 59 with slopes of up to 0.36 by 0.2.
    let area: f32 = sampled.floats("area", 1).iter().sum();
    assert!(area > 59.0 * 59.0 && area < 1.1 * 59.0 * 59.0, "{area}");
}
