//! A shifted frame shows what lies at that place of each pixel, and nothing else is shifted.

use super::{flat, parallel, session};
use glam::{DVec3, Vec2};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_image::Image;
use surfelshop_session::options::SurfelChoice;
use surfelshop_session::session::RenderSession;
use surfelshop_tests::{clouds, stage};

/// Pixels of a shifted picture to each side.
const SIZE: u32 = 40;

/// Places in a pixel to each side.
const PLACES: u32 = 2;

fn depth_of(session: &mut RenderSession, view: View, shift_px: Vec2) -> Image {
    let mut subject = flat(session, clouds::sphere(2_000, 1.0).cloud());
    subject.request(view, None, &[Output::Depth], |renderer, request| {
        let frame = session.engine.render_shifted(renderer, request, shift_px).unwrap();
        frame.image(&Output::Depth).unwrap().clone()
    })
}

/// Invariant: a shifted frame shows in each pixel what a picture of more pixels shows at that place
#[test]
fn shifted_frames_are_the_pixels_of_a_larger_picture() {
    let central = stage::view(DVec3::new(0.3, 0.4, 2.6), DVec3::new(0.05, 0.0, 0.0), SIZE);
    // Inside, where discs reach behind the near plane.
    let inside = stage::view(DVec3::new(0.3, 0.2, 0.97), DVec3::new(1.0, 0.1, 0.4), SIZE);
    for way in [SurfelChoice::Cpu, SurfelChoice::Quads, SurfelChoice::Compute] {
        let mut session = session(way);
        for view in [central, inside, parallel(2.2, SIZE)] {
            let fine = View { size_px: [SIZE * PLACES; 2], ..view };
            let fine = depth_of(&mut session, fine, Vec2::ZERO);
            let (mut n_unlike, mut n_covered) = (0, 0);
            for place in 0..PLACES * PLACES {
                let at = [place % PLACES, place / PLACES];
                let shift = at.map(|at| (at as f32 + 0.5) / PLACES as f32 - 0.5);
                let coarse = depth_of(&mut session, view, Vec2::from(shift));
                for (x, y) in (0..SIZE * SIZE).map(|i| (i % SIZE, i / SIZE)) {
                    let expected = fine.pixel(x * PLACES + at[0], y * PLACES + at[1])[0];
                    let found = coarse.pixel(x, y)[0];
                    n_covered += u32::from(expected > 0.0);
                    n_unlike += u32::from((found - expected).abs() > 1e-3 * expected);
                }
            }
            // The device snaps corners to parts of a pixel, which are smaller in the fine picture.
            println!("{way:?}: {n_unlike} of {n_covered} differ");
            assert!(n_covered > 2_000 && n_unlike * 100 <= n_covered, "{way:?}: {n_unlike}");
        }
    }
}

/// An unshifted picture, which pixels that are shifted the wrong way would resemble as well, is another one.
#[test]
fn a_shift_is_seen() {
    let mut session = session(SurfelChoice::Cpu);
    let view = parallel(2.2, SIZE);
    let pictures = [Vec2::ZERO, Vec2::new(0.25, 0.0), Vec2::new(0.0, 0.25)]
        .map(|shift| depth_of(&mut session, view, shift));
    assert!(pictures[0] != pictures[1] && pictures[0] != pictures[2] && pictures[1] != pictures[2]);
}
