//! Pyramids made of other ones, part by part.

use super::{SMALL, ground, leaves, options};
use crate::{NodeRecord, Pyramid, PyramidError, RemakeOptions, RemakeSummary, Rule, index, remake};
use std::ops::ControlFlow;
use std::path::Path;
use surfelshop_api::Scope;
use surfelshop_api::columns::{CONTEXT, Element};
use surfelshop_api::tool::{ColumnHeader, EditHeader};
use surfelshop_cloud::{Buffer, Cloud, Column, EditedCloud, StagedEdits, ToolRun, silent};

/// A pyramid of several parts.
fn parted(folder: &Path) -> Pyramid {
    let input = ground(folder, "a.ply", 150_000, 0.0);
    let output = folder.join("a.surfels");
    index(&[input], &output, &options(SMALL)).unwrap();
    Pyramid::open(&output).unwrap()
}

fn remaking(scope: Scope) -> RemakeOptions<'static> {
    let rule = Rule::Merged;
    RemakeOptions { scope, what: "test", depends: &[], memory: SMALL, rule, progress: &silent }
}

/// What a tool would have staged.
fn edited(cloud: &Cloud, header: &EditHeader, values: &[&[u8]]) -> Option<EditedCloud> {
    let mut staged = StagedEdits::new(cloud.clone());
    staged.stage(header, values).unwrap();
    let run = ToolRun::new(
        "test".to_owned(),
        String::new(),
        &surfelshop_api::params::Values::new(),
        std::time::SystemTime::UNIX_EPOCH,
    );
    staged.commit(run)
}

fn is_own(cloud: &Cloud) -> Vec<bool> {
    let Some(Buffer::U8(context)) = cloud.column(CONTEXT).map(Column::values) else {
        panic!("no context");
    };
    context.iter().map(|&context| context == 0).collect()
}

fn made(
    pyramid: &Pyramid,
    scope: Scope,
    change: &mut dyn FnMut(&Cloud) -> Option<EditedCloud>,
) -> (Pyramid, RemakeSummary) {
    let output = pyramid.path().with_extension("made.surfels");
    let summary =
        remake(pyramid, &output, &remaking(scope), &mut |cloud, _| Ok(change(cloud))).unwrap();
    assert!(!output.with_extension("surfels.index").exists());
    (Pyramid::open(&output).unwrap(), summary)
}

#[test]
fn a_pyramid_that_nothing_changes_comes_back_node_by_node() {
    // 0.7 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let (mut n_own, mut n_parts) = (0, 0);
    let (again, summary) = made(&pyramid, Scope::Surfel, &mut |cloud| {
        assert!(is_own(cloud).iter().all(|&own| own), "nothing is around where nobody asks");
        (n_own, n_parts) = (n_own + cloud.len(), n_parts + 1);
        None
    });
    assert_eq!((n_own, summary.n_surfels, n_parts), (150_000, 150_000, summary.n_parts));
    assert!(n_parts > 2);
    assert_eq!(again.nodes().len(), pyramid.nodes().len());
    for number in 0..pyramid.nodes().len() as u32 {
        let [a, b] = [&pyramid, &again].map(|pyramid| pyramid.read(number).unwrap());
        assert_eq!(a.origin(), b.origin(), "{number}");
        let columns = |cloud: &Cloud| -> Vec<(String, String)> {
            let text = |c: &Column| (c.name().to_owned(), format!("{:?}", c.values()));
            cloud.columns().iter().map(text).collect()
        };
        assert!(columns(&a) == columns(&b), "{number}");
    }
}

#[test]
fn new_values_go_to_the_surfels_of_the_part_alone() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let (mut own, mut around) = (0, 0);
    let (made, _) = made(&pyramid, Scope::Neighbours, &mut |cloud| {
        let mask = is_own(cloud);
        let n = mask.iter().filter(|&&own| own).count();
        assert!(mask[..n].iter().all(|&own| own), "the part comes first");
        own += n;
        around += cloud.len() - n;
        // What is around counts nothing, but may say so.
        let xs = cloud.positions().iter().map(|p| (cloud.origin().x + f64::from(p.x)) as f32);
        let values: Vec<u8> = xs.flat_map(f32::to_le_bytes).collect();
        let name = "x".to_owned();
        let header = ColumnHeader { name, components: 1, element: Element::F32 };
        edited(cloud, &EditHeader::Columns(vec![header]), &[&values])
    });
    assert_eq!(own, 150_000);
    assert!(around > 10_000 && around < own, "{around}");
    assert!(leaves(&made) == leaves(&pyramid), "positions and classes stay, bit by bit");
    for (number, node) in (0..).zip(made.nodes()) {
        let cloud = made.read(number).unwrap();
        assert!(cloud.column(CONTEXT).is_none());
        let xs = cloud.floats("x", 1);
        assert_eq!(xs.len(), cloud.len());
        for (i, &x) in xs.iter().enumerate() {
            let away = (f64::from(x) - cloud.world_position(i).unwrap().x).abs();
            assert!(away <= f64::from(node.grain.max(1e-6)), "{number}: {away}");
        }
    }
}

