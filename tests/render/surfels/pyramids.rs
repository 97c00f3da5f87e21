//! Pyramids: the same pictures as of clouds in memory, whatever is kept and who draws. Costs 8 s.

use glam::DVec3;
use std::path::Path;
use std::time::Duration;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::selection::{
    Combine, EditLayer, HiddenOnes, LayerChange, Region, RegionSelection, RegionStep,
};
use surfelshop_cloud::{Buffer, Cloud, Column, Loaded, ReadOptions, WriteOptions};
use surfelshop_image::Image;
use surfelshop_pyramid::{IndexOptions, index};
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, RenderRequest, RendererView, SurfelDrawing,
};
use surfelshop_session::input::budget::Budget;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::drawn::Wait;
use surfelshop_session::input::pyramids;
use surfelshop_tests::{clouds, stage};

const OUTPUTS: [Output; 3] = [Output::Color, Output::Depth, Output::Albedo];

/// Enough surfels for several levels: a leaf has at most 32 768.
const N: usize = 300_000;

/// Small enough for chunks of 65 536 points.
const MEMORY: u64 = 1;

struct Lab {
    engine: Engine,
    renderer: RendererView,
    scene: Scene,
}

impl Lab {
    fn new(surfels: SurfelDrawing) -> Self {
        let options = EngineOptions { surfels, ..EngineOptions::default() };
        let engine = stage::engine_with(&GpuOptions::default(), &options);
        let renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        Self { engine, renderer, scene: Scene::default() }
    }

    fn pictures(&mut self, clouds: &Clouds, view: View, detail_px: f32, wait: Wait) -> Vec<Image> {
        let drawn = clouds.drawn(&view, &self.scene.surface, detail_px, wait).unwrap();
        let views = drawn.with(clouds);
        let request = RenderRequest {
            clouds: views.clouds(),
            facts: &clouds.facts,
            scene: &self.scene,
            view,
            values: &Values::new(),
            outputs: &OUTPUTS,
            frame_index: 0,
            environment: None,
            stride: 1,
            detail_px: 0.0,
            parts: views.parts(),
            eye_dome: None,
        };
        self.engine.forget_surfaces();
        let rendered = self.engine.render(&mut self.renderer, &request).unwrap();
        rendered.images.into_iter().map(|(_, image)| image).collect()
    }
}

fn pyramid(folder: &Path) -> std::path::PathBuf {
    let file = folder.join("waves.ply");
    let write = WriteOptions::default();
    surfelshop_cloud::write(&file, &clouds::wavy_sphere(N), &write).unwrap();
    let output = folder.join("waves.surfels");
    let options = IndexOptions { read: ReadOptions::default(), memory: MEMORY };
    let done = index(&[file], &output, &options).unwrap();
    assert!(done.n_nodes > done.n_leaves && done.n_leaves > 8, "{done:?}");
    output
}

fn opened(path: &Path, budget: u64) -> Clouds {
    let (loaded, pyramid) = pyramids::open(path, Budget(budget)).unwrap();
    Clouds { pyramids: vec![pyramid.into()], ..Clouds::of(vec![loaded]) }
}

fn view() -> View {
    stage::view(DVec3::new(0.6, 0.8, 2.6), DVec3::ZERO, 300)
}

/// The largest difference in any channel of any pixel that both cover, and how many only one covers. Distances cover
/// what is not 0 far, others what their fourth component says.
fn difference(a: &Image, b: &Image) -> (f32, usize) {
    let (mut most, mut apart) = (0.0f32, 0);
    let n = a.components as usize;
    assert!(a.components == b.components && [1, 4].contains(&n) && a.data.len() == b.data.len());
    for (a, b) in a.data.chunks_exact(n).zip(b.data.chunks_exact(n)) {
        let covered = [a, b].map(|pixel| pixel[n - 1] > 0.0);
        apart += usize::from(covered[0] != covered[1]);
        let differ = a.iter().zip(b).take(3).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        most = most.max(if covered == [true; 2] { differ } else { 0.0 });
    }
    (most, apart)
}

