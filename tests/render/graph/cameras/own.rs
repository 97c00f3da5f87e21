//! Passes that look from cameras of their graph.

use crate::graph::cameras::bench::{Bench, SIZE, back_to_back, behind, look, show};
use glam::{DVec3, Vec3};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_render::SurfelDrawing;

const WAYS: [SurfelDrawing; 3] =
    [SurfelDrawing::Quads, SurfelDrawing::Compute, SurfelDrawing::Processor];

#[track_caller]
fn close(found: &[f32], expected: &[f32]) {
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-3, "{found:?} is not {expected:?}");
}

/// Which of the two is seen, from where, and how large the picture is.
///
/// Invariant: passes of a graph that look from a camera of it see the surface, the lights and
/// the size of the picture from there; a camera that rests is not drawn again, and one that
/// moves compiles nothing
#[test]
fn a_pass_seen_from_a_camera_sees_the_surface_from_there() {
    let parallel = |view: View| {
        let mut view = View { far: 10.0, ..view };
        view.camera.projection = Projection::Orthographic { height: 2.0 };
        view
    };
    for (surfels, camera) in
        WAYS.into_iter().flat_map(|way| [(way, behind()), (way, parallel(behind()))])
    {
        let mut bench = Bench::drawing(surfels, vec![back_to_back()]);
        let own = bench.seat(|_, graph| look(graph, None, Output::Color));
        let other = bench.seat(move |_, graph| {
            let camera = graph.camera("behind", &camera);
            look(graph, Some(camera), Output::Color);
        });
        let [front, back] = [own, other].map(|mut seat| bench.values(&mut seat));
        close(&front[0], &[1.0, 0.0, 0.0, 1.0]);
        close(&back[0], &[0.0, 0.0, 1.0, 1.0]);
        close(&front[1][2..], &[-2.9, 2.9]);
        close(&back[1][2..], &[2.9, 2.9]);
        assert_eq!([front[2][3], front[3][3]], [SIZE as f32; 2]);
        assert_eq!([back[2][3], back[3][3]], [5.0, 7.0]);
        assert!(front[2][2] > 0.99 && back[2][2] < -0.99, "to the eyes");
    }
}

/// A light that turns with the view's camera shines from there, whoever looks.
#[test]
fn lights_follow_the_view_s_own_camera_alone() {
    let mut bench = Bench::new(vec![back_to_back()]);
    let towards = DVec3::new(-0.4, 0.6, 0.7).normalize_or(DVec3::Y);
    bench.view.camera.eye = DVec3::new(3.0, 0.0, 0.0);
    for follows_camera in [true, false] {
        bench.scene.lights =
            vec![Light::Directional { towards, radiance: Vec3::ONE, follows_camera }];
        let seats = [
            bench.seat(|_, graph| look(graph, None, Output::Color)),
            bench.seat(|_, graph| {
                let camera = graph.camera("behind", &behind());
                look(graph, Some(camera), Output::Color);
            }),
        ];
        let found = seats.map(|mut seat| bench.values(&mut seat)[3]);
        // From +x, right is -z and backwards is +x.
        let turned = DVec3::new(towards.z, towards.y, -towards.x);
        let expected = if follows_camera { turned } else { towards };
        for found in found {
            close(&found[..3], &expected.as_vec3().to_array());
        }
    }
    // One that has a place is there, from wherever it is looked at.
    let position = DVec3::new(0.0, 2.0, -0.1);
    bench.scene.lights = vec![Light::Point { position, intensity: Vec3::ONE }];
    let mut seat = bench.seat(|_, graph| {
        let camera = graph.camera("behind", &behind());
        look(graph, Some(camera), Output::Color);
    });
    let found = bench.values(&mut seat);
    let middle = Vec3::from_slice(&found[1]) + behind().camera.eye.as_vec3();
    let towards = (position.as_vec3() - middle).normalize_or(Vec3::Y);
    close(&found[3][..3], &towards.to_array());
}

/// Pixel by pixel, and surfel by surfel.
#[test]
fn a_shading_pass_draws_what_its_camera_sees() {
    let shade = "
        #import surfelshop::surface::Surface
        fn shade(s: Surface) -> vec4<f32> { return vec4(s.albedo, 1.0); }";
    let copy = "
        var seen: texture_2d<f32>;
        @fragment fn copy(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
            return textureLoad(seen, vec2<u32>(p.xy), 0);
        }";
    let mut bench = Bench::new(vec![back_to_back()]);
    for per_surfel in [false, true] {
        let mut seat = bench.seat(move |_, graph| {
            let camera = graph.camera("behind", &behind());
            let seen = graph.texture("seen", Texture::fixed(Format::Rgba32Float, 5, 7));
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            let pass = Pass::shading("shade", shade, "shade").per_surfel(per_surfel);
            graph.pass(pass.seen_from(camera).target(seen));
            graph.pass(Pass::fullscreen("copy", copy, "copy").bind("seen", seen).target(color));
            graph.output(Output::Color, color);
        });
        let rendered = bench.draw(&mut seat).unwrap();
        let picture = rendered.image(&Output::Color).unwrap();
        close(picture.pixel(2, 3), &[0.0, 0.0, 1.0, 1.0]);
        close(picture.pixel(0, 0), &[0.0; 4]);
    }
}

#[test]
fn groups_per_pixel_count_the_pixels_of_the_camera() {
    let wgsl = "
        var<storage, read_write> n: array<atomic<u32>>;
        @compute @workgroup_size(1) fn count() { atomicAdd(&n[0], 1u); }
        var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(1) fn tell() { found[0] = vec4(f32(atomicLoad(&n[0]))); }";
    let mut bench = Bench::new(vec![back_to_back()]);
    for (divisor, from_camera, expected) in
        [(1, true, 35.0), (2, true, 12.0), (1, false, (SIZE * SIZE) as f32)]
    {
        let mut seat = bench.seat(move |_, graph| {
            let n = graph.buffer("n", Buffer::new(4));
            let found = graph.buffer("found", Buffer::new(16));
            let camera = graph.camera("behind", &behind());
            let pass = Pass::compute("count", wgsl, "count", Groups::PerPixel { divisor });
            let pass = pass.bind("n", n);
            graph.pass(if from_camera { pass.seen_from(camera) } else { pass });
            let pass = Pass::compute("tell", wgsl, "tell", Groups::Fixed([1; 3]));
            graph.pass(pass.bind("n", n).bind("found", found));
            show(graph, found);
        });
        assert_eq!(bench.values(&mut seat)[0][0], expected, "{divisor}, {from_camera}");
    }
}

/// Whatever the passes of a camera see.
#[test]
fn pictures_of_the_host_are_seen_from_the_view() {
    let mut bench = Bench::new(vec![back_to_back()]);
    let mut seat = bench.seat(|_, graph| {
        let camera = graph.camera("behind", &behind());
        look(graph, Some(camera), Output::Color);
    });
    bench.outputs = vec![Output::Color, Output::Albedo, Output::Depth];
    let rendered = bench.draw(&mut seat).unwrap();
    let middle = |output| rendered.image(output).unwrap().pixel(SIZE / 2, SIZE / 2).to_vec();
    close(&middle(&Output::Albedo)[..3], &[1.0, 0.0, 0.0]);
    close(&middle(&Output::Depth)[..1], &[2.9]);
}
