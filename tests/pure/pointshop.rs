//! The tools of `plugins/pointshop` as the host has them: loaded from their library, over clouds read from files.

use std::path::Path;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, Rotation, Transform, WriteOptions};
use surfelshop_runtime::plugins::{LoadedUnit, Origin, Place, Registry, SearchPath, Trust};
use surfelshop_tests::recording_host::RecordingHost;
use surfelshop_tests::stage;

/// Edits with the bytes of their columns.
type StagedColumns = Vec<(EditHeader, Vec<Vec<u8>>)>;

/// A tool, loaded.
fn tool(id: &str) -> LoadedUnit {
    let (before, after) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = stage::build_folder().join(format!("{before}surfelshop_pointshop{after}"));
    assert!(path.exists(), "{} is missing: `cargo verify` builds it", path.display());
    let files = vec![Place::new(path, Origin::CommandLine)];
    let registry =
        Registry::scan(&SearchPath { files, trust: Trust::everything(), ..SearchPath::default() });
    registry.load(&registry.find(UnitKind::Tool, id).unwrap()).unwrap()
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

/// A ball of points; without those above `top`.
fn ball(folder: &Path, top: f64) -> Cloud {
    let n = 1500;
    let mut text = String::new();
    for i in 0..n {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let (angle, r) = (2.399_963 * f64::from(i), (1.0 - z * z).sqrt());
        let (x, y) = (r * angle.cos(), r * angle.sin());
        if z < top {
            text += &format!("v {x} {y} {z} 0.5 {} 0.25\nvn {x} {y} {z}\n", 0.5 + 0.4 * z);
        }
    }
    let path = folder.join("ball.obj");
    std::fs::write(&path, text).unwrap();
    surfelshop_cloud::read(path, &ReadOptions::default()).unwrap().cloud
}

/// A ball as the host writes it, for tools with a second cloud.
fn second(folder: &Path, binary: bool) -> (Cloud, Value) {
    let how = Transform {
        translation: glam::DVec3::new(0.4, 0.1, 0.0),
        rotation: Rotation::default(),
        scale: 0.9,
    };
    let cloud = ball(folder, 2.0).transformed(&how).unwrap();
    let path = folder.join(format!("second-{binary}.ply"));
    let options = WriteOptions { ascii: !binary, ..WriteOptions::default() };
    surfelshop_cloud::write(&path, &cloud, &options).unwrap();
    let file = Value::Text(path.display().to_string());
    (cloud, file)
}

#[test]
fn results_are_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = second(folder.path(), true);
    let (whole, open) = (ball(folder.path(), 2.0), ball(folder.path(), 0.9));
    let named = |id: &str, value: &Value| Values::from([(id.to_owned(), value.clone())]);
    let lattice = Value::Text("2 2 2 1 1 1 0 0 0.5".to_owned());
    let picture = folder.path().join("picture.png");
    let pixel = |x: u32, y: u32| image::Rgb([16 * x as u8, 16 * y as u8, 99]);
    image::RgbImage::from_fn(16, 16, pixel).save(&picture).unwrap();
    let mut laid = named("image", &Value::Text(picture.display().to_string()));
    let pairs = "-0.2 0 0.98 0 1; 0.2 0 0.98 1 1".to_owned();
    laid.insert("pairs".to_owned(), Value::Text(pairs));
    for (id, cloud, values) in [
        ("smooth", &whole, Values::new()),
        ("boolean", &whole, named("with", &file)),
        ("register", &whole, named("to", &file)),
        ("fill-holes", &open, Values::new()),
        ("transform", &whole, named("rotate-x", &Value::Float(30.0))),
        ("deform", &whole, named("lattice", &lattice)),
        ("texture", &whole, laid),
    ] {
        let tool = tool(id);
        let one = run(&tool, cloud, &values, 1);
        for threads in [2, 5] {
            assert!(one == run(&tool, cloud, &values, threads), "{id}");
        }
    }
}

/// The new cloud.
fn cloud(staged: &StagedColumns) -> Cloud {
    let (EditHeader::NewCloud { origin, columns }, values) = &staged[0] else { panic!() };
    let column = |(header, bytes): (&ColumnHeader, &Vec<u8>)| {
        let values = Buffer::from_little_endian(header.element, bytes);
        Column::new(header.name.as_str(), header.components, values)
    };
    Cloud::new(*origin, columns.iter().zip(values).map(column).collect::<Vec<_>>()).unwrap()
}

/// Places in the world and colours.
fn places_and_colors(cloud: &Cloud) -> Vec<(glam::DVec3, Vec<f64>)> {
    let view = cloud.view();
    let colors: Vec<f64> = view.column("color").unwrap().values.iter_f64().collect();
    let places = cloud.positions().iter().map(|place| cloud.origin() + place.as_dvec3());
    places.zip(colors.chunks_exact(3)).map(|(place, color)| (place, color.to_vec())).collect()
}

#[test]
fn second_clouds_are_read_as_the_host_writes_them() {
    let folder = tempfile::tempdir().unwrap();
    let first = ball(folder.path(), 2.0);
    let tool = tool("boolean");
    for binary in [true, false] {
        let (second, file) = second(folder.path(), binary);
        let values = Values::from([("with".to_owned(), file)]);
        let joined = places_and_colors(&cloud(&run(&tool, &first, &values, 2)));
        let own = places_and_colors(&second);
        let is_of_second = |(place, color): &&(glam::DVec3, Vec<f64>)| {
            own.iter().any(|(other, same)| other.distance(*place) < 1e-6 && same == color)
        };
        let n = joined.iter().filter(is_of_second).count();
        assert!(n > 200 && n < own.len(), "{n} of {}", own.len());
    }
}
