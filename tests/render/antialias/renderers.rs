//! Antialiasing of every renderer: no renderer does anything for it.

use super::{Subject, parallel, session};
use glam::{DVec3, Vec2, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{EnvironmentView, Light, Scene, UnitKind, View, columns};
use surfelshop_cloud::scene::{ProbeSource, SceneEnvironment};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::{Image, PictureMean};
use surfelshop_render::{RenderRequest, Rendered, RendererView};
use surfelshop_runtime::plugins::Timeouts;
use surfelshop_session::antialias::shift_px;
use surfelshop_session::input::environment_map::{LoadedEnvironment, Probes};
use surfelshop_session::options::SurfelChoice;
use surfelshop_session::session::RenderSession;
use surfelshop_tests::{clouds, stage};

/// A renderer: its library, its id, and whole numbers of its parameters.
type Drawn = (&'static str, &'static str, &'static [(&'static str, i64)]);

/// Every built-in renderer.
const ALL: [Drawn; 8] = [
    ("surfelshop_flat", "flat", &[]),
    ("surfelshop_ewa_phong", "ewa-phong", &[]),
    ("surfelshop_environment", "environment", &[]),
    ("surfelshop_procedural", "procedural", &[]),
    ("surfelshop_phong_splatting", "phong-splatting", &[]),
    ("surfelshop_gaussian_splatting", "gaussians", &[]),
    ("surfelshop_gaussian_splatting", "gaussians-2d", &[]),
    // Two frames, of which the second is the mean of both.
    ("surfelshop_global_illumination", "global-illumination", &[("frames", 2), ("vpls", 16)]),
];

/// A sphere with the columns of surfels and of Gaussians.
fn ball() -> Cloud {
    let surfels = clouds::sphere(600, 1.0);
    let n = surfels.positions.len();
    let own = |name: &str, n: u32, values: Vec<f32>| Column::new(name, n, Buffer::F32(values));
    let repeated = |values: &[f32]| values.repeat(n);
    let vectors = |all: &[Vec3]| all.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
    let normals: Vec<Vec3> = surfels.positions.iter().map(|p| p.normalize_or(Vec3::Z)).collect();
    Cloud::new(
        DVec3::ZERO,
        vec![
            own(columns::POSITION, 3, vectors(&surfels.positions)),
            own(columns::NORMAL, 3, vectors(&normals)),
            own(columns::RADIUS, 1, repeated(&[0.12])),
            own(columns::SPLAT_SCALE, 3, repeated(&[0.05, 0.05, 0.05])),
            own(columns::SPLAT_ROTATION, 4, repeated(&[0.0, 0.0, 0.0, 1.0])),
            own(columns::OPACITY, 1, repeated(&[0.9])),
            own(columns::SH[0], 3, vectors(&normals)),
        ],
    )
    .unwrap()
}

fn subject(
    session: &RenderSession,
    (library, unit, ints): (&str, &str, &[(&str, i64)]),
) -> Subject {
    let loaded = stage::built_unit(library, UnitKind::Renderer, unit);
    let hosted = loaded.start(&session.engine.gpu().host_info(), &Timeouts::default()).unwrap();
    let renderer = RendererView::new(hosted, unit).needing(&loaded.description.needs);
    let values: Values =
        ints.iter().map(|(id, value)| ((*id).to_owned(), Value::Int(*value))).collect();
    let position = DVec3::new(2.0, 3.0, 4.0);
    let lights = vec![Light::Point { position, intensity: Vec3::splat(40.0) }];
    Subject { renderer, cloud: ball(), scene: Scene { lights, ..Scene::default() }, values }
}

fn around() -> LoadedEnvironment {
    Probes::default().light(&SceneEnvironment::new(ProbeSource::Sky), drop).unwrap()
}

/// All frames of a picture that is seen at one place in each pixel.
fn settled(
    session: &mut RenderSession,
    renderer: &mut RendererView,
    request: &RenderRequest<'_>,
    shift: Vec2,
) -> Rendered {
    let mut frame_index = 0;
    loop {
        let request = RenderRequest { frame_index, ..*request };
        let rendered = session.engine.render_shifted(renderer, &request, shift).unwrap();
        frame_index += 1;
        if !rendered.wants_another_frame {
            return rendered;
        }
    }
}

