//! Clouds beyond what one buffer holds are drawn in chunks, nobody can tell from the picture, and
//! memory grows with the columns alone.

use glam::DVec3;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_cloud::Cloud;
use surfelshop_render::{Engine, EngineOptions, GpuOptions, SurfelDrawing};
use surfelshop_tests::measure::{Cost, task_of_child, test_in_child};
use surfelshop_tests::{clouds, stage};

const RENDERERS: [(&str, &str); 2] =
    [("surfelshop_ewa_phong", "ewa-phong"), ("surfelshop_flat", "flat")];

const OUTPUTS: [Output; 4] = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];

fn engine(chunk_surfels: u32) -> Engine {
    // The CPU knows no chunks.
    let surfels = SurfelDrawing::Quads;
    let options = EngineOptions { chunk_surfels, surfels, ..EngineOptions::default() };
    stage::engine_with(&GpuOptions::default(), &options)
}

/// The bits of all pictures of both renderers.
fn pictures(engine: &mut Engine, cloud: &Cloud) -> Vec<u32> {
    let view = stage::view(DVec3::new(0.4, 0.7, 2.5), DVec3::ZERO, 160);
    let mut bits = Vec::new();
    for (library, unit) in RENDERERS {
        let mut renderer = stage::built_renderer(engine, library, unit);
        let scene = Scene::default();
        let frame = stage::render(engine, &mut renderer, cloud, &scene, view, &OUTPUTS).unwrap();
        let color = &frame.image(&Output::Color).unwrap().data;
        let covered = color.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count();
        assert!(covered > 5000, "{unit} covers {covered} pixels");
        bits.extend(frame.images.iter().flat_map(|(_, image)| &image.data).map(|v| v.to_bits()));
    }
    bits
}

#[test]
fn the_size_of_chunks_does_not_show() {
    let n = 300_000;
    let cloud = clouds::sphere(n, 1.0).cloud();
    let [(whole, bytes), (round, bytes_round), (odd, bytes_odd)] =
        [u32::MAX, 50_000, 77_777].map(|chunk| {
            let mut engine = engine(chunk);
            // As few chunks as the device's bindings allow, six, and four with a shorter last one.
            let bits = pictures(&mut engine, &cloud);
            let counters = engine.counters();
            if chunk != u32::MAX {
                assert_eq!(counters.chunks, n.div_ceil(chunk as usize));
            }
            assert_eq!(counters.uploads, 4, "position, normal, radius and color, once each");
            (bits, counters.column_bytes)
        });
    // However many chunks there are, every surfel is on the device once.
    assert!(bytes > 0 && bytes == bytes_round && bytes == bytes_odd);
    assert!(round == odd, "chunks of 50 000 and of 77 777 surfels make different pictures");
    assert!(whole == round, "the largest chunks and those of 50 000 make different pictures");
}

#[test]
fn a_chunk_of_one_surfel_is_drawn() {
    let cloud = clouds::sphere(300, 1.0).cloud();
    let mut singles = engine(1);
    let single = pictures(&mut singles, &cloud);
    assert_eq!(singles.counters().chunks, 300);
    assert!(single == pictures(&mut engine(u32::MAX), &cloud));
    // None is as few as one.
    assert!(single == pictures(&mut engine(0), &cloud));
}

#[test]
fn chunks_fit_the_bindings_of_the_device() {
    let mut engine = engine(u32::MAX);
    let limits = engine.gpu().device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    // The widest column has 12 bytes a surfel.
    assert!(u64::from(u32::MAX) * 12 > most, "the device binds more than 4 billion surfels");
    let cloud = clouds::sphere(2000, 1.0).cloud();
    pictures(&mut engine, &cloud);
}

/// The most memory drawing may take beyond a picture of one surfel, in sizes of the columns.
const MOST_MEMORY: f64 = 2.5;

/// The cloud that bound is for. A number of each takes 36 MB: of what is freed in pieces of at most 32 MiB, glibc
/// keeps some, more or less of it from run to run.
const MANY: usize = 9_000_000;

/// Draws a cloud with all renderers in a process of its own and returns its peak of memory in
/// bytes. A software device's memory is the process's, so that every copy of the columns counts.
fn peak_of_drawing(n_surfels: usize, chunk: u32) -> f64 {
    let task = format!("{n_surfels} {chunk}");
    let lines = test_in_child("size::memory_is_bounded_by_the_columns", &task).unwrap();
    let peak = Cost::from_lines(&lines).unwrap().peak;
    println!("{n_surfels} surfels in chunks of {chunk}: {:.1} MB", peak * 1e-6);
    peak
}

/// Stands for chunks where the CPU draws, which knows none.
const BY_PROCESSOR: u32 = 0;

fn drawing_engine(chunk: u32) -> Engine {
    if chunk != BY_PROCESSOR {
        return engine(chunk);
    }
    let options = EngineOptions { surfels: SurfelDrawing::Processor, ..EngineOptions::default() };
    stage::engine_with(&GpuOptions::default(), &options)
}

/// What the child does.
fn draw(task: &str) {
    let (n_surfels, chunk) = task.split_once(' ').unwrap();
    let (n_surfels, chunk) = (n_surfels.parse::<usize>().unwrap(), chunk.parse::<u32>().unwrap());
    let work = || {
        let cloud = clouds::wavy_sphere(n_surfels);
        let view = stage::view(DVec3::new(0.6, 0.8, 2.6), DVec3::ZERO, 512);
        let mut engine = drawing_engine(chunk);
        for (library, unit) in RENDERERS {
            let mut renderer = stage::built_renderer(&engine, library, unit);
            let (scene, outputs) = (Scene::default(), [Output::Color, Output::Depth]);
            stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs)?;
        }
        if chunk != BY_PROCESSOR {
            assert_eq!(engine.counters().chunks, n_surfels.div_ceil(chunk as usize));
        }
        Ok(())
    };
    println!("{}", Cost::of(work).unwrap().1.to_line());
}

/// Drawn whole: what is at work at a time grows less than the number of surfels, so that smaller clouds would say too
/// much. Costs 21 s.
///
/// Invariant: drawing nine million surfels, as quads or by the CPU, takes at most 2.5 times
/// their columns' memory, the columns themselves and a software device's memory included
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells a process its peak of memory")]
fn memory_is_bounded_by_the_columns() {
    if let Some(task) = task_of_child() {
        return draw(&task);
    }
    let chunk = EngineOptions::default().chunk_surfels;
    for chunk in [chunk, BY_PROCESSOR] {
        memory_is_bounded(chunk);
    }
}

fn memory_is_bounded(chunk: u32) {
    let one = peak_of_drawing(1, chunk);
    let check = |chunk: u32| {
        let share = (peak_of_drawing(MANY, chunk) - one) / (MANY * clouds::WAVY_BYTES) as f64;
        println!("drawn: {share:.2} x the columns");
        assert!(share <= MOST_MEMORY, "{share:.2} x the columns, at most {MOST_MEMORY}");
    };
    check(chunk);
    if chunk != BY_PROCESSOR && std::env::var("SURFELSHOP_LONG").is_ok_and(|value| value == "1") {
        check(700_001);
    }
}
