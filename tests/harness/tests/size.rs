//! Clouds beyond what one buffer holds are drawn in chunks, and nobody can tell from the picture.

#![allow(clippy::unwrap_used, reason = "a failed step is a failed test")]

use glam::DVec3;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_cloud::Cloud;
use surfelshop_engine::{Engine, EngineOptions, GpuOptions};
use surfelshop_tests::{clouds, stage};

const RENDERERS: [(&str, &str); 2] =
    [("surfelshop_ewa_phong", "ewa-phong"), ("surfelshop_flat", "flat")];

const OUTPUTS: [Output; 4] = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];

fn engine(chunk_surfels: u32) -> Engine {
    stage::engine_with(&GpuOptions::default(), &EngineOptions { chunk_surfels })
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
            // Six chunks, four with a shorter last one, and as few as the device's bindings allow.
            assert!(chunk == u32::MAX || n.div_ceil(chunk as usize) > 3);
            let bits = pictures(&mut engine, &cloud);
            let counters = engine.counters();
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
    let single = pictures(&mut engine(1), &cloud);
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