fn color(rendered: &Rendered) -> &Image {
    rendered.image(&Output::Color).unwrap()
}

fn equal_bits(a: &Image, b: &Image) -> bool {
    a.data.iter().map(|v| v.to_bits()).eq(b.data.iter().map(|v| v.to_bits()))
}

/// Invariant: for every renderer the antialiased picture is the mean of pictures that begin anew, each seen at another
/// place of all pixels, and its depth is that of the first
#[test]
fn antialiased_pictures_are_means_of_shifted_ones() {
    let around = around();
    let environment: EnvironmentView<'_> = around.view();
    let view = stage::view(DVec3::new(0.4, 0.6, 3.2), DVec3::ZERO, 33);
    let mut session = session(SurfelChoice::Auto);
    let outputs = [Output::Depth, Output::Color];
    for one in ALL {
        let mut subject = subject(&session, one);
        subject.request(view, Some(environment), &outputs, |renderer, request| {
            let together = session.settle_view_antialiased(renderer, request, 4).unwrap();
            let first = settled(&mut session, renderer, request, Vec2::ZERO);
            let mut mean = PictureMean::of(color(&first));
            for index in 1..4 {
                let further = settled(&mut session, renderer, request, shift_px(index, 4));
                assert!(!equal_bits(color(&further), color(&first)), "{}: not shifted", one.1);
                mean.add(color(&further)).unwrap();
            }
            assert!(equal_bits(color(&together.rendered), &mean.mean()), "{}", one.1);
            assert!(!equal_bits(color(&together.rendered), color(&first)), "{}", one.1);
            let depths = [&together.rendered, &first].map(|r| r.image(&Output::Depth).unwrap());
            assert!(equal_bits(depths[0], depths[1]), "{}: depth", one.1);
            // Without it nothing is another picture than before.
            let alone = session.settle_view_antialiased(renderer, request, 1).unwrap();
            let before = session.settle_view(renderer, request).unwrap();
            assert!(equal_bits(color(&alone.rendered), color(&before.rendered)), "{}", one.1);
            assert!(equal_bits(color(&alone.rendered), color(&first)), "{}", one.1);
            let frames = one.2.iter().find(|(id, _)| *id == "frames").map_or(1, |(_, n)| *n);
            let counted = [together.n_samples, together.n_frames, alone.n_frames].map(i64::from);
            assert_eq!(counted, [4, 4 * frames, frames], "{}", one.1);
        });
    }
}

/// Of parallel rays a shift is a step of the camera: what every renderer draws, its background and its splats included,
/// is what it draws from there.
#[test]
fn a_shift_of_parallel_rays_is_a_step_of_the_camera() {
    let around = around();
    let size = 40;
    let view = parallel(2.4, size);
    let shift = Vec2::new(0.4375, -0.3125);
    let step = 2.4 / f64::from(size);
    let mut stepped = view;
    let moved = step * DVec3::new(f64::from(shift.x), -f64::from(shift.y), 0.0);
    stepped.camera.eye += moved;
    stepped.camera.target += moved;
    for way in [SurfelChoice::Cpu, SurfelChoice::Quads] {
        let mut session = session(way);
        for one in ALL {
            let mut subject = subject(&session, one);
            let mut picture = |view: View, shift: Vec2| {
                subject.request(view, Some(around.view()), &[Output::Color], |renderer, request| {
                    color(&settled(&mut session, renderer, request, shift)).clone()
                })
            };
            let still = picture(view, Vec2::ZERO);
            let shifted = picture(view, shift);
            let expected = picture(stepped, Vec2::ZERO);
            let unlike = |other: &Image| {
                let pixels =
                    other.data.as_chunks::<4>().0.iter().zip(expected.data.as_chunks::<4>().0);
                let differs = |(a, b): &(&[f32; 4], &[f32; 4])| {
                    a.iter().zip(b.iter()).any(|(a, b)| (a - b).abs() > 0.01 * (1.0 + b.abs()))
                };
                pixels.filter(differs).count()
            };
            let (n_shifted, n_still) = (unlike(&shifted), unlike(&still));
            println!("{way:?}, {}: {n_shifted} pixels differ, unshifted {n_still}", one.1);
            assert!(n_still > 60 && n_shifted * 20 <= n_still, "{way:?}, {}: {n_shifted}", one.1);
        }
    }
}
