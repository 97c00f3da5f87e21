//! What pictures do not depend on.

use super::*;
use glam::Mat4;
use half::f16;
use std::array::from_fn;

/// Surfels on a sphere of radius 1 around (0, 0, -3).
fn sphere(n: usize) -> Columns {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let normals: Vec<f32> = (0..n)
        .flat_map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / n as f32;
            let (ring, angle) = ((1.0 - z * z).sqrt(), golden * i as f32);
            [ring * angle.cos(), ring * angle.sin(), z]
        })
        .collect();
    let away = |(i, x): (usize, &f32)| if i % 3 == 2 { x - 3.0 } else { *x };
    let positions: Vec<f32> = normals.iter().enumerate().map(away).collect();
    let radii: Vec<f32> =
        (0..n).map(|i| 4.0 / (n as f32).sqrt() * (1.0 + (i % 7) as f32)).collect();
    let ao: Vec<f32> = (0..n).map(|i| (i % 11) as f32 / 10.0).collect();
    let materials: Vec<u32> = (0..n).map(|i| (i / 500) as u32).collect();
    let sources = Sources {
        round: None,
        positions: &positions,
        normals: &normals,
        radii: &radii,
        tangents: None,
        ao: Some(&ao),
        materials: Some(&materials),
    };
    let order: Vec<u32> = (0..n as u32).collect();
    let halves = order.iter().map(|&i| [0, 1, 2, 3].map(|k| f16::from_f32((i * k % 255) as f32)));
    {
        let albedo = Albedo::Halves(halves.collect());
        Columns::new(&sources, &order, albedo, Splats::default(), true, &linear(), &|_| ())
    }
}

fn linear() -> [f32; 256] {
    from_fn(|code| (code as f32 / 255.0).powi(2))
}

fn view(orthographic: bool, detail_px: f32) -> View {
    View {
        // No multiple of a tile, nor of four pixels.
        size_px: [203, 101],
        half_extent: if orthographic { [2.2, 1.1] } else { [0.8, 0.4] },
        shift_px: [0.0; 2],
        near: 1e-3,
        orthographic,
        world_from_view: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        two_sided: true,
        back_albedo: None,
        low_pass: 1.0,
        tolerance: 1.0,
        tangent_scale: 1.0,
        unit: 1.0,
        detail_px,
    }
}

/// All that is made of a picture.
type Bits = (Vec<[u32; 2]>, Vec<[u32; 4]>, Vec<u32>, Vec<u32>);

fn drawn(level: Level, columns: [&Columns; 2], view: &View, mode: Mode) -> Bits {
    let moved = Mat4::from_translation(glam::Vec3::new(0.4, 0.1, 0.2));
    let clouds = [
        Cloud { columns: columns[0], view_from_cloud: Mat4::IDENTITY, first: 1, object: 0 },
        Cloud {
            columns: columns[1],
            view_from_cloud: moved,
            first: 1 + columns[0].len() as u32,
            object: 1,
        },
    ];
    let parts = Parts { mode, winners: true, material: true, object: true };
    let mut picture = Picture::default();
    draw_with(level, &clouds, view, parts, &linear(), &mut picture);
    (picture.winners, picture.packed, picture.material, picture.object)
}

#[test]
fn pictures_do_not_depend_on_the_processor_s_instructions_nor_on_threads() {
    let (one, other) = (sphere(4000), sphere(700));
    let threads = |n: usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let (single, several) = (threads(1), threads(3));
    for (orthographic, detail_px) in [(false, 0.0), (false, 9.0), (true, 0.0)] {
        let view = view(orthographic, detail_px);
        for mode in [Mode::Blended, Mode::Nearest] {
            let bits = |level| drawn(level, [&one, &other], &view, mode);
            let best = single.install(|| bits(Level::new()));
            let covered = best.0.iter().filter(|winner| winner[0] != 0).count();
            assert!(covered > 3000, "{covered} pixels");
            assert!(best == single.install(|| bits(Level::baseline())), "other instructions");
            assert!(best == several.install(|| bits(Level::new())), "three threads");
        }
    }
}

#[test]
fn what_is_drawn_into_used_memory_is_what_is_drawn_into_new() {
    let (large, small) = (sphere(2000), sphere(100));
    let parts = Parts { mode: Mode::Blended, winners: true, material: false, object: false };
    let mut used = Picture::default();
    let draw_into = |columns: &Columns, orthographic: bool, picture: &mut Picture| {
        let clouds = [Cloud { columns, view_from_cloud: Mat4::IDENTITY, first: 1, object: 0 }];
        draw(&clouds, &view(orthographic, 0.0), parts, &linear(), picture);
    };
    draw_into(&large, true, &mut used);
    draw_into(&small, false, &mut used);
    let mut fresh = Picture::default();
    draw_into(&small, false, &mut fresh);
    assert!(used.packed == fresh.packed && used.winners == fresh.winners);
    assert_eq!(used.drawn, fresh.drawn);
}

#[test]
fn winners_name_surfels_of_the_cloud_also_where_they_are_merged() {
    let columns = sphere(4000);
    let view = view(false, 30.0);
    let clouds =
        [Cloud { columns: &columns, view_from_cloud: Mat4::IDENTITY, first: 1, object: 0 }];
    let parts = Parts { mode: Mode::None, winners: true, material: true, object: false };
    let mut picture = Picture::default();
    draw(&clouds, &view, parts, &linear(), &mut picture);
    assert!(picture.drawn.surfels < 3900, "{:?}", picture.drawn);
    for (winner, material) in picture.winners.iter().zip(&picture.material) {
        let number = winner[0] & !(1 << 31);
        assert!(number <= 4000);
        if number > 0 {
            assert_eq!(*material, (number - 1) / 500, "materials are those of the surfels");
        }
    }
}
