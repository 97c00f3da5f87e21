//! What comes of runs that end well.

use crate::tools::fixture::{cloud, done, generations, options, values};
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::{Column, How, ReadOptions, WriteOptions, read, write};
use surfelshop_runtime::tools::ToolOptions;

#[test]
fn columns_are_committed_and_all_others_shared() {
    let cloud = cloud(100);
    let done = done("stages-ao", &Values::new(), &cloud, &options());
    let edited = done.edited.unwrap();
    assert_eq!((edited.columns, edited.whole), (vec!["ao".to_owned()], None));
    assert_eq!(edited.cloud.floats("ao", 1), [0.5; 100]);
    assert_eq!(generations(&edited.cloud)[..3], generations(&cloud));
    assert_eq!(cloud.columns().len(), 3);
    assert_eq!(done.device, None, "no device is opened unless the tool asks");
}

#[test]
fn masks_and_new_clouds_are_committed() {
    let cloud = cloud(101);
    let kept = done("keeps-half", &Values::new(), &cloud, &options()).edited.unwrap();
    assert_eq!((kept.cloud.len(), kept.whole), (51, Some(How::Kept)));
    let made = done("makes-cloud", &Values::new(), &kept.cloud, &options()).edited.unwrap();
    assert_eq!((made.cloud.len(), made.whole), (1, Some(How::Derived)));
    assert_eq!(made.columns, ["position", "normal", "radius"]);
    assert_eq!(made.cloud.history().len(), 2);
    assert_eq!(made.cloud.world_position(0), cloud.world_position(0));
}

/// Invariant: tools' loops give the same bits on any number of threads
#[test]
fn loops_give_the_same_bits_on_any_number_of_threads() {
    let cloud = cloud(10_000);
    let seed = values([("seed", Value::Int(5))]);
    let on = |threads| {
        let options = ToolOptions { threads, ..options() };
        let edited = done("scatters", &seed, &cloud, &options).edited.unwrap();
        let noise = edited.cloud.floats("noise", 1).iter().map(|value| value.to_bits());
        noise.collect::<Vec<u32>>()
    };
    let (one, two, many) = (on(1), on(2), on(7));
    assert!(one == two && one == many);
    assert!(one.iter().any(|bits| *bits != one[0]), "there is noise");
}

#[test]
fn who_made_a_column_is_known_after_a_file() {
    let cloud = cloud(50);
    let seed = values([("seed", Value::Int(5))]);
    let noisy = done("scatters", &seed, &cloud, &options()).edited.unwrap().cloud;
    let other = done("scatters", &Values::new(), &cloud, &options()).edited.unwrap().cloud;
    let made = noisy.column("noise").unwrap().made().unwrap();
    assert_eq!(made.tool, "org.surfelshop.test.faulty/scatters");
    assert_eq!(made.version, env!("CARGO_PKG_VERSION"));
    assert_eq!((made.seed(), &made.values), (Some(5), &seed));
    assert!(made.time.ends_with('Z') && made.time.len() == 20, "{}", made.time);
    let default = other.column("noise").unwrap().made().unwrap().seed();
    assert_eq!(default, Some(1), "parameters that were not set are noted with their defaults");
    assert_ne!(noisy.floats("noise", 1), other.floats("noise", 1));
    let kept = done("keeps-half", &Values::new(), &noisy, &options()).edited.unwrap().cloud;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    write(&path, &kept, &WriteOptions::default()).unwrap();
    let loaded = read(&path, &ReadOptions::default()).unwrap().cloud;
    assert_eq!(loaded.column("noise").unwrap().made(), Some(made));
    assert_eq!(loaded.history(), kept.history());
    let unmade = |column: &&Column| column.made().is_none();
    assert_eq!(loaded.columns().iter().filter(unmade).count(), 3);
}

#[test]
fn an_empty_cloud_is_no_failure() {
    let cloud = surfelshop_cloud::Cloud::default();
    for id in ["stages-ao", "scatters", "keeps-half"] {
        done(id, &Values::new(), &cloud, &options());
    }
}