#[test]
fn all_leaves_are_the_cloud_and_the_cache_does_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let path = pyramid(folder.path());
    let cloud = clouds::wavy_sphere(N);
    let whole = Clouds::of(vec![Loaded { cloud, summary: Default::default() }]);
    for way in [SurfelDrawing::Processor, SurfelDrawing::Quads, SurfelDrawing::Compute] {
        let mut lab = Lab::new(way);
        let expected = lab.pictures(&whole, view(), 0.0, Wait::ForAll);
        // 4 GB and 64 MB.
        let (large, small) = (opened(&path, 1 << 32), opened(&path, 1 << 26));
        let leaves = lab.pictures(&large, view(), 0.0, Wait::ForAll);
        for (expected, found) in expected.iter().zip(&leaves) {
            // What blends is summed in another order where a pixel sees surfels of two nodes; a normal may be packed as
            // its neighbour then, 1.2e-4 rad away, which a highlight shows as a quarter of a level of 8 bits at most.
            let (most, apart) = difference(expected, found);
            assert!(most < 1e-3 && apart == 0, "{way:?}: {most}, {apart} pixels");
        }
        for detail in [0.0, 1.0, 3.0] {
            let a = lab.pictures(&large, view(), detail, Wait::ForAll);
            let b = lab.pictures(&small, view(), detail, Wait::ForAll);
            assert!(a.iter().zip(&b).all(|(a, b)| a.data == b.data), "{way:?}, {detail}");
            // In another order of asking, and with other numbers of threads.
            for n_threads in [1, 2] {
                let threads = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build();
                let draw = || lab.pictures(&large, view(), detail, Wait::ForAll);
                let again = threads.unwrap().install(draw);
                assert!(a.iter().zip(&again).all(|(a, b)| a.data == b.data), "{way:?}, {detail}");
            }
        }
    }
}

#[test]
fn coarser_detail_draws_fewer_surfels_and_little_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = pyramid(folder.path());
    let clouds = opened(&path, 1 << 32);
    let mut lab = Lab::new(SurfelDrawing::Processor);
    let leaves = lab.pictures(&clouds, view(), 0.0, Wait::ForAll);
    // Only leaves have what stands for nothing else.
    let n_merged = |detail_px: f32| {
        let surface = Scene::default().surface;
        let drawn = clouds.drawn(&view(), &surface, detail_px, Wait::ForAll).unwrap();
        let views = drawn.with(&clouds);
        let objects = views.parts().unwrap().objects;
        assert!(objects.iter().all(|part| part.is_part));
        (objects.iter().filter(|part| part.is_merged).count(), objects.len())
    };
    assert_eq!(n_merged(0.0).0, 0);
    let (merged, n_parts) = n_merged(16.0);
    assert!(merged > 0, "{merged} of {n_parts}");
    let mut last = lab.engine.counters().drawn_surfels;
    for (detail, bound) in [(0.75, 0.02), (1.5, 0.03), (4.0, 0.06), (16.0, 0.12)] {
        let found = lab.pictures(&clouds, view(), detail, Wait::ForAll);
        let n = lab.engine.counters().drawn_surfels;
        assert!(n <= last, "{detail}: {n} of {last}");
        last = n;
        let pixels = leaves[0].data.chunks_exact(4).zip(found[0].data.chunks_exact(4));
        let (mut sum, mut n, mut apart) = (0.0, 0.0, 0.0);
        for (a, b) in pixels.filter(|(a, b)| a[3] > 0.0 || b[3] > 0.0) {
            n += 1.0;
            apart += f64::from((a[3] > 0.0) != (b[3] > 0.0));
            sum += f64::from((a[0] - b[0]).powi(2));
        }
        let rms = (sum / n).sqrt();
        assert!(rms < bound, "{detail}: RMS {rms}");
        // Outlines move by a part of a pixel.
        assert!(apart / n < 0.03, "{detail}: {apart} of {n} pixels");
    }
    assert!(last < N / 8, "{last}");
}

/// Where and what is edited, in the coordinates of the file.
fn edits() -> EditLayer {
    let take = |region: Region, how| RegionStep::Take { how, region };
    let select = |steps: Vec<RegionStep>| RegionSelection { steps, ..RegionSelection::default() };
    let ball = Region::Sphere { center: DVec3::new(0.3, 0.4, 0.9), radius: 0.4 };
    let upper = Region::Plane { point: DVec3::new(0.0, 0.5, 0.0), normal: DVec3::Y };
    let lower = Region::Plane { point: DVec3::new(0.0, -0.3, 0.0), normal: DVec3::NEG_Y };
    let red = LayerChange::Set { column: "color".to_owned(), values: vec![200.0, 30.0, 20.0] };
    let chosen = [take(upper, Combine::Add), take(ball, Combine::Subtract)];
    EditLayer::default()
        .with(select(chosen.into()), LayerChange::Delete)
        .with(select(vec![take(lower, Combine::Add)]), red)
}

