//! Splats that a function tells pixel by pixel.

use super::scripted::{SIZE, Script, drawn, drawn_at, refused};
use super::stage::{self, Gaussians};
use glam::{DMat3, DVec3};
use surfelshop_api::columns::{OPACITY, POSITION, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_render::{Engine, EngineOptions, GpuOptions, Rendered};
use surfelshop_tests::stage::{each_way, engine, engine_with};

const COMPOSITIONS: [Composition; 6] = [
    Composition::Over,
    Composition::Additive,
    Composition::Nearest,
    Composition::Stochastic { samples: 8 },
    Composition::Normalized { tolerance: 0.0 },
    Composition::Normalized { tolerance: 0.1 },
];

/// Gaussians of a cloud in both shapes, and functions of pixels.
const GAUSSIANS: &str = "
    #import surfelshop::splat
    #import cloud

    fn shown(i: u32, made: splat::Splat) -> splat::Splat {
        var s = made;
        s.opacity *= cloud::opacity(i);
        s.payload[0] = vec4(fract(0.37 * f32(i)), fract(0.73 * f32(i)), 0.2, 1.0);
        s.payload[1] = vec4(cloud::position(i), 1.0);
        return s;
    }

    fn conic(i: u32) -> splat::Splat {
        let turned = splat::rotation(cloud::splat_rotation(i));
        let scale = cloud::splat_scale(i);
        let axes = mat3x3(turned[0] * scale.x, turned[1] * scale.y, turned[2] * scale.z);
        return shown(i, splat::gaussian(cloud::position(i), axes, 0.3, false));
    }

    fn planar(i: u32) -> splat::Splat {
        let turned = splat::rotation(cloud::splat_rotation(i));
        let scale = cloud::splat_scale(i);
        let made = splat::planar(cloud::position(i), turned[0] * scale.x, turned[1] * scale.y);
        return shown(i, made);
    }

    fn same(p: splat::Pixel) -> splat::Fragment {
        return splat::Fragment(p.opacity, p.payload);
    }
";

/// A picture of one number of three textures.
const SHOW: &str = "
    var a: texture_2d<f32>;
    var b: texture_2d<f32>;
    var c: texture_2d<f32>;
    @fragment fn show(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
        let pixel = vec2<u32>(at.xy);
        return vec4(textureLoad(a, pixel, 0).x, textureLoad(b, pixel, 0).x, textureLoad(c, pixel, 0).x, 0.0);
    }";

/// The Gaussians of a cloud, which a function of pixels changes where there is one: sums, or depths.
fn gaussians(
    engine: &mut Engine,
    all: &Gaussians,
    footprint: Footprint,
    composition: Composition,
    function: Option<&'static str>,
    of_depths: bool,
) -> Rendered {
    let cloud = all.cloud();
    let described = move |frame: &Frame<Script>, graph: &mut Graph| {
        let columns = [
            BufferColumn::new(POSITION, 3),
            BufferColumn::new(SPLAT_SCALE, 3),
            BufferColumn::new(SPLAT_ROTATION, 4),
            BufferColumn::new(OPACITY, 1),
        ];
        let (n, cloud) = graph.columns("cloud", &frame.cloud, &[0], &columns);
        let entry = if footprint == Footprint::Conic { "conic" } else { "planar" };
        let mut texture = |name: &str, format| graph.texture(name, Texture::view_sized(format));
        let [sums, places, shown] =
            ["sums", "places", "shown"].map(|name| texture(name, Format::Rgba32Float));
        let depths = [SplatDepth::Expected, SplatDepth::Median, SplatDepth::Distortion]
            .map(|which| (which, texture(&format!("{which:?}"), Format::R32Float)));
        let mut pass = Pass::splats("splats", GAUSSIANS, entry, footprint, n)
            .reads(&cloud)
            .composed(composition)
            .target(sums)
            .target(places);
        if let Some(function) = function {
            pass = pass.per_pixel(function);
        }
        if of_depths {
            pass = depths.iter().fold(pass, |pass, (which, texture)| pass.depth(*which, *texture));
        }
        graph.pass(pass);
        let show = Pass::fullscreen("show", SHOW, "show")
            .bind("a", depths[0].1)
            .bind("b", depths[1].1)
            .bind("c", depths[2].1);
        if of_depths {
            graph.pass(show.target(shown));
        }
        graph.output(Output::Color, if of_depths { shown } else { sums });
    };
    drawn(engine, &[&cloud], described).unwrap()
}

/// Costs 4 s.
#[test]
fn a_function_that_changes_nothing_changes_no_bit() {
    let all = Gaussians::generated(300);
    each_way(|| {
        let mut engine = engine();
        for footprint in [Footprint::Conic, Footprint::Planar] {
            for composition in COMPOSITIONS {
                for of_depths in [false, true] {
                    let mut draw = |function| {
                        gaussians(&mut engine, &all, footprint, composition, function, of_depths)
                    };
                    let [plain, changed] =
                        [None, Some("same")].map(|f| draw(f).images[0].1.data.clone());
                    let what = format!("{footprint:?} {composition:?} {of_depths}");
                    assert!(plain.iter().filter(|v| **v > 0.01).count() > 60, "{what}: {plain:?}");
                    let off = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-4 * b.abs().max(1.0);
                    let n = plain.iter().zip(&changed).filter(|(a, b)| off((a, b))).count();
                    // The CPU rounds exponents otherwise than the device, which decides a few steps.
                    assert!(200 * n <= plain.len(), "{what}: {n} of {} differ", plain.len());
                }
            }
        }
    });
}

/// By the device in all ways: tile by tile where surfels are drawn by the CPU, too. Costs 2 s.
#[test]
fn the_device_composes_them_whoever_draws_surfels() {
    let all = Gaussians::generated(300);
    let pictures = std::cell::RefCell::new(Vec::new());
    each_way(|| {
        let mut engine = engine();
        let (footprint, over) = (Footprint::Planar, Composition::Over);
        let frame = gaussians(&mut engine, &all, footprint, over, Some("same"), false);
        pictures.borrow_mut().push(frame);
    });
    let pictures = pictures.into_inner();
    let steps = ["compose", "blend quads", "compose"].map(|step| format!("host: splats, {step}"));
    for (frame, step) in pictures.iter().zip(&steps) {
        let names: Vec<&String> = frame.passes.iter().map(|pass| &pass.name).collect();
        let others = names.iter().filter(|name| steps.contains(name) && **name != step);
        assert!(names.contains(&step) && others.count() == 0, "{step}: {names:?}");
    }
    stage::equal_bits(&pictures[0], &pictures[2], "both ways");
}

/// The sums of a pass of `n` splats of this text, of functions `made` and `changed`.
fn changed(
    engine: &mut Engine,
    text: &str,
    footprint: Footprint,
    n: u64,
    composition: Composition,
) -> Vec<[f32; 4]> {
    let text = format!("#import surfelshop::splat\n{text}");
    let cloud = Gaussians::generated(1).cloud();
    let frame = drawn(engine, &[&cloud], move |_, graph| {
        let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
        let pass = Pass::splats("splats", &text, "made", footprint, n).composed(composition);
        graph.pass(pass.per_pixel("changed").target(sums));
        graph.output(Output::Color, sums);
    });
    stage::pixels(&frame.unwrap(), &Output::Color)
}

/// Pixels' centres.
fn centers() -> impl Iterator<Item = [f64; 2]> {
    (0..SIZE * SIZE).map(|at| [at % SIZE, at / SIZE].map(|k| f64::from(k) + 0.5))
}

#[track_caller]
fn near(found: [f32; 4], expected: [f64; 4], bound: f64, what: &str) {
    let off = (0..4).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max);
    assert!(off < bound, "{what}: {found:?}, expected {expected:?}");
}

