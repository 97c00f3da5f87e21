//! Antialiased coverage against areas that are known.

use super::{Subject, flat, parallel, session};
use glam::{DVec3, Vec2};
use surfelshop_api::graph::Output;
use surfelshop_api::{View, columns};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::Image;
use surfelshop_session::options::SurfelChoice;
use surfelshop_session::session::RenderSession;
use surfelshop_tests::clouds;

/// Ellipses that face the viewer, by their centres and half axes.
fn ellipses(all: &[[Vec2; 3]]) -> Cloud {
    let flat = |i: usize| all.iter().flat_map(|e| [e[i].x, e[i].y, 0.0]).collect();
    let column = |name: &str, values: Vec<f32>| Column::new(name, 3, Buffer::F32(values));
    let normals = all.iter().flat_map(|_| [0.0, 0.0, 1.0]).collect();
    Cloud::new(
        DVec3::ZERO,
        vec![
            column(columns::POSITION, flat(0)),
            column(columns::NORMAL, normals),
            column(columns::TANGENT_U, flat(1)),
            column(columns::TANGENT_V, flat(2)),
        ],
    )
    .unwrap()
}

fn color(session: &mut RenderSession, subject: &mut Subject, view: View, n_samples: u32) -> Image {
    subject.request(view, None, &[Output::Color], |renderer, request| {
        let settled = session.settle_view_antialiased(renderer, request, n_samples).unwrap();
        assert_eq!(settled.n_samples, n_samples);
        settled.rendered.image(&Output::Color).unwrap().clone()
    })
}

fn coverages(image: &Image) -> impl Iterator<Item = f64> {
    image.data.as_chunks::<4>().0.iter().map(|pixel| f64::from(pixel[3]))
}

/// Invariant: antialiased, a rod thinner than a pixel covers its area
#[test]
fn a_thin_rod_covers_its_area() {
    for way in [SurfelChoice::Cpu, SurfelChoice::Quads, SurfelChoice::Compute] {
        let mut session = session(way);
        // A pixel is a scene unit.
        let view = parallel(96.0, 96);
        for turn in [0.13, 0.35, 0.5, 0.6, std::f32::consts::FRAC_PI_4, 1.1] {
            let along = Vec2::from_angle(turn);
            let (length, width) = (40.3, 0.37);
            let rod = [Vec2::new(0.21, -0.37), length * along, width * along.perp()];
            let mut subject = flat(&session, ellipses(&[rod]));
            let area = std::f64::consts::PI * f64::from(length * width);
            let mut off = |n| {
                let image = color(&mut session, &mut subject, view, n);
                coverages(&image).sum::<f64>() / area - 1.0
            };
            let found = [1, 16, 32].map(&mut off);
            println!("{way:?}, turned by {turn}: {found:.4?}");
            // The device snaps corners to 1/256 pixel, of which the rod is two hundred wide.
            let snapped = if way == SurfelChoice::Quads { 0.005 } else { 0.0 };
            assert!(found[1].abs() < 0.02 + snapped, "{way:?} {turn}: {found:?}");
            assert!(found[2].abs() < 0.01 + snapped, "{way:?} {turn}: {found:?}");
        }
    }
}

/// The root mean squared error of coverage in pixels that an edge goes through.
fn error_at_edges(found: &Image, truth: &[f64]) -> f64 {
    let at_edges = coverages(found).zip(truth).filter(|(_, truth)| **truth > 0.0 && **truth < 1.0);
    let squares: Vec<f64> = at_edges.map(|(found, truth)| (found - truth).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Means over squares of pixels.
fn boxes(fine: &Image, side: u32) -> Vec<f64> {
    let size = fine.width / side;
    let mut means = vec![0.0; (size * size) as usize];
    for (i, covered) in coverages(fine).enumerate() {
        let (x, y) = (i as u32 % fine.width / side, i as u32 / fine.width / side);
        means[(y * size + x) as usize] += covered / f64::from(side * side);
    }
    means
}

/// Invariant: antialiased edges approach those of 256 samples a pixel faster than with the square root of the number
#[test]
fn silhouettes_approach_those_of_many_samples() {
    let mut session = session(SurfelChoice::Cpu);
    let mut subject = flat(&session, clouds::sphere(3_000, 1.0).cloud());
    let view = parallel(2.3, 48);
    let fine = View { size_px: [48 * 16; 2], ..view };
    let truth = boxes(&color(&mut session, &mut subject, fine, 1), 16);
    let counts = [1u32, 2, 4, 8, 16, 32, 64];
    let errors =
        counts.map(|n| error_at_edges(&color(&mut session, &mut subject, view, n), &truth));
    println!("frames {counts:?}, errors of coverage at edges {errors:.4?}");
    let slope = (errors[0] / errors[6]).ln() / 64f64.ln();
    println!("the error falls with N to the power of -{slope:.2}");
    assert!((0.65..1.2).contains(&slope), "{errors:?}: {slope}");
    assert!(errors[4] < 0.2 * errors[0], "{errors:?}");
}

/// A disc of one colour before nothing: wherever it covers something, that colour is whole, and its coverage is
/// what falls.
#[test]
fn colours_stay_whole_where_coverage_falls() {
    let mut session = session(SurfelChoice::Cpu);
    let disc = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let mut subject = flat(&session, ellipses(&[disc]));
    let image = color(&mut session, &mut subject, parallel(3.0, 32), 16);
    let middle = image.pixel(16, 16).to_vec();
    assert!(middle[3] == 1.0 && middle[0] > 0.0, "{middle:?}");
    let mut n_partly = 0;
    for pixel in image.data.as_chunks::<4>().0.iter().filter(|pixel| pixel[3] > 0.0) {
        n_partly += u32::from(pixel[3] < 1.0);
        for channel in 0..3 {
            let (found, whole) = (pixel[channel], middle[channel]);
            assert!((found - whole).abs() <= 1e-4 * whole, "{pixel:?} of {middle:?}");
        }
    }
    assert!(n_partly > 30, "{n_partly}");
}