/// Costs 3 s.
#[test]
fn edits_of_a_pyramid_are_those_of_its_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let path = pyramid(folder.path());
    let cloud = edits().applied(clouds::wavy_sphere(N), None, HiddenOnes::LeftOut).unwrap();
    assert!(cloud.len() < N * 9 / 10 && cloud.len() > N / 2);
    let whole = Clouds::of(vec![Loaded { cloud, summary: Default::default() }]);
    let mut lab = Lab::new(SurfelDrawing::Processor);
    let expected = lab.pictures(&whole, view(), 0.0, Wait::ForAll);
    let edited = |clouds: &Clouds, layer: EditLayer| {
        let (cloud, pyramid) = clouds.pyramids[0].edited(layer).unwrap();
        let summary = clouds.loaded[0].summary.clone();
        Clouds { pyramids: vec![pyramid.into()], ..Clouds::of(vec![Loaded { cloud, summary }]) }
    };
    let plain = opened(&path, 1 << 32);
    let before = lab.pictures(&plain, view(), 0.0, Wait::ForAll);
    let read = |clouds: &Clouds| clouds.pyramids[0].nodes().in_memory().nodes_read;
    let changed = edited(&plain, edits());
    let found = lab.pictures(&changed, view(), 0.0, Wait::ForAll);
    for (expected, found) in expected.iter().zip(&found) {
        // As for leaves without edits.
        let (most, apart) = difference(expected, found);
        assert!(most < 1e-3 && apart == 0, "{most}, {apart} pixels");
    }
    // They share nodes, and undone it is as before.
    let undone = lab.pictures(&plain, view(), 0.0, Wait::ForAll);
    assert!(undone.iter().zip(&before).all(|(a, b)| a.data == b.data));
    // Nodes that no edit reaches are not read again.
    let take = |region: Region| vec![RegionStep::Take { how: Combine::Add, region }];
    let select = |steps| RegionSelection { steps, ..RegionSelection::default() };
    let dent = Region::Sphere { center: DVec3::new(0.3, 0.4, 0.9), radius: 0.1 };
    let dented = EditLayer::default().with(select(take(dent)), LayerChange::Hide);
    let n_read = read(&plain);
    let dented = edited(&plain, dented);
    let found_dented = lab.pictures(&dented, view(), 0.0, Wait::ForAll);
    let n_again = read(&dented) - n_read;
    assert!(n_again > 0 && n_again < 8, "{n_again} of {n_read}");
    assert!(difference(&before[0], &found_dented[0]).0 > 1e-3, "the far side is seen there");
    // From another cache, coarser, and node by node as they come.
    let small = edited(&opened(&path, 1 << 28), edits());
    for detail in [0.0, 2.0] {
        let a = lab.pictures(&changed, view(), detail, Wait::ForAll);
        let b = lab.pictures(&small, view(), detail, Wait::ForAll);
        assert!(a.iter().zip(&b).all(|(a, b)| a.data == b.data), "{detail}");
    }
    let surface = lab.scene.surface;
    let late = edited(&opened(&path, 1 << 32), edits());
    late.wish((&view(), None), &surface, 0.0, Wait::ForNone);
    while late.is_waited_for() {
        late.wait(Duration::from_millis(20)).unwrap();
        late.wish((&view(), None), &surface, 0.0, Wait::ForNone);
    }
    let come = lab.pictures(&late, view(), 0.0, Wait::ForNone);
    assert!(come.iter().zip(&found).all(|(a, b)| a.data == b.data));
    // What is deleted as a whole is not read.
    let all = |how| RegionStep::Take { how, region: Region::All };
    let ball = Region::Sphere { center: DVec3::Z, radius: 0.05 };
    let steps = vec![all(Combine::Add), RegionStep::Take { how: Combine::Subtract, region: ball }];
    let crop = RegionSelection { steps, ..RegionSelection::default() };
    let fresh = opened(&path, 1 << 32);
    let little = edited(&fresh, EditLayer::default().with(crop, LayerChange::Delete));
    let n = little.loaded[0].cloud.len();
    // Of a ball of this radius on a sphere, as many as it has of the area, as finely as leaves have it.
    assert!((N / 2000..N / 1000).contains(&n), "{n} of {N}");
    lab.pictures(&little, view(), 0.0, Wait::ForAll);
    assert!(read(&little) <= 4, "{}", read(&little));
    let nothing = RegionSelection { steps: vec![all(Combine::Add)], ..RegionSelection::default() };
    let nothing = EditLayer::default().with(nothing, LayerChange::Hide);
    let line = fresh.pyramids[0].edited(nothing).err().unwrap().to_string();
    assert!(line.contains("the edits would leave none of"), "{line}");
}