/// What a function is told of a pixel, by formulas in f64. Costs 0.5 s.
#[test]
fn functions_are_told_where_they_are() {
    let mut engine = engine();
    let conic = "
        fn made(i: u32) -> splat::Splat {
            var s = splat::conic(vec2(7.0, 9.0), vec3(0.1, 0.02, 0.15), 5.0);
            s.opacity = 0.75;
            s.payload[0] = vec4(3.0, 0.0, 0.0, 0.0);
            return s;
        }
        fn changed(p: splat::Pixel) -> splat::Fragment {
            var f = splat::Fragment(1.0, p.payload);
            f.payload[0] = SHOWN;
            return f;
        }";
    let mut draw = |text: &str, shown: &str, footprint| {
        changed(&mut engine, &text.replace("SHOWN", shown), footprint, 1, Composition::Over)
    };
    let places = draw(conic, "vec4(p.place, p.exponent, p.depth)", Footprint::Conic);
    let others =
        draw(conic, "vec4(p.pixel, p.opacity, p.payload[0].x + f32(p.index))", Footprint::Conic);
    let mut n_inside = 0;
    for (at, [x, y]) in centers().enumerate() {
        let (dx, dy) = (x - 7.0, y - 9.0);
        let exponent = -0.5 * (0.1 * dx * dx + 0.04 * dx * dy + 0.15 * dy * dy);
        let opacity = 0.75 * exponent.exp();
        if (opacity * 255.0 - 1.0).abs() < 1e-3 {
            continue;
        }
        let [place, other] = match opacity > 1.0 / 255.0 {
            true => [[dx, dy, exponent, 5.0], [x, y, opacity, 3.0]],
            false => [[0.0; 4]; 2],
        };
        n_inside += usize::from(opacity > 1.0 / 255.0);
        near(places[at], place, 1e-5, &format!("{x} {y}"));
        near(others[at], other, 1e-5, &format!("{x} {y}"));
    }
    assert!(n_inside > 60, "{n_inside}");

    let planar = "
        fn made(i: u32) -> splat::Splat {
            return splat::planar(vec3(0.1, -0.2, 0.3), vec3(0.4, 0.0, 0.3), vec3(0.1, 0.5, -0.2));
        }
        fn changed(p: splat::Pixel) -> splat::Fragment {
            var f = splat::Fragment(1.0, p.payload);
            f.payload[0] = SHOWN;
            return f;
        }";
    let places = draw(planar, "vec4(p.place, p.exponent, p.depth)", Footprint::Planar);
    let seen = draw(planar, "vec4(splat::position_at(p), 1.0)", Footprint::Planar);
    // The front view: from (0, 0, 3) along -z, 0.8 rad high.
    let (eye, half) = (DVec3::new(0.0, 0.0, 3.0), 0.4f64.tan());
    let [center, u, v] =
        [[0.1, -0.2, 0.3], [0.4, 0.0, 0.3], [0.1, 0.5, -0.2]].map(DVec3::from_array);
    let mut n_inside = 0;
    for (at, [x, y]) in centers().enumerate() {
        let size = f64::from(SIZE);
        let ray = DVec3::new((2.0 * x / size - 1.0) * half, (1.0 - 2.0 * y / size) * half, -1.0);
        // s u + t v - depth ray = eye - center.
        let solved = DMat3::from_cols(u, v, -ray).inverse() * (eye - center);
        let exponent = -0.5 * solved.truncate().length_squared();
        if exponent > -(255f64).ln() + 1e-3 {
            n_inside += 1;
            let expected = [solved.x, solved.y, exponent, solved.z];
            near(places[at], expected, 2e-5, &format!("{x} {y}"));
            let place = eye + solved.z * ray;
            near(seen[at], [place.x, place.y, place.z, 1.0], 1e-5, &format!("{x} {y}"));
        }
    }
    assert!(n_inside > 60, "{n_inside}");
}

