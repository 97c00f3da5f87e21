//! What tools stage, and how it is noted.

use crate::{Buffer, Cloud, CloudEdit, Column, How, ReadOptions, StagedEdits, ToolRun, Transform};
use crate::{WriteOptions, read, write};
use glam::DVec3;
use std::time::UNIX_EPOCH;
use surfelshop_api::columns::Element;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use tempfile::TempDir;

fn floats(name: &str, components: u32, values: &[f32]) -> Column {
    Column::new(name, components, Buffer::F32(values.to_vec()))
}

/// Three surfels with every column that a load gives.
fn three() -> Cloud {
    let position = floats("position", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let normal = floats("normal", 3, &[0.0, 0.0, 1.0].repeat(3));
    let radius = floats("radius", 1, &[0.5; 3]);
    Cloud::new(DVec3::splat(7.0), vec![position, normal, radius]).unwrap()
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn header(name: &str, components: u32) -> ColumnHeader {
    ColumnHeader { name: name.to_owned(), components, element: Element::F32 }
}

fn run(tool: &str) -> ToolRun {
    let values = Values::from([("seed".to_owned(), Value::Int(3))]);
    ToolRun::new(format!("org.example/{tool}"), "1.0.0".to_owned(), &values, UNIX_EPOCH)
}

fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

#[test]
fn columns_are_added_and_replaced_and_the_others_shared() {
    let cloud = three();
    let mut staged = StagedEdits::new(cloud.clone());
    let ao = EditHeader::Columns(vec![header("ao", 1), header("radius", 1)]);
    staged.stage(&ao, &[&bytes(&[0.5; 3]), &bytes(&[0.25; 3])]).unwrap();
    // A later column takes the place of an earlier one.
    staged.stage(&EditHeader::Columns(vec![header("ao", 1)]), &[&bytes(&[1.0; 3])]).unwrap();
    let edited = staged.commit(run("ao")).unwrap();
    assert_eq!(edited.cloud.floats("ao", 1), [1.0; 3]);
    assert_eq!(edited.cloud.radii(), [0.25; 3]);
    assert_eq!((edited.columns, edited.whole), (vec!["radius".to_owned(), "ao".to_owned()], None));
    assert_eq!(generations(&edited.cloud)[..2], generations(&cloud)[..2]);
    let made = |name: &str| edited.cloud.column(name).unwrap().made().map(|made| made.seed());
    assert_eq!((made("ao"), made("radius")), (Some(Some(3)), Some(Some(3))));
    assert_eq!((made("position"), made("normal")), (None, None));
    assert!(edited.cloud.history().is_empty());
    assert_eq!(cloud.radii(), [0.5; 3]);
}

#[test]
fn a_mask_comes_after_columns_and_ends_the_run() {
    let mut staged = StagedEdits::new(three());
    let ao = EditHeader::Columns(vec![header("ao", 1)]);
    staged.stage(&ao, &[&bytes(&[0.1, 0.2, 0.3])]).unwrap();
    staged.stage(&EditHeader::Keep, &[&[1, 0, 1]]).unwrap();
    for (header, values) in [(&ao, vec![0; 12]), (&EditHeader::Keep, vec![1; 3])] {
        let refused = staged.stage(header, &[&values]).unwrap_err().to_string();
        assert_eq!(refused, "edit: expected no further edit in this run, found one after a mask");
    }
    let edited = staged.commit(run("clean")).unwrap();
    assert_eq!(edited.cloud.floats("ao", 1), [0.1, 0.3]);
    assert_eq!((&edited.columns[..], edited.whole), (&["ao".to_owned()][..], Some(How::Kept)));
    let [CloudEdit { how: How::Kept, n_surfels: 2, n_before: 3, .. }] = edited.cloud.history()
    else {
        panic!("{:?}", edited.cloud.history())
    };
}

#[test]
fn a_new_cloud_stands_alone_and_remembers_where_it_is_from() {
    let mut staged = StagedEdits::new(three());
    staged.stage(&EditHeader::Keep, &[&[1, 1, 0]]).unwrap();
    let kept = staged.commit(run("clean")).unwrap().cloud;
    let new = EditHeader::NewCloud { origin: DVec3::X, columns: vec![header("position", 3)] };
    let mut staged = StagedEdits::new(kept.clone());
    staged.stage(&new, &[&bytes(&[1.0, 2.0, 3.0])]).unwrap();
    assert!(staged.stage(&EditHeader::Keep, &[&[1, 1]]).is_err());
    let edited = staged.commit(run("thin")).unwrap();
    assert_eq!(edited.cloud.world_position(0), Some(DVec3::new(2.0, 2.0, 3.0)));
    assert_eq!(edited.columns, ["position"]);
    let tools = edited.cloud.history().iter().map(|note| note.made.tool.as_str());
    assert_eq!(tools.collect::<Vec<_>>(), ["org.example/clean", "org.example/thin"]);
    assert_eq!(kept.len(), 2);
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let column = |name: &str, components| EditHeader::Columns(vec![header(name, components)]);
    let new = |columns| EditHeader::NewCloud { origin: DVec3::ZERO, columns };
    let twice = EditHeader::Columns(vec![header("a", 1), header("a", 1)]);
    let nan = bytes(&[0.0, f32::NAN, 0.0]);
    let cases: [(EditHeader, &[&[u8]], &str); 12] = [
        (column("ao", 1), &[&[0; 16]], "column `ao`: expected 3 values, found 4"),
        (column("ao", 1), &[&[0; 13]], "expected whole numbers of type f32 for `ao`"),
        (column("ao", 2), &[&[0; 24]], "column `ao`: expected 1 x f32, found 2 x f32"),
        (column("ao", 1), &[&nan], "column `ao`: surfel 1 is not finite"),
        (column("", 1), &[&[0; 12]], "expected a name"),
        (column("x", 0), &[&[]], "at least one component"),
        (column("ao", 1), &[], "as many arrays of values as columns, found 0 for 1 columns"),
        (twice, &[&[0; 12], &[0; 12]], "column `a` is given twice"),
        (EditHeader::Keep, &[&[1; 4]], "mask: expected 3 entries, found 4"),
        (EditHeader::Keep, &[&[1, 0, 2]], "expected 0 or 1 in a mask, found 2 for surfel 2"),
        (EditHeader::Keep, &[], "one array of bytes for a mask"),
        (new(vec![header("radius", 1)]), &[&[0; 12]], "expected a column `position`, found none"),
    ];
    let mut staged = StagedEdits::new(three());
    for (header, values, words) in cases {
        let refused = staged.stage(&header, values).unwrap_err().to_string();
        assert!(refused.contains(words), "{refused}");
    }
    assert!(staged.clone().commit(run("bad")).is_none());
    staged.stage(&column("ao", 1), &[&[0; 12]]).unwrap();
    let after = staged.stage(&new(Vec::new()), &[]).unwrap_err().to_string();
    assert!(after.contains("after columns of this cloud"), "{after}");
}

#[test]
fn a_mask_that_keeps_all_is_no_edit() {
    let mut staged = StagedEdits::new(three());
    staged.stage(&EditHeader::Keep, &[&[1; 3]]).unwrap();
    assert!(staged.commit(run("clean")).is_none());
}

#[test]
fn who_made_what_survives_edits_and_files() {
    let mut staged = StagedEdits::new(three());
    let made = EditHeader::Columns(vec![header("ao", 1), header("normal", 3), header("flow", 2)]);
    let values = [bytes(&[0.5; 3]), bytes(&[0.0, 1.0, 0.0].repeat(3)), bytes(&[2.0; 6])];
    staged.stage(&made, &values.each_ref().map(Vec::as_slice)).unwrap();
    let cloud = staged.commit(run("ao")).unwrap().cloud;
    let turned = Transform { scale: 2.0, ..Transform::default() };
    let cloud = cloud.transformed(&turned).unwrap();
    let mut staged = StagedEdits::new(cloud);
    staged.stage(&EditHeader::Keep, &[&[0, 1, 1]]).unwrap();
    let cloud = staged.commit(run("clean")).unwrap().cloud;
    let folder = TempDir::new().unwrap();
    let [first, second] = ["a.ply", "b.ply"].map(|name| folder.path().join(name));
    write(&first, &cloud, &WriteOptions::default()).unwrap();
    let loaded = read(&first, &ReadOptions::default()).unwrap().cloud;
    for name in ["ao", "normal", "flow"] {
        let (found, expected) = [&loaded, &cloud].map(|c| c.column(name).unwrap().made()).into();
        assert!(found.is_some() && found == expected, "{name}: {found:?}");
    }
    assert_eq!(loaded.column("radius").unwrap().made(), None);
    assert_eq!(loaded.history(), cloud.history());
    write(&second, &loaded, &WriteOptions { ascii: true, ..WriteOptions::default() }).unwrap();
    let text = std::fs::read_to_string(&second).unwrap();
    let line = "comment surfelshop made ao: org.example/ao 1.0.0 1970-01-01T00:00:00Z { seed = 3 }";
    assert!(text.lines().any(|found| found == line), "{text}");
    // A comment about normals is not believed where the file has none.
    let without = text.replace("property float nx\n", "property float a1\n");
    std::fs::write(&second, without).unwrap();
    let loaded = read(&second, &ReadOptions::default()).unwrap().cloud;
    assert_eq!(loaded.column("normal").unwrap().made(), None);
    assert!(loaded.column("ao").unwrap().made().is_some());
}