/// A wall of which one half is a fence, and walls behind it that differ in colour from place to place.
fn walls(n: usize) -> Cloud {
    let per_wall = n / 4;
    let side = (per_wall as f32).sqrt() as usize;
    let (mut position, mut color) = (Vec::new(), Vec::new());
    for wall in 0..4 {
        for i in 0..side * side {
            let [x, y] = [i % side, i / side].map(|at| 2.4 * (at as f32 / side as f32 - 0.5));
            let is_gap = wall == 0 && x > 0.0 && (x * 9.0).fract() > 0.6;
            if is_gap {
                continue;
            }
            position.extend([x, y, 0.6 - 2.4 * wall as f32]);
            let spot = ((x * 40.0).sin() * (y * 40.0).sin() > 0.0) as u8;
            color.extend([90 + 100 * spot, 60 * wall as u8, 200 - 100 * spot]);
        }
    }
    let n = position.len() / 3;
    let columns = vec![
        Column::new("position", 3, Buffer::F32(position)),
        Column::new("normal", 3, Buffer::F32([0.0, 0.0, 1.0].repeat(n))),
        Column::new("radius", 1, Buffer::F32(vec![1.8 / side as f32; n])),
        Column::new("color", 3, Buffer::U8(color)),
    ];
    Cloud::new(DVec3::ZERO, columns).unwrap()
}

/// Costs 1 s.
#[test]
fn what_others_hide_is_coarser_and_the_picture_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let (file, path) = (folder.path().join("walls.ply"), folder.path().join("walls.surfels"));
    surfelshop_cloud::write(&file, &walls(N), &WriteOptions::default()).unwrap();
    let options = IndexOptions { read: ReadOptions::default(), memory: MEMORY };
    index(&[file], &path, &options).unwrap();
    let mut lab = Lab::new(SurfelDrawing::Processor);
    let surface = lab.scene.surface;
    for (eye, detail) in [([0.3, 0.1, 2.4], 0.2), ([1.4, 0.4, 1.9], 0.2), ([0.3, 0.1, 2.4], 0.3)] {
        let view = stage::view(DVec3::from_array(eye), DVec3::ZERO, 120);
        let plain = opened(&path, 1 << 32);
        let missing = |wait| plain.drawn(&view, &surface, detail, wait).unwrap().n_missing();
        while missing(Wait::ForNoneInMotion) > 0 {
            plain.wish((&view, None), &surface, detail, Wait::ForNoneInMotion);
            plain.wait(Duration::from_secs(60)).unwrap();
        }
        let used = |clouds: &Clouds, wait| {
            clouds.drawn(&view, &surface, detail, wait).unwrap().pyramids()[0].clone()
        };
        let clouds = opened(&path, 1 << 32);
        let (all, some) = (used(&plain, Wait::ForNoneInMotion), used(&clouds, Wait::ForAll));
        assert!(some.nodes_hidden > 0 && all.nodes_hidden == 0, "{some:?}");
        assert!(some.surfels_drawn * 4 < all.surfels_drawn * 3, "{some:?} of {all:?}");
        assert!(some.coarsest_px.is_some_and(|px| px <= f64::from(detail)), "{some:?}");
        let expected = lab.pictures(&plain, view, detail, Wait::ForNoneInMotion);
        let found = lab.pictures(&clouds, view, detail, Wait::ForAll);
        for (expected, found) in expected.iter().zip(&found) {
            let (most, apart) = difference(expected, found);
            assert!(most == 0.0 && apart == 0, "{eye:?}: {most}, {apart} pixels");
        }
        // As it comes it is the same in the end, and never coarser than what is in memory.
        let late = opened(&path, 1 << 32);
        let drawn = || late.drawn(&view, &surface, detail, Wait::ForNone).unwrap();
        let mut rounds = 0;
        loop {
            let now = drawn();
            if !now.is_provisional() {
                break;
            }
            assert_eq!(now.pyramids()[0].nodes_hidden, 0, "it is not known yet");
            late.wish((&view, None), &surface, detail, Wait::ForNone);
            late.wait(Duration::from_secs(60)).unwrap();
            rounds += 1;
            assert!(rounds < 100);
        }
        // From what is in memory after motion.
        let n_moving = used(&plain, Wait::ForNoneInMotion).surfels_drawn;
        let first = plain.drawn(&view, &surface, detail, Wait::ForNone).unwrap();
        assert_eq!(first.pyramids()[0].surfels_drawn, n_moving);
        let come = lab.pictures(&late, view, detail, Wait::ForNone);
        assert!(come.iter().zip(&found).all(|(a, b)| a.data == b.data));
        assert_eq!(used(&late, Wait::ForNone).surfels_drawn, some.surfels_drawn);
    }
}