/// Costs 1 s.
///
/// Invariant: whatever a function of pixels returns, pictures are of finite numbers
#[test]
fn what_no_function_should_return_is_finite() {
    let text = "
        fn made(i: u32) -> splat::Splat {
            return splat::conic(vec2(8.0), vec3(1e-4, 0.0, 1e-4), 2.0);
        }
        // Numbers that are none, made of what compilers do not know.
        fn changed(p: splat::Pixel) -> splat::Fragment {
            let nan = bitcast<f32>(0x7fc00000u + p.index);
            let infinite = bitcast<f32>(0x7f800000u + p.index);
            var f = splat::Fragment(0.5, p.payload);
            f.payload[0] = vec4(1.0);
            switch u32(p.pixel.x) {
                case 0u: { f.opacity = nan; }
                case 1u: { f.opacity = -nan; }
                case 2u: { f.opacity = infinite; }
                case 3u: { f.opacity = -infinite; }
                case 4u: { f.opacity = 2.0; }
                case 5u: { f.opacity = -2.0; }
                case 6u: { f.opacity = 0.0; }
                case 7u: { f.payload[0] = vec4(nan, infinite, -infinite, 1.0); }
                case 8u: { f.opacity = nan; f.payload[0] = vec4(nan); }
                default: {}
            }
            return f;
        }";
    let mut engine = engine();
    for composition in COMPOSITIONS {
        if matches!(composition, Composition::Stochastic { .. }) {
            continue;
        }
        let found = changed(&mut engine, text, Footprint::Conic, 1, composition);
        // The nearest is all that is seen.
        let half = if composition == Composition::Nearest { 1.0 } else { 0.5 };
        for (at, [x, _]) in centers().enumerate() {
            let expected = match x as u32 {
                0 | 1 | 3 | 5 | 6 | 8 => [0.0; 4],
                2 | 4 => [1.0; 4],
                7 => [0.0, 0.0, 0.0, half],
                _ => [half; 4],
            };
            near(found[at], expected, 1e-6, &format!("{composition:?} {x}"));
        }
    }
    let chance = Composition::Stochastic { samples: 64 };
    let found = changed(&mut engine, text, Footprint::Conic, 1, chance);
    assert!(found.as_flattened().iter().all(|value| value.is_finite()));
    for (at, [x, _]) in centers().enumerate() {
        let expected = match x as u32 {
            0 | 1 | 3 | 5 | 6 | 8 => Some(0.0),
            2 | 4 => Some(1.0),
            _ => None,
        };
        match expected {
            Some(expected) => assert_eq!(found[at][3], expected, "{x}"),
            None => assert!((found[at][3] - 0.5).abs() < 0.35, "{x}: {}", found[at][3]),
        }
    }
}

