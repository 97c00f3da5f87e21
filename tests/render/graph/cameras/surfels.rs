//! The scene's surfels as data of passes.

use crate::graph::cameras::bench::{Bench, show, show_as};
use glam::{DVec3, Vec3};
use std::collections::BTreeSet;
use surfelshop_api::graph::Output;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::*;
use surfelshop_cloud::Cloud;
use surfelshop_render::SurfelDrawing;
use surfelshop_tests::clouds::{Surfels, sphere};

const COPY: &str = "
    #import surfelshop::surfels
    var<storage, read> points: array<surfels::Record>;
    var<storage, read_write> found: array<vec4<f32>>;
    @compute @workgroup_size(64) fn copy(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x >= arrayLength(&points) { return; }
        let s = surfels::surfel_of(points[id.x]);
        found[3u * id.x] = vec4(s.position, s.radius);
        found[3u * id.x + 1u] = vec4(s.normal, f32(s.object));
        found[3u * id.x + 2u] = vec4(s.albedo, 1.0);
    }
";

/// Copies what it is given of `n_surfels` and shows it, three pixels each.
fn copy(graph: &mut Graph, n_surfels: u64, at_most: u32) {
    let given = Graph::surfels_given(n_surfels, at_most);
    let points = graph.surfels("points", n_surfels, at_most);
    let found = graph.buffer("found", Buffer::new(48 * u64::from(given.max(1))));
    let groups = Groups::Fixed([given.div_ceil(64).max(1), 1, 1]);
    let pass = Pass::compute("copy", COPY, "copy", groups);
    graph.pass(pass.bind("points", points).bind("found", found));
    show(graph, found);
}

/// What passes read.
struct Read {
    position: Vec3,
    radius: f32,
    normal: Vec3,
    object: f32,
    albedo: Vec3,
}

fn read(bench: &mut Bench, at_most: u32) -> Vec<Read> {
    let mut seat = bench.seat(move |frame, graph| copy(graph, frame.cloud.n_surfels, at_most));
    let values = bench.values(&mut seat);
    let n_surfels = bench.clouds.iter().map(|cloud| cloud.len() as u64).sum();
    let given = Graph::surfels_given(n_surfels, at_most) as usize;
    assert!(values[3 * given..].iter().all(|pixel| pixel[3] == 0.0));
    let vector = |pixel: &[f32; 4]| Vec3::from_slice(pixel);
    let records = values[..3 * given].chunks_exact(3);
    records
        .map(|record| Read {
            position: vector(&record[0]),
            radius: record[0][3],
            normal: vector(&record[1]),
            object: record[1][3],
            albedo: vector(&record[2]),
        })
        .collect()
}

fn bits(position: Vec3) -> [u32; 3] {
    position.to_array().map(f32::to_bits)
}

fn colored(n: usize, radius: f32) -> Surfels {
    let colors = (0..n).map(|i| [(7 * i % 256) as u8, 255, 0]).collect();
    Surfels { colors, ..sphere(n, radius) }
}

/// Invariant: surfels as data are each there once, or evenly spread, with radii, albedos and
/// places as the scene has them, made once for all views
#[test]
fn every_surfel_is_there_once() {
    // Of several chunks each.
    let [first, second] = [colored(150, 1.0), colored(120, 0.5)];
    let mut bench = Bench::new(vec![first.cloud(), second.cloud()]);
    let found = read(&mut bench, 1000);
    assert_eq!(found.len(), 270);
    for (object, surfels) in [(0.0, &first), (1.0, &second)] {
        let of_cloud: Vec<&Read> = found.iter().filter(|read| read.object == object).collect();
        let places: BTreeSet<_> = of_cloud.iter().map(|read| bits(read.position)).collect();
        assert_eq!((of_cloud.len(), places.len()), (surfels.radii.len(), surfels.radii.len()));
        for read in of_cloud {
            let i = surfels.positions.iter().position(|own| *own == read.position).unwrap();
            assert_eq!(read.radius, surfels.radii[i]);
            assert!((read.normal - surfels.normals[i]).length() < 2e-4);
            let red = srgb_to_linear(f32::from(surfels.colors[i][0]) / 255.0);
            // Half floats.
            let off = (read.albedo - Vec3::new(red, 1.0, 0.0)).abs().max_element();
            assert!(off < 6e-4, "{} {red}", read.albedo);
        }
    }
}

#[test]
fn fewer_are_spread_evenly() {
    let mut bench = Bench::new(vec![sphere(2000, 1.0).cloud()]);
    let found = read(&mut bench, 300);
    // One of seven.
    assert_eq!(found.len(), 286);
    for octant in 0..8 {
        let is_here = |read: &&Read| {
            let sides = read.position.to_array().map(|x| u32::from(x > 0.0));
            sides[0] + 2 * sides[1] + 4 * sides[2] == octant
        };
        let here = found.iter().filter(is_here).count();
        assert!((30..=42).contains(&here), "{here} of 286 in octant {octant}");
    }
}