#[test]
fn what_is_not_there_yet_is_stood_for_by_its_parents_until_all_is_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let path = pyramid(folder.path());
    let clouds = opened(&path, 1 << 32);
    let mut lab = Lab::new(SurfelDrawing::Processor);
    let surface = lab.scene.surface;
    let missing =
        |clouds: &Clouds| clouds.drawn(&view(), &surface, 0.0, Wait::ForNone).unwrap().n_missing();
    assert!(missing(&clouds) > 0);
    let first = lab.pictures(&clouds, view(), 0.0, Wait::ForNone);
    let covered = |images: &[Image]| images[0].data.chunks_exact(4).filter(|p| p[3] > 0.0).count();
    let before = covered(&first);
    let mut rounds = 0;
    while missing(&clouds) > 0 {
        clouds.wish((&view(), None), &surface, 0.0, Wait::ForNone);
        while !clouds.wait(Duration::from_secs(60)).unwrap() {}
        let now = covered(&lab.pictures(&clouds, view(), 0.0, Wait::ForNone));
        assert!(now * 50 > before * 49, "a hole: {now} of {before} pixels");
        rounds += 1;
        assert!(rounds < 100);
    }
    while clouds.is_waited_for() {
        clouds.wait(Duration::from_secs(60)).unwrap();
    }
    clouds.wait(Duration::ZERO).unwrap();
    // Nothing is left to be read, so nobody waits.
    clouds.wish((&view(), None), &surface, 0.0, Wait::ForNone);
    assert!(!clouds.is_waited_for() && !clouds.wait(Duration::from_secs(60)).unwrap());
    let all = lab.pictures(&clouds, view(), 0.0, Wait::ForNone);
    let waited = lab.pictures(&opened(&path, 1 << 32), view(), 0.0, Wait::ForAll);
    assert!(all.iter().zip(&waited).all(|(a, b)| a.data == b.data));
}

#[test]
fn a_flight_of_two_thousand_frames_stays_within_its_memory() {
    // 1.5 s: nodes are chosen and read for each frame, and some frames are drawn.
    const BUDGET: u64 = 18_000_000;
    const DETAIL: f32 = 0.4;
    let folder = tempfile::tempdir().unwrap();
    let clouds = opened(&pyramid(folder.path()), BUDGET);
    let mut lab = Lab::new(SurfelDrawing::Processor);
    let surface = lab.scene.surface;
    let at = |frame: u32| {
        let turn = f64::from(frame) * 0.01;
        // From outside to within the waves and back, seven times.
        let away = 1.5 + 0.4 * (f64::from(frame) * 0.022).cos();
        stage::view(away * DVec3::new(turn.sin(), 0.3, turn.cos()), DVec3::ZERO, 300)
    };
    let (mut n_coarse, mut n_drawn, mut most) = (0, 0, 0);
    for frame in 0..2000 {
        let (view, next) = (at(frame), at(frame + 6));
        clouds.wish((&view, Some(&next)), &surface, DETAIL, Wait::ForNoneInMotion);
        // A frame's time, of which the test does not wait for all.
        clouds.wait(Duration::from_millis(2)).unwrap();
        let drawn = clouds.drawn(&view, &surface, DETAIL, Wait::ForNone).unwrap();
        n_coarse += u32::from(drawn.n_missing() > 0);
        let use_of = &drawn.pyramids()[0];
        most = most.max(use_of.memory.bytes);
        let bytes_drawn = 64 * use_of.surfels_drawn;
        assert!(use_of.memory.bytes + bytes_drawn <= BUDGET, "frame {frame}: {use_of:?}");
        drop(drawn);
        if frame % 100 == 0 {
            let image = &lab.pictures(&clouds, view, DETAIL, Wait::ForNone)[0];
            let waited = &lab.pictures(&clouds, view, DETAIL, Wait::ForAll)[0];
            let (_, apart) = difference(image, waited);
            let covered = waited.data.chunks_exact(4).filter(|p| p[3] > 0.0).count();
            assert!(apart * 50 < covered, "frame {frame}: a hole of {apart} in {covered} pixels");
            n_drawn += 1;
        }
    }
    let read = clouds.drawn(&at(0), &surface, DETAIL, Wait::ForNone).unwrap().pyramids()[0].memory;
    assert_eq!(n_drawn, 20);
    assert!(most > BUDGET / 8, "{most} bytes at most: the budget was no matter");
    assert!(read.nodes_read > 2 * read.nodes, "nothing had to go: {read:?}");
    // Most frames had all that they needed.
    assert!(n_coarse < 1500, "{n_coarse} frames lacked nodes");
}