/// An opaque disc hides all of what is behind it, and ends where its function says. Costs 0.3 s.
#[test]
fn kernels_other_than_gaussians_are_drawn() {
    let text = "
        fn made(i: u32) -> splat::Splat {
            var s = splat::conic(vec2(8.0), vec3(1.0 / 9.0, 0.0, 1.0 / 9.0), 2.0 + f32(i));
            s.opacity = splat::ending_at(1.0 + f32(i));
            s.payload[0] = vec4(f32(1u - i), f32(i), 0.0, 1.0);
            return s;
        }
        // A disc of one standard deviation before a parabola of two (Epanechnikov's kernel).
        fn changed(p: splat::Pixel) -> splat::Fragment {
            let squared = -2.0 * p.exponent;
            let disc = select(0.0, 1.0, squared <= 1.0);
            return splat::Fragment(select(1.0 - squared / 4.0, disc, p.index == 0u), p.payload);
        }";
    let mut engine = engine();
    let found = changed(&mut engine, text, Footprint::Conic, 2, Composition::Over);
    for (at, [x, y]) in centers().enumerate() {
        let squared = ((x - 8.0).powi(2) + (y - 8.0).powi(2)) / 9.0;
        let parabola = (1.0 - squared / 4.0).max(0.0);
        let expected = match squared <= 1.0 {
            true => [1.0, 0.0, 0.0, 1.0],
            false => [0.0, parabola, 0.0, parabola],
        };
        near(found[at], expected, 1e-6, &format!("{x} {y}"));
    }
}

/// Costs 0.3 s.
#[test]
fn functions_that_cannot_be_are_refused() {
    let cloud = Gaussians::generated(5).cloud();
    let mut engine = engine();
    let pass = |changed: &str, name: &'static str| {
        let text = format!(
            "#import surfelshop::splat
             #import cloud
             var<storage, read_write> counts: array<u32>;
             fn made(i: u32) -> splat::Splat {{
                 return splat::conic(vec2(8.0), vec3(0.1, 0.0, 0.1), cloud::opacity(i));
             }}
             {changed}"
        );
        move |frame: &Frame<Script>, graph: &mut Graph| {
            let columns = [BufferColumn::new(OPACITY, 1)];
            let (n, cloud) = graph.columns("cloud", &frame.cloud, &[0], &columns);
            let counts = graph.buffer("counts", Buffer::new(16));
            let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
            let pass = Pass::splats("splats", &text, "made", Footprint::Conic, n).reads(&cloud);
            graph.pass(pass.bind("counts", counts).per_pixel(name).target(sums));
            graph.output(Output::Color, sums);
        }
    };
    let good = "fn changed(p: splat::Pixel) -> splat::Fragment {
        return splat::Fragment(p.opacity, p.payload);
    }";
    drawn(&mut engine, &[&cloud], pass(good, "changed")).unwrap();
    for (changed, name, words) in [
        (good, "other", &["no function `other`", "made", "changed"] as &[&str]),
        (good, "", &["no name of a WGSL function"]),
        (good, "changed(p); //", &["no name of a WGSL function"]),
        (
            "fn changed(p: splat::Pixel) -> f32 { return p.opacity; }",
            "changed",
            &["`changed`", "splat::Fragment"],
        ),
        ("fn changed(p: vec2<f32>) -> splat::Fragment { return changed(p); }", "changed", &[]),
        (
            "fn changed(p: splat::Pixel) -> splat::Fragment { return p.shape; }",
            "changed",
            &["shape"],
        ),
        (
            "fn changed(p: splat::Pixel) -> splat::Fragment {
                counts[0] = 1u;
                return splat::Fragment(p.opacity, p.payload);
            }",
            "changed",
            &["`counts`", "`changed`", "only reads"],
        ),
    ] {
        let words = [&["pass `splats`"][..], words].concat();
        refused(&mut engine, &[&cloud], &words, pass(changed, name));
    }
    // What does not fit a binding the CPU would compose.
    let options = EngineOptions { part_splats: 2, ..EngineOptions::default() };
    let mut small = engine_with(&GpuOptions::default(), &options);
    let words = ["pass `splats`", "5 splats", "`changed`", "per_pixel"];
    refused(&mut small, &[&cloud], &words, pass(good, "changed"));
}

