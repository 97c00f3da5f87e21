//! Fewer and larger surfels, for pictures in motion.

use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_render::{Engine, RenderRequest};
use surfelshop_tests::{clouds, stage};

fn picture(engine: &mut Engine, cloud: &Cloud, view: View, stride: u32) -> Image {
    let mut renderer = stage::built_renderer(engine, "surfelshop_ewa_phong", "ewa-phong");
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene: &Scene::default(),
        view,
        values: &Values::new(),
        outputs: &[Output::Color],
        frame_index: 0,
        environment: None,
        stride,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    engine.render(&mut renderer, &request).unwrap().images.remove(0).1
}

fn covered(image: &Image) -> Vec<bool> {
    image.data.chunks_exact(4).map(|pixel| pixel[3] > 0.0).collect()
}

/// Invariant: fewer, larger surfels leave no holes
#[test]
fn a_subset_covers_what_the_whole_covers() {
    stage::each_way(|| {
        let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");
        let sample = surfelshop_cloud::read(sample, &Default::default()).unwrap().cloud;
        let sphere = clouds::sphere(50_000, 1.0).cloud();
        let mut engine = stage::engine();
        println!("| cloud | stride | holes | beside | colour off |\n|---|---|---|---|---|");
        for (what, cloud, eye) in [
            ("sphere", &sphere, DVec3::new(0.5, 1.0, 3.0)),
            ("sample", &sample, DVec3::new(1.5, 2.3, 3.8)),
        ] {
            let center = 0.5 * (cloud.facts().bounds_min + cloud.facts().bounds_max);
            let view = stage::view(eye, center, 256);
            let whole = picture(&mut engine, cloud, view, 1);
            let of_whole = covered(&whole);
            let n_whole = of_whole.iter().filter(|is| **is).count();
            assert!(n_whole > 10_000);
            for stride in [2, 4, 16, 64] {
                let part = picture(&mut engine, cloud, view, stride);
                let of_part = covered(&part);
                let pairs = of_whole.iter().zip(&of_part);
                let holes = pairs.clone().filter(|(whole, part)| **whole && !**part).count();
                let beside = pairs.filter(|(whole, part)| !**whole && **part).count();
                let mut off = 0.0;
                for (i, whole_pixel) in whole.data.chunks_exact(4).enumerate() {
                    if of_whole[i] && of_part[i] {
                        off += f64::from((whole_pixel[1] - part.data[4 * i + 1]).abs());
                    }
                }
                let off = off / n_whole as f64;
                println!("| {what} | {stride} | {holes} | {beside} | {off:.4} |");
                // Blades of grass thinner than the discs that are left may vanish.
                assert!(
                    holes * 200 <= n_whole,
                    "{what}, 1 of {stride}: {holes} of {n_whole} missing"
                );
            }
        }
    });
}

#[test]
fn no_stride_is_the_whole() {
    stage::each_way(|| {
        let cloud = clouds::sphere(3_000, 1.0).cloud();
        let view = stage::view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, 96);
        let mut engine = stage::engine();
        let whole = picture(&mut engine, &cloud, view, 1);
        assert!(whole == picture(&mut engine, &cloud, view, 0));
        // More than there are leaves one.
        let one = picture(&mut engine, &cloud, view, u32::MAX);
        assert!(one.data.iter().all(|value| value.is_finite()));
    });
}
