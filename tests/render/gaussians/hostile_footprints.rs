//! Footprints that no function should return.

use super::scripted::{SIZE, drawn};
use super::stage::{self, Gaussians};
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_render::Engine;
use surfelshop_tests::stage::{each_way, engine};

const COMPOSITIONS: [Composition; 5] = [
    Composition::Over,
    Composition::Additive,
    Composition::Nearest,
    Composition::Stochastic { samples: 4 },
    Composition::Normalized { tolerance: 0.1 },
];

/// The first `N_ODD` are odd, in a footprint and nothing else; one behind them is a good one.
const ODD: &str = "
    #import surfelshop::splat
    const N_ODD = 72u;

    // Numbers that compilers do not know beforehand: NaN of both signs, infinities, and those that squares exceed.
    fn odd(i: u32) -> f32 {
        let zero = i / 1000u;
        switch i % 6u {
            case 0u: { return bitcast<f32>(0x7fc00000u + zero); }
            case 1u: { return bitcast<f32>(0xffc00001u + zero); }
            case 2u: { return bitcast<f32>(0x7f800000u + zero); }
            case 3u: { return bitcast<f32>(0xff800000u + zero); }
            case 4u: { return 3e38; }
            default: { return -3e38; }
        }
    }

    fn ones(made: splat::Splat) -> splat::Splat {
        var s = made;
        s.payload[0] = vec4(0.25, 0.5, 0.75, 1.0);
        return s;
    }

    fn conic(i: u32) -> splat::Splat {
        var s = splat::conic(vec2(8.0), vec3(0.1, 0.0, 0.1), 2.0);
        if i >= N_ODD { return ones(s); }
        s.distance.z = 1.0;
        switch i / 6u {
            case 0u: { s.shape.x = odd(i); }
            case 1u: { s.shape.y = odd(i); }
            case 2u: { s.shape.z = odd(i); }
            case 3u: { s.shape.w = odd(i); }
            case 4u: { s.distance.x = odd(i); }
            case 5u: { s.distance.z = odd(i); }
            case 6u: { s.center_px.x = odd(i); }
            case 7u: { s.center_px.y = odd(i); }
            // Negative definite, indefinite, a line, all of nothing, behind the eye, larger than any screen.
            case 8u: { s.shape = vec4(-0.1, 0.0, -0.1, 0.0); }
            case 9u: { s.shape = vec4(0.1, 1.0, 0.1, 0.0); }
            case 10u: { s.shape = vec4(0.0); }
            default: { s.distance.z = -1.0; }
        }
        return ones(s);
    }

    fn planar(i: u32) -> splat::Splat {
        var s = splat::planar(vec3(0.0), vec3(0.2, 0.0, 0.0), vec3(0.0, 0.2, 0.0));
        if i >= N_ODD { return ones(s); }
        switch i / 6u {
            case 0u: { s.shape.x = odd(i); }
            case 1u: { s.shape.y = odd(i); }
            case 2u: { s.shape.z = odd(i); }
            case 3u: { s.shape.w = odd(i); }
            case 4u: { s.distance.x = odd(i); }
            case 5u: { s.distance.y = odd(i); }
            case 6u: { s.distance.z = odd(i); }
            case 7u: { s.center_px.x = odd(i); }
            case 8u: { s.center_px.y = odd(i); }
            case 9u: { s.shape = vec4(0.0); }
            case 10u: { s.distance = vec3(0.0); }
            default: { s.distance = -s.distance; }
        }
        return ones(s);
    }
";

/// Opacities of a function, and what they are taken for.
const OPACITIES: &str = "
    #import surfelshop::splat
    fn faint(i: u32) -> splat::Splat {
        var s = splat::conic(vec2(8.0), vec3(0.1, 0.0, 0.1), 1.0);
        let zero = i / 1000u;
        switch i {
            case 0u: { s.opacity = bitcast<f32>(0x7fc00000u + zero); }
            case 1u: { s.opacity = bitcast<f32>(0xff800000u + zero); }
            case 2u: { s.opacity = -1.0; }
            default: { s.opacity = 0.0; }
        }
        s.payload[0] = vec4(1.0);
        return s;
    }
";

/// Coverage, both depths, and a number that is none where a sum is.
const SHOW: &str = "
    var sums: texture_2d<f32>;
    var expected: texture_2d<f32>;
    var median: texture_2d<f32>;
    @fragment fn show(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
        let pixel = vec2<u32>(at.xy);
        let sum = textureLoad(sums, pixel, 0);
        return vec4(
            sum.w, textureLoad(expected, pixel, 0).x, textureLoad(median, pixel, 0).x, dot(sum, vec4(1.0))
        );
    }";

/// Coverage, depths and the sum of channels of so many splats of a function.
fn picture(
    engine: &mut Engine,
    (wgsl, entry, footprint): (&'static str, &'static str, Footprint),
    n: u64,
    composition: Composition,
) -> Vec<[f32; 4]> {
    let cloud = Gaussians::generated(3).cloud();
    let drawn = drawn(engine, &[&cloud], move |_, graph| {
        let mut texture = |name: &str, format| graph.texture(name, Texture::view_sized(format));
        let sums = texture("sums", Format::Rgba32Float);
        let depths = [SplatDepth::Expected, SplatDepth::Median]
            .map(|which| (which, texture(&format!("{which:?}"), Format::R32Float)));
        let pass = Pass::splats("splats", wgsl, entry, footprint, n).composed(composition);
        let pass = depths.iter().fold(pass, |pass, (which, texture)| pass.depth(*which, *texture));
        graph.pass(pass.target(sums));
        let shown = graph.texture("shown", Texture::view_sized(Format::Rgba32Float));
        let show = Pass::fullscreen("show", SHOW, "show").bind("sums", sums);
        let show = show.bind("expected", depths[0].1).bind("median", depths[1].1);
        graph.pass(show.target(shown));
        graph.output(Output::Color, shown);
    });
    let drawn = drawn.unwrap_or_else(|error| panic!("{entry}, {composition:?}: {error}"));
    stage::all_finite(&drawn, &format!("{entry}, {composition:?}"));
    stage::pixels(&drawn, &Output::Color)
}

/// Sums and depths, by each way to draw. Costs 2 s.
#[test]
fn footprints_that_no_function_should_return_leave_finite_pictures() {
    const N_ODD: u64 = 72;
    each_way(|| {
        let mut engine = engine();
        let middle = (SIZE / 2 * SIZE + SIZE / 2) as usize;
        for (entry, footprint) in [("conic", Footprint::Conic), ("planar", Footprint::Planar)] {
            for composition in COMPOSITIONS {
                let kind = (ODD, entry, footprint);
                let found = picture(&mut engine, kind, N_ODD + 1, composition);
                assert!(found[middle][0] > 0.4, "{entry}, {composition:?}: {:?}", found[middle]);
            }
        }
        for composition in COMPOSITIONS {
            let kind = (OPACITIES, "faint", Footprint::Conic);
            let found = picture(&mut engine, kind, 4, composition);
            assert!(found.as_flattened().iter().all(|value| *value == 0.0), "{composition:?}");
        }
    });
}