/// Opaque discs with a dark ring, as the manual has them.
const RINGED: &str = "
    #import surfelshop::splat
    #import cloud

    fn disc(i: u32) -> splat::Splat {
        let normal = cloud::normal(i);
        let across = select(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), abs(normal.x) > 0.6);
        let u = normalize(cross(normal, across));
        let radius = cloud::radius(i);
        var s = splat::planar(cloud::position(i), radius * u, radius * cross(normal, u));
        s.opacity *= splat::ending_at(1.0);
        s.payload[0] = vec4(0.5 + 0.5 * normal, 1.0);
        return s;
    }

    fn ringed(p: splat::Pixel) -> splat::Fragment {
        let squared = -2.0 * p.exponent;
        var f = splat::Fragment(select(0.0, 1.0, squared <= 1.0), p.payload);
        if squared > 0.6 {
            f.payload[0] = vec4(0.2 * p.payload[0].rgb, 1.0);
        }
        return f;
    }
";

/// A ball of discs whose kernel is the graph's own. Costs 0.3 s.
#[test]
fn a_ball_of_ringed_discs_is_whole_and_shows_rings() {
    let ball = surfelshop_tests::clouds::sphere(400, 1.0).cloud();
    let size = 160u32;
    let mut engine = engine();
    let frame = drawn_at(&mut engine, &[&ball], size, |frame, graph| {
        let columns = [
            BufferColumn::new(POSITION, 3),
            BufferColumn::new("normal", 3),
            BufferColumn::new("radius", 1),
        ];
        let (n, cloud) = graph.columns("cloud", &frame.cloud, &[0], &columns);
        let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
        let pass = Pass::splats("discs", RINGED, "disc", Footprint::Planar, n).reads(&cloud);
        let pass = pass.per_pixel("ringed").composed(Composition::Nearest);
        graph.pass(pass.target(sums));
        graph.output(Output::Color, sums);
    });
    let pixels = stage::pixels(&frame.unwrap(), &Output::Color);
    // Half the picture is 3 tan 0.4 wide at the middle; the ball's outline is seen at 1 / sqrt(8) of the distance.
    let of_middle = f64::from(size) / 2.0 / 0.4f64.tan() / 8f64.sqrt();
    let (mut n_inside, mut n_rings) = (0u32, 0u32);
    for (at, pixel) in (0..).zip(&pixels) {
        let off = |k: u32| f64::from(k) + 0.5 - f64::from(size) / 2.0;
        let distance = off(at % size).hypot(off(at / size));
        if distance < 0.93 * of_middle {
            assert_eq!(pixel[3], 1.0, "a hole {distance} pixels from the middle");
            n_inside += 1;
            // The normals that are seen have z above 0: blue of at least one half, or a fifth of it in a ring.
            n_rings += u32::from(pixel[2] < 0.21);
        }
        assert!(
            distance < 1.15 * of_middle || pixel[3] == 0.0,
            "{distance} pixels from the middle"
        );
    }
    let share = f64::from(n_rings) / f64::from(n_inside);
    // Tangent planes rise above the ball towards their rims: where discs overlap, rings are the nearest.
    assert!((0.5..0.999).contains(&share), "rings cover {share:.3} of the ball");
}