#[test]
fn surfels_that_go_leave_their_nodes_and_new_ones_get_others() {
    // 1 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let is_kept = |cloud: &Cloud, i: usize| cloud.world_position(i).unwrap().x < 0.3;
    let (made_of_some, summary) = made(&pyramid, Scope::Surfel, &mut |cloud| {
        let mask: Vec<u8> = (0..cloud.len()).map(|i| u8::from(is_kept(cloud, i))).collect();
        edited(cloud, &EditHeader::Keep, &[&mask])
    });
    let mut expected = leaves(&pyramid);
    expected.retain(|([x, ..], _)| f32::from_bits(*x) < 0.3);
    assert_eq!(expected.len() as u64, summary.n_surfels);
    assert!(leaves(&made_of_some) == expected);
    let lone = |node: &&NodeRecord| node.is_leaf() && node.n_surfels < 500;
    assert_eq!(made_of_some.nodes().iter().filter(lone).count(), 0, "small leaves are joined");
    drop(made_of_some);
    // A new cloud of the same surfels: those at seams come from both sides.
    let (made_anew, summary) = made(&pyramid, Scope::Neighbours, &mut |cloud| {
        let columns = ["position", "normal", "radius"].map(|name| cloud.column(name).unwrap());
        let headers = columns.map(|column| ColumnHeader {
            name: column.name().to_owned(),
            components: column.components(),
            element: Element::F32,
        });
        let bytes = columns.map(|column| match column.values() {
            Buffer::F32(values) => values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>(),
            _ => panic!(),
        });
        let header = EditHeader::NewCloud { origin: cloud.origin(), columns: headers.to_vec() };
        edited(cloud, &header, &bytes.each_ref().map(Vec::as_slice))
    });
    let n = summary.n_surfels;
    assert!((150_000..156_000).contains(&n), "{n}");
    assert_eq!(made_anew.directory().n_surfels, n);
    let none = remake(
        &pyramid,
        &folder.path().join("none.surfels"),
        &remaking(Scope::Surfel),
        &mut |cloud, _| Ok(edited(cloud, &EditHeader::Keep, &[&vec![0; cloud.len()]])),
    );
    assert!(none.unwrap_err().to_string().contains("found none left"));
    assert!(!folder.path().join("none.surfels").exists());
}

#[test]
fn all_of_the_scene_is_around_a_part_and_what_is_far_is_merged() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let area = |cloud: &Cloud, counts: &dyn Fn(usize) -> bool| -> f64 {
        let radii = cloud.radii().iter().enumerate().filter(|(i, _)| counts(*i));
        radii.map(|(_, &radius)| f64::from(radius).powi(2)).sum()
    };
    let all: f64 = (0..)
        .zip(pyramid.nodes())
        .filter(|(_, node)| node.is_leaf())
        .map(|(number, _)| area(&pyramid.read(number).unwrap(), &|_| true))
        .sum();
    let (_, summary) = made(&pyramid, Scope::Scene, &mut |cloud| {
        let own = is_own(cloud);
        let n = own.iter().filter(|&&own| own).count();
        assert!(cloud.len() <= 3 * n, "{} around {n}", cloud.len() - n);
        let seen = area(cloud, &|_| true);
        assert!((0.6..1.2).contains(&(seen / all)), "{seen} of {all}");
        assert!(cloud.len() < 140_000, "{}: what is far is merged", cloud.len());
        None
    });
    assert!(summary.n_parts > 2);
}

#[test]
fn a_remake_that_is_ended_goes_on_and_one_that_is_stopped_says_so() {
    // 0.8 s.
    let folder = tempfile::tempdir().unwrap();
    let pyramid = parted(folder.path());
    let output = folder.path().join("b.surfels");
    let mut n = 0;
    let failed = remake(&pyramid, &output, &remaking(Scope::Surfel), &mut |_, _| {
        n += 1;
        if n == 2 { Err("the tool fell".to_owned()) } else { Ok(None) }
    });
    assert_eq!(failed.unwrap_err().to_string(), "the tool fell");
    assert!(!output.exists());
    let stopped = RemakeOptions {
        progress: &|at| if at > 0.6 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) },
        ..remaking(Scope::Surfel)
    };
    let cancelled = remake(&pyramid, &output, &stopped, &mut |_, _| Ok(None)).unwrap_err();
    assert!(matches!(cancelled, PyramidError::Cancelled(_)), "{cancelled}");
    let mut left = 0;
    let summary = remake(&pyramid, &output, &remaking(Scope::Surfel), &mut |_, _| {
        left += 1;
        Ok(None)
    })
    .unwrap();
    assert!(left < summary.n_parts, "{left} of {}", summary.n_parts);
    assert!(leaves(&Pyramid::open(&output).unwrap()) == leaves(&pyramid));
}