#[test]
fn radii_have_the_scene_s_factor_and_ellipses_that_of_their_area() {
    let round = sphere(100, 1.0);
    let ellipses = sphere(100, 0.5).elliptical(0.25);
    let mut bench = Bench::new(vec![round.cloud(), ellipses.cloud()]);
    bench.scene.surface.radius_scale = 1.5;
    for read in read(&mut bench, 1000) {
        let expected = if read.object == 0.0 {
            round.radii[0]
        } else {
            let i = ellipses.positions.iter().position(|own| *own == read.position).unwrap();
            let [u, v] = ellipses.tangents[i];
            u.cross(v).length().sqrt()
        };
        assert!((read.radius / (1.5 * expected) - 1.0).abs() < 1e-6, "{}", read.radius);
    }
}

#[test]
fn positions_far_away_lose_nothing() {
    let origin = DVec3::new(1e9, -2e9, 3e9);
    let near = Surfels { origin, ..sphere(50, 1.0) };
    let offset = DVec3::new(5.0, 0.0, 0.0);
    let other = Surfels { origin: origin + offset, ..sphere(40, 1.0) };
    let mut bench = Bench::new(vec![near.cloud(), other.cloud()]);
    bench.view.camera.eye += origin;
    bench.view.camera.target += origin;
    for read in read(&mut bench, 100) {
        let (own, moved) = if read.object == 0.0 { (&near, DVec3::ZERO) } else { (&other, offset) };
        let places = own.positions.iter().map(|place| *place + moved.as_vec3());
        assert!(places.into_iter().any(|place| place == read.position), "{}", read.position);
    }
}

#[test]
fn where_there_is_none_there_is_one_of_no_size() {
    let mut bench = Bench::new(vec![Surfels::default().cloud()]);
    let mut seat = bench.seat(|_, graph| copy(graph, 0, 10));
    let found = bench.values(&mut seat);
    assert_eq!(found[0], [0.0; 4]);
    assert!(found[1..3].as_flattened().iter().all(|value| value.is_finite()));
}

#[test]
fn they_are_made_once() {
    let surfels = sphere(200, 1.0);
    let mut bench = Bench::drawing(SurfelDrawing::Quads, vec![surfels.cloud()]);
    let mut views = [0, 1].map(|_| bench.seat(|_, graph| copy(graph, 200, 100)));
    let n_made = |bench: &Bench| bench.engine.counters().surfel_buffers;
    for _ in 0..2 {
        for view in &mut views {
            bench.draw(view).unwrap();
        }
        bench.view.camera.eye.x += 0.1;
    }
    assert_eq!(n_made(&bench), 1, "for both views, wherever they look from");
    // A preview draws fewer and larger surfels; as data they are what they are.
    let [view, _] = &mut views;
    let whole = bench.values(view);
    bench.stride = 4;
    assert_eq!((bench.values(view), n_made(&bench)), (whole, 1));
    bench.stride = 1;
    let mut more = bench.seat(|_, graph| copy(graph, 200, 200));
    bench.draw(&mut more).unwrap();
    assert_eq!(n_made(&bench), 2);
    // The same surfels of another file are other ones.
    bench.clouds = vec![surfels.cloud()];
    bench.draw(view).unwrap();
    assert_eq!(n_made(&bench), 3);
}

#[test]
fn none_are_made_where_nobody_asked() {
    let mut bench = Bench::new(vec![sphere(50, 1.0).cloud()]);
    let mut seat = bench.seat(|_, graph| {
        let points = graph.surfels("points", 50, 50);
        show_as(graph, points, Output::Debug("points".to_owned()));
        let nothing = graph.upload("nothing", &[0; 16]);
        show(graph, nothing);
    });
    bench.draw(&mut seat).unwrap();
    assert_eq!(bench.engine.counters().surfel_buffers, 0);
    bench.outputs.push(Output::Debug("points".to_owned()));
    bench.draw(&mut seat).unwrap();
    assert_eq!(bench.engine.counters().surfel_buffers, 1);
}

#[test]
fn clouds_that_change_are_given_anew() {
    let mut bench = Bench::new(vec![sphere(50, 1.0).cloud()]);
    let before = read(&mut bench, 50);
    let grown = Surfels { radii: vec![2.0; 50], ..sphere(50, 1.0) };
    let grown: Cloud = grown.cloud();
    bench.clouds = vec![grown];
    let after = read(&mut bench, 50);
    assert!(before.iter().all(|read| read.radius < 1.0));
    assert!(after.iter().all(|read| read.radius == 2.0));
}
