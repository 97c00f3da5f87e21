//! Pictures that several renderers draw, each its own clouds.

use super::stage::{self, Gaussians};
use glam::{DQuat, DVec3, Quat, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::prelude::*;
use surfelshop_api::{View, static_plugin};
use surfelshop_cloud::{Cloud, Rotation, Transform};
use surfelshop_render::{Companion, Engine, Rendered, RendererView};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::stage::{built_renderer, each_way, engine, static_renderer, view};

static_plugin! { id: "org.surfelshop.test.together", renderers: [Lambert] }

/// Shades surfels as the renderers of Gaussians do.
struct Lambert;

impl Renderer for Lambert {
    const INFO: UnitInfo =
        UnitInfo::new("lambert", "Lambert", "Shades as Gaussians' renderers do.");
    type Params = ();

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<()>, graph: &mut Graph) -> Result<()> {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let text = include_str!("../../../plugins/gaussian-splatting/src/renderers/surface.wgsl");
        graph.pass(Pass::shading("shaded", text, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

const SIZE: u32 = 96;

fn front() -> View {
    view(DVec3::new(0.3, 0.4, 3.2), DVec3::ZERO, SIZE)
}

/// A ball of radius 1 in red.
fn ball() -> Cloud {
    colored(4000, [200, 60, 40], DVec3::ZERO)
}

fn colored(n: usize, color: [u8; 3], at: DVec3) -> Cloud {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let mut surfels = Surfels::default();
    for i in 0..n {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
        let (ring, angle) = ((1.0 - z * z).sqrt(), golden * i as f32);
        let out = Vec3::new(ring * angle.cos(), z, ring * angle.sin());
        surfels.push(0.9 * out, out, 3.0 / (n as f32).sqrt());
        surfels.colors.push(color);
    }
    let there = Transform { translation: at, ..Transform::default() };
    surfels.cloud().transformed(&there).unwrap()
}

/// Half transparent Gaussians in a slab that cuts the ball.
fn slab() -> Cloud {
    let mut all = Gaussians::default();
    for i in 0..40 * 40 {
        let [x, y] = [i % 40, i / 40].map(|k| 0.08 * (k as f32 - 19.5));
        all.push(Vec3::new(x, y, 0.7 * x), [0.06; 3], Quat::IDENTITY, 0.6, [-0.5, 0.4, 1.2]);
    }
    all.cloud()
}

/// A renderer and its clouds.
type Part<'a> = (&'a str, &'a [u32]);

fn start(engine: &Engine, unit: &str) -> RendererView {
    match unit {
        "lambert" => static_renderer::<SurfelshopPackage>(engine, 0),
        "ewa-phong" => built_renderer(engine, "surfelshop_ewa_phong", unit),
        "flat" => built_renderer(engine, "surfelshop_flat", unit),
        _ => stage::renderer(engine, unit),
    }
}

/// A picture by several renderers: the first draws what the others do not.
fn together(
    engine: &mut Engine,
    clouds: &[&Cloud],
    first: &str,
    others: &[Part<'_>],
    outputs: &[Output],
) -> Rendered {
    let mut renderer = start(engine, first);
    let companion = |(unit, clouds): &Part<'_>| Companion {
        name: (*unit).to_owned(),
        view: start(engine, unit),
        values: Values::new(),
        clouds: clouds.to_vec(),
    };
    let others = others.iter().map(companion).collect();
    renderer.share(first, others);
    let none = Values::new();
    let frame = stage::frame(engine, &mut renderer, clouds, front(), &none, outputs).unwrap();
    stage::all_finite(&frame, first);
    frame
}

/// The largest difference of two pictures in a channel, as a screen shows them.
fn apart(a: &Rendered, b: &Rendered) -> f64 {
    let of = |frame: &Rendered| stage::pixels(frame, &Output::Color);
    let channel = |value: f32| stage::encoded(f64::from(value.max(0.0)));
    let both = of(a).into_iter().zip(of(b));
    let differences =
        both.flat_map(|(a, b)| (0..4).map(move |k| (channel(a[k]) - channel(b[k])).abs()));
    differences.fold(0.0, f64::max)
}

const COLOR: [Output; 1] = [Output::Color];

/// Against one renderer that shades the surfels alike: where the slab stands as it is, moved, turned and scaled. Costs
/// 2 s.
#[test]
fn a_ball_cut_by_gaussians_is_as_one_renderer_draws_both() {
    each_way(|| {
        let mut engine = engine();
        let (ball, slab) = (ball(), slab());
        let places = [
            Transform::default(),
            Transform { translation: DVec3::new(0.2, -0.3, 0.4), ..Transform::default() },
            Transform {
                rotation: Rotation::Quaternion(DQuat::from_rotation_x(0.8)),
                scale: 0.7,
                ..Transform::default()
            },
        ];
        for unit in stage::UNITS {
            for place in &places {
                let slab = slab.transformed(place).unwrap();
                let one = together(&mut engine, &[&ball, &slab], unit, &[], &COLOR);
                let others: [Part<'_>; 1] = [(unit, &[1])];
                let both = together(&mut engine, &[&ball, &slab], "lambert", &others, &COLOR);
                let off = apart(&one, &both);
                assert!(off < 2e-3, "{unit}, {place:?}: {off}");
                let alone = together(&mut engine, &[&ball], "lambert", &[], &COLOR);
                let seen = apart(&alone, &both);
                assert!(seen > 0.2, "{unit}: the slab is seen: {seen}");
                let names: Vec<&str> = both.passes.iter().map(|pass| pass.name.as_str()).collect();
                assert!(names.contains(&"lambert: shaded"), "{names:?}");
                assert!(names.contains(&format!("{unit}: splats").as_str()), "{names:?}");
                let parts: Vec<_> = both.parts.iter().map(|p| (&p.clouds, &p.taken)).collect();
                assert_eq!(parts, [(&vec![0], &vec![]), (&vec![1], &vec![1])]);
            }
        }
    });
}

/// Costs 1 s.
#[test]
fn the_order_of_clouds_and_of_renderers_shows_in_no_bit() {
    each_way(|| {
        let mut engine = engine();
        let (ball, slab) = (ball(), slab());
        let outputs = [Output::Color, Output::Depth, Output::Normal, Output::Albedo];
        let a =
            together(&mut engine, &[&ball, &slab], "ewa-phong", &[("gaussians", &[1])], &outputs);
        let b =
            together(&mut engine, &[&slab, &ball], "ewa-phong", &[("gaussians", &[0])], &outputs);
        stage::equal_bits(&a, &b, "clouds");
        let c =
            together(&mut engine, &[&ball, &slab], "gaussians", &[("ewa-phong", &[0])], &outputs);
        stage::equal_bits(&a, &c, "renderers");
    });
}

/// Each pixel is that of the renderer whose cloud is nearest there, to the bit. Costs 1 s.
#[test]
fn two_renderers_of_surfels_show_each_its_own_clouds() {
    each_way(|| {
        let mut engine = engine();
        let left = colored(3000, [90, 160, 60], DVec3::new(-0.5, 0.0, 0.0));
        let right = colored(3000, [60, 90, 200], DVec3::new(0.5, 0.1, 0.2));
        let clouds = [&left, &right];
        let phong = together(&mut engine, &clouds, "ewa-phong", &[], &COLOR);
        let flat = together(&mut engine, &clouds, "flat", &[], &COLOR);
        let both = together(&mut engine, &clouds, "ewa-phong", &[("flat", &[1])], &COLOR);
        let of = |frame: &Rendered| stage::pixels(frame, &Output::Color);
        let (phong, flat, both) = (of(&phong), of(&flat), of(&both));
        let mut counts = [0; 2];
        for ((own, other), shown) in phong.iter().zip(&flat).zip(&both) {
            assert!(shown == own || shown == other, "{shown:?} is neither {own:?} nor {other:?}");
            if own != other {
                counts[usize::from(shown == other)] += 1;
            }
        }
        assert!(counts.iter().all(|n| *n > 500), "{counts:?}");
        // One of its own alone.
        let alone = together(&mut engine, &clouds, "ewa-phong", &[("flat", &[0, 1])], &COLOR);
        assert_eq!(of(&alone), flat);
        assert!(alone.parts.is_empty(), "one renderer draws all");
    });
}

/// A renderer of Gaussians shades surfels of its own beside those of another. Costs 1 s.
#[test]
fn own_surfels_of_a_renderer_of_gaussians_end_where_others_are_nearer() {
    each_way(|| {
        let mut engine = engine();
        let slab = slab();
        let left = colored(3000, [90, 160, 60], DVec3::new(-0.5, 0.0, 0.0));
        let right = colored(3000, [60, 90, 200], DVec3::new(0.5, 0.1, 0.2));
        let clouds = [&slab, &left, &right];
        let one = together(&mut engine, &clouds, "gaussians", &[], &COLOR);
        let both = together(&mut engine, &clouds, "gaussians", &[("lambert", &[2])], &COLOR);
        let off = apart(&one, &both);
        assert!(off < 2e-3, "{off}");
    });
}

/// Of two renderers of Gaussians the nearer one lies over the other, whichever comes first. Costs 0.5 s.
#[test]
fn gaussians_of_two_renderers_lie_over_each_other_by_distance() {
    let mut engine = engine();
    let wall = |z: f32, color: [f32; 3]| {
        let mut all = Gaussians::default();
        for i in 0..30 * 30 {
            let [x, y] = [i % 30, i / 30].map(|k| 0.1 * (k as f32 - 14.5));
            all.push(Vec3::new(x, y, z), [0.1; 3], Quat::IDENTITY, 0.9, color);
        }
        all.cloud()
    };
    let (near, far) = (wall(0.8, [1.5, -1.0, -1.0]), wall(-0.8, [-1.0, -1.0, 1.5]));
    let middle = (SIZE * SIZE / 2 + SIZE / 2) as usize;
    for (clouds, first, other) in [
        ([&near, &far], "gaussians", ("gaussians-2d", &[1u32])),
        ([&far, &near], "gaussians", ("gaussians-2d", &[1u32])),
        ([&far, &near], "gaussians-2d", ("gaussians", &[1u32])),
    ] {
        let others: [Part<'_>; 1] = [(other.0, other.1)];
        let frame = together(&mut engine, &clouds, first, &others, &COLOR);
        let [r, _, b, a] = stage::pixels(&frame, &Output::Color)[middle];
        assert!(r > 0.5 && b < 0.1 && a > 0.99, "{first}: {r} {b} {a}");
    }
}

/// What the pointer reads: the nearer of the surface and of what hides half of it. Costs 0.5 s.
#[test]
fn depths_are_of_what_is_seen() {
    each_way(|| {
        let mut engine = engine();
        let (ball, slab) = (ball(), slab());
        let depth = [Output::Depth];
        let firsts = |frame: &Rendered| stage::firsts(frame.image(&Output::Depth).unwrap());
        let clouds = [&ball, &slab];
        let surface = firsts(&together(&mut engine, &[&ball], "lambert", &[], &depth));
        let own = firsts(&together(&mut engine, &clouds, "gaussians", &[], &depth));
        let others: [Part<'_>; 1] = [("gaussians", &[1])];
        let both = firsts(&together(&mut engine, &clouds, "lambert", &others, &depth));
        engine.show_whole_depths(true);
        let whole = firsts(&together(&mut engine, &clouds, "gaussians", &[], &depth));
        engine.show_whole_depths(false);
        let mut counts = [0; 3];
        for (((surface, own), both), whole) in surface.iter().zip(&own).zip(&both).zip(&whole) {
            let seen = match (*own > 0.0, *surface > 0.0) {
                (true, true) => own.min(*surface),
                (true, false) => *own,
                _ => *surface,
            };
            assert!((both - seen).abs() <= 1e-5 * seen, "{both} is not {seen}");
            assert!((whole - seen).abs() <= 1e-5 * seen, "{whole} is not {seen}");
            counts[0] += usize::from(*own > 0.0 && *surface == 0.0);
            counts[1] += usize::from(*own > 0.0 && *surface > 0.0 && own < surface);
            counts[2] += usize::from(*own == 0.0 && *surface > 0.0);
        }
        assert!(counts.iter().all(|n| *n > 50), "{counts:?}");
    });
}

/// Costs 0.2 s.
#[test]
fn what_nobody_offers_is_refused_by_name_and_drawing_goes_on() {
    let mut engine = engine();
    let (ball, slab) = (ball(), slab());
    let mut renderer = start(&engine, "lambert");
    let gaussians = start(&engine, "gaussians");
    let (name, clouds) = ("gaussians".to_owned(), vec![1]);
    let others = vec![Companion { name, view: gaussians, values: Values::new(), clouds }];
    renderer.share("lambert", others);
    let none = Values::new();
    let mut draw = |clouds: &[&Cloud], outputs: &[Output]| {
        stage::frame(&mut engine, &mut renderer, clouds, front(), &none, outputs)
    };
    let line = draw(&[&ball, &slab], &[Output::Debug("nothing".to_owned())]).unwrap_err();
    let line = line.to_string();
    for word in ["`debug.nothing`", "debug.expected-depth", "albedo"] {
        assert!(line.contains(word) && !line.contains('\n'), "{line}");
    }
    // A cloud that lacks what its renderer needs.
    let line = draw(&[&ball, &clouds::sphere(500, 1.0).cloud()], &COLOR).unwrap_err().to_string();
    assert!(line.contains("splat_scale"), "{line}");
    draw(&[&ball, &slab], &[Output::Color, stage::expected_depth()]).unwrap();
}
