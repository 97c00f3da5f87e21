//! Clouds with next to nothing in them.

use glam::{DVec3, Vec3};
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_cloud::Cloud;
use surfelshop_tests::clouds::Surfels;
use surfelshop_tests::stage;

/// Covered pixels of the picture by each renderer, all of it checked to be finite.
fn covered(cloud: &Cloud) -> Vec<usize> {
    let mut engine = stage::engine();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
    [("surfelshop_flat", "flat"), ("surfelshop_ewa_phong", "ewa-phong")]
        .into_iter()
        .map(|(library, unit)| {
            let mut renderer = stage::built_renderer(&engine, library, unit);
            let outputs =
                [Output::Color, Output::Depth, Output::Normal, Output::Albedo, Output::Ao];
            let scene = Scene::default();
            let frame =
                stage::render(&mut engine, &mut renderer, cloud, &scene, view, &outputs).unwrap();
            for (output, image) in &frame.images {
                assert!(image.data.iter().all(|v| v.is_finite()), "{unit}: {output:?}");
            }
            let color = frame.image(&Output::Color).unwrap();
            color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count()
        })
        .collect()
}

#[test]
fn empty_cloud_draws_background() {
    stage::each_way(|| {
        assert_eq!(covered(&Surfels::default().cloud()), [0, 0]);
    });
}

#[test]
fn one_point_draws_one_splat() {
    stage::each_way(|| {
        let mut surfels = Surfels::default();
        surfels.push(Vec3::ZERO, Vec3::Z, 0.5);
        // A disc of radius 0.5 at distance 3 under 0.8 rad on 64 pixels: 490 pixels.
        for n in covered(&surfels.cloud()) {
            assert!((460..520).contains(&n), "{n}");
        }
    });
}

#[test]
fn equal_points_draw_one_splat() {
    stage::each_way(|| {
        let mut surfels = Surfels::default();
        for _ in 0..10_000 {
            surfels.push(Vec3::ZERO, Vec3::Z, 0.5);
        }
        for n in covered(&surfels.cloud()) {
            assert!((460..520).contains(&n), "{n}");
        }
    });
}

#[test]
fn opposite_normals_at_one_place_stay_finite() {
    stage::each_way(|| {
        let mut surfels = Surfels::default();
        for normal in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_X] {
            surfels.push(Vec3::ZERO, normal, 0.5);
        }
        assert!(covered(&surfels.cloud()).iter().all(|n| *n > 400));
    });
}

/// Invariant: no cloud, however degenerate, makes a pixel that is not finite
#[test]
fn extreme_radii_and_zero_normals_stay_finite() {
    stage::each_way(|| {
        let mut surfels = Surfels::default();
        for (i, radius) in [0.0, 1e-30, 1e-6, 0.1, 1e6, 1e30].iter().enumerate() {
            surfels.push(Vec3::new(i as f32 * 0.1, 0.0, 0.0), Vec3::Z, *radius);
            surfels.push(Vec3::new(i as f32 * 0.1, 0.2, 0.0), Vec3::ZERO, *radius);
        }
        covered(&surfels.cloud());
    });
}

#[test]
fn tangents_at_odds_with_the_normals_stay_finite() {
    stage::each_way(|| {
        let mut surfels = surfelshop_tests::clouds::sphere(300, 0.5).elliptical(0.5);
        for (i, tangents) in surfels.tangents.iter_mut().enumerate() {
            match i % 4 {
                // In the normal's direction, parallel to each other, one of no length, left-handed.
                0 => tangents[0] = surfels.normals[i] * 0.1,
                1 => tangents[1] = tangents[0],
                2 => tangents[1] = Vec3::ZERO,
                _ => tangents.swap(0, 1),
            }
        }
        assert!(covered(&surfels.cloud()).iter().all(|n| *n > 100));
    });
}

#[test]
fn transparent_colours_keep_their_albedo() {
    stage::each_way(|| {
        let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
                property float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
                property float radius\nproperty uchar red\nproperty uchar green\n\
                property uchar blue\nproperty uchar alpha\nend_header\n\
                -0.6 0 0 0 0 1 0.5 255 0 0 0\n0.6 0 0 0 0 1 0.5 255 0 0 255\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("alpha.ply");
        std::fs::write(&path, text).unwrap();
        let cloud = surfelshop_cloud::read(&path, &Default::default()).unwrap().cloud;
        let mut engine = stage::engine();
        let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
        let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 64);
        let (scene, outputs) = (Scene::default(), [Output::Albedo]);
        let frame =
            stage::render(&mut engine, &mut renderer, &cloud, &scene, view, &outputs).unwrap();
        let albedo = frame.image(&Output::Albedo).unwrap();
        for x in [17, 47] {
            assert_eq!(albedo.pixel(x, 32), [1.0, 0.0, 0.0, 1.0], "at {x}");
        }
    });
}
