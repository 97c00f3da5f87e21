//! Which side of a surfel is seen, shown by a colour of its own.

use super::{Case, Way, render};
use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_image::Image;
use surfelshop_render::BACK_ALBEDO;
use surfelshop_tests::{clouds, stage};

/// Invariant: surfels seen from behind, and no others, are tinted in every way to draw; without it nothing changes
#[test]
fn backs_are_tinted_in_every_way_to_draw() {
    let mut sphere = clouds::sphere(3000, 1.0);
    // Normals of the left half point inwards.
    let flip = sphere.positions.iter().map(|position| position.x < 0.0);
    let flip: Vec<bool> = flip.collect();
    sphere.normals.iter_mut().zip(flip).filter(|(_, flip)| *flip).for_each(|(n, _)| *n = -*n);
    sphere.colors.clear();
    let mut colored = sphere.clone();
    colored.colors = vec![[0, 200, 0]; colored.positions.len()];
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 128);
    let tinted = |albedo: &[f32]| {
        let off = albedo.iter().zip(BACK_ALBEDO).map(|(found, back)| (found - back).abs());
        off.fold(0.0f32, f32::max) < 0.01
    };
    for mut way in std::iter::once(Way::quads()).chain(Way::others()) {
        for (name, surfels) in [("plain", &sphere), ("coloured", &colored)] {
            let case = Case::new(name, surfels, view);
            let mut shot = |tints| {
                way.engine.tint_backs(tints);
                let outputs = [Output::Albedo, Output::Color];
                [&mut way.flat, &mut way.ewa]
                    .map(|renderer| render(&mut way.engine, renderer, &case, &outputs).images)
            };
            let (before, found, after) = (shot(false), shot(true), shot(false));
            for renderer in 0..2 {
                let what = format!("{}, {name}, renderer {renderer}", way.name);
                for output in 0..2 {
                    let same = |images: &[(Output, Image)]| images[output].1.data.clone();
                    assert!(same(&before[renderer]) == same(&after[renderer]), "{what}");
                }
                let pixels = |images: &[(Output, Image)]| images[0].1.data.clone();
                let (plain, found) = (pixels(&before[renderer]), pixels(&found[renderer]));
                let pairs = plain.chunks_exact(4).zip(found.chunks_exact(4)).enumerate();
                let (mut left, mut right) = ([0; 2], [0; 2]);
                for (i, (plain, found)) in pairs.filter(|(_, (plain, _))| plain[3] > 0.0) {
                    assert!(!tinted(plain), "{what}");
                    match i % 128 {
                        // Discs of both sides meet in the middle.
                        x if x < 58 => left[usize::from(tinted(found))] += 1,
                        x if x >= 70 => right[usize::from(plain == found)] += 1,
                        _ => {}
                    }
                }
                // At the rim discs of the far side stick out, which show the other side.
                for [wrong, right] in [left, right] {
                    assert!(right > 1000 && wrong * 10 < right, "{what}: {wrong} {right}");
                }
            }
        }
    }
}
