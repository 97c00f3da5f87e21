//! Coverage, depth and normals against rays cast in f64.

use super::bench::{Bench, DrawRequest, alike, front as front_view, parallel, picture, view};
use super::gaussians;
use crate::conformance::cast::{Agreement, cast};
use crate::conformance::clouds::{self, Surfels};
use crate::conformance::verdict::{Failure, Judged, Said};
use glam::{DVec3, Vec3};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;

/// Side of pictures.
const SIZE: u32 = 160;

/// Vertices are snapped to 1/256 pixel, so that pixels whose centre lies that near to a disc's edge may
/// fall either way: on these clouds fewer than one in 500.
pub(super) const COVERAGE: f64 = 0.998;

/// Depth is interpolated in f32 over discs whose corners are snapped to 1/256 pixel.
const DEPTH_FRACTION: f64 = 1e-3;

/// Pixels that stay alike where a camera moves by whole pixels: rounding decides on edges.
const SHIFTED: f64 = 0.005;

fn ball() -> Cloud {
    clouds::sphere(8000, 1.0).cloud()
}

/// A camera close above a plane.
fn slanted() -> View {
    view(DVec3::new(0.0, 0.05, 2.0), DVec3::ZERO, SIZE)
}

/// The first of four values of each pixel where colour covers it, 0 elsewhere.
fn covered(color: &Image) -> impl Iterator<Item = f32> {
    color.data.chunks_exact(4).map(|pixel| if pixel[3] > 0.0 { 1.0 } else { 0.0 })
}

/// Colour covers what rays meet.
fn covers(bench: &mut Bench<'_>, cloud: Cloud, view: View) -> Judged {
    let color = bench.color(&DrawRequest::new(cloud.clone(), view).without_low_pass())?;
    if bench.fitting().has_gaussians() {
        return gaussians::cover(&cloud, &view, &color);
    }
    let reference = cast(&cloud, &view);
    let agreement = Agreement::new(covered(&color), &reference, f64::INFINITY);
    let line = format!(
        "rays meet discs at {} pixels, {} are covered, {} of them rightly",
        agreement.cast, agreement.drawn, agreement.both
    );
    match agreement.coverage() >= COVERAGE && agreement.both > 100 {
        true => Ok(Said::Measured(line)),
        false => {
            let wrong = agreement.cast.max(agreement.drawn) - agreement.both;
            let failure = Failure::showing(line, [("color", &color)]);
            Err(failure.counting(wrong, agreement.cast.max(agreement.drawn)))
        }
    }
}

pub(super) fn front(bench: &mut Bench<'_>) -> Judged {
    covers(bench, ball(), front_view(SIZE))
}

pub(super) fn grazing(bench: &mut Bench<'_>) -> Judged {
    covers(bench, clouds::plane(100, 1.0).cloud(), slanted())
}

pub(super) fn inside(bench: &mut Bench<'_>) -> Judged {
    covers(bench, ball(), view(DVec3::new(0.3, 0.2, 0.1), DVec3::X, SIZE))
}

pub(super) fn near_plane(bench: &mut Bench<'_>) -> Judged {
    let cloud = clouds::sphere(2000, 1.0).cloud();
    covers(bench, cloud, view(DVec3::new(0.0, 0.0, 0.999), DVec3::new(1.0, 0.2, 0.9), SIZE))
}

pub(super) fn off_centre(bench: &mut Bench<'_>) -> Judged {
    covers(bench, ball(), view(DVec3::new(0.5, 1.0, 3.0), DVec3::new(1.1, 0.9, 0.0), SIZE))
}

pub(super) fn orthographic(bench: &mut Bench<'_>) -> Judged {
    let view = parallel(SIZE);
    let said = covers(bench, ball(), view)?;
    // A camera that moves by whole pixels: everything moves by as many, highlights included.
    let by = 7;
    let pixel = 2.5 / f64::from(SIZE);
    let right = view.camera.view_from_world().transpose() * DVec3::X;
    let mut moved = view;
    moved.camera.eye += right * (pixel * f64::from(by));
    moved.camera.target += right * (pixel * f64::from(by));
    let here = bench.color(&DrawRequest::new(ball(), view))?;
    let there = bench.color(&DrawRequest::new(ball(), moved))?;
    alike("shifted by 7 pixels", &without(&here, by, 0), &without(&there, 0, by), SHIFTED)?;
    Ok(said)
}

/// A picture without so many columns at its left and right.
fn without(image: &Image, left: u32, right: u32) -> Image {
    let (n, width) = (image.components as usize, image.width as usize);
    let columns = n * left as usize..n * (width - right as usize);
    let rows = image.data.chunks_exact(n * width);
    Image {
        width: image.width - left - right,
        data: rows.flat_map(|row| row[columns.clone()].iter().copied()).collect(),
        ..image.clone()
    }
}

pub(super) fn sub_pixel(bench: &mut Bench<'_>) -> Judged {
    // Some 20 surfels a pixel: each disc misses most pixels' centres, the filter lets none through.
    let view = front_view(32);
    let cloud = clouds::sphere(20_000, 1.0).cloud();
    let reference = cast(&clouds::sphere(2000, 0.97).cloud(), &view);
    let color = bench.color(&DrawRequest::new(cloud, view))?;
    let inside = reference.depth.iter().map(|depth| depth.is_finite());
    let holes = inside.zip(covered(&color)).filter(|(inside, found)| *inside && *found == 0.0);
    match holes.count() {
        0 => Ok(Said::Measured("no holes".to_owned())),
        n => Err(Failure::showing(format!("{n} holes"), [("color", &color)])),
    }
}

pub(super) fn depth(bench: &mut Bench<'_>) -> Judged {
    let views = [
        ("central", ball(), front_view(SIZE)),
        ("parallel", ball(), parallel(SIZE)),
        ("at a slant", clouds::plane(100, 1.0).cloud(), slanted()),
    ];
    let (mut said, mut whose) = (Vec::new(), "");
    for (what, cloud, view) in views {
        let shot = DrawRequest::new(cloud.clone(), view).without_low_pass().of(&[Output::Depth]);
        let mut instance = bench.start()?;
        let depth = picture(&bench.draw_by(&mut instance, &shot)?, &Output::Depth)?;
        whose = bench.whose(&instance, &Output::Depth);
        if bench.fitting().has_gaussians() {
            let (n, wrong) = gaussians::depths(&cloud, &view, &depth);
            let line = format!("{what}: {wrong} of {n} pixels have depths of no Gaussian there");
            if n < 100 || wrong as f64 > (1.0 - COVERAGE) * n as f64 {
                return Err(Failure::showing(line, [("depth", &depth)]).counting(wrong, n));
            }
            said.push(line);
            continue;
        }
        let reference = cast(&cloud, &view);
        let values = depth.data.chunks_exact(depth.components.max(1) as usize).map(|p| p[0]);
        let agreement = Agreement::new(values, &reference, DEPTH_FRACTION);
        let line = format!(
            "{what}: {} of {} pixels are wrong by more than a thousandth",
            agreement.depth_differs, agreement.both
        );
        let wrong = agreement.depth_differs as f64 > (1.0 - COVERAGE) * agreement.both as f64;
        if wrong || agreement.coverage() < COVERAGE || agreement.both < 100 {
            let failure = Failure::showing(line, [("depth", &depth)]);
            return Err(failure.counting(agreement.depth_differs, agreement.both));
        }
        said.push(line);
    }
    Ok(Said::Measured(said.join("; ") + whose))
}

pub(super) fn far_depth(bench: &mut Bench<'_>) -> Judged {
    let mut discs = Surfels::default();
    discs.push(Vec3::new(0.0, 0.0, -1000.0), Vec3::Z, 300.0);
    discs.push(Vec3::new(0.0, 0.0, -1000.01), Vec3::Z, 300.0);
    discs.colors = vec![[255, 0, 0], [0, 0, 255]];
    let mut far = view(DVec3::ZERO, DVec3::NEG_Z, 32);
    (far.near, far.far) = (0.01, 1e5);
    let swapped = Surfels {
        positions: vec![discs.positions[1], discs.positions[0]],
        colors: vec![discs.colors[1], discs.colors[0]],
        ..discs.clone()
    };
    let shot = |surfels: &Surfels| DrawRequest::new(surfels.cloud(), far).of(&[Output::Depth]);
    let mut found = Vec::new();
    for surfels in [&discs, &swapped] {
        let depth = picture(&bench.draw(&shot(surfels))?, &Output::Depth)?;
        found.push(f64::from(depth.pixel(16, 16)[0]));
    }
    // f32 at 1000 has a step of 6e-5.
    match found.iter().all(|depth| (depth - 1000.0).abs() < 2e-3) {
        true => Ok(Said::Measured(format!("depths {found:?}, expected 1000"))),
        false => Err(Failure::new(format!("depths {found:?}, expected 1000"))),
    }
}

pub(super) fn normal(bench: &mut Bench<'_>) -> Judged {
    let (cloud, view) = (ball(), front_view(SIZE));
    let shot = DrawRequest::new(cloud, view).of(&[Output::Normal, Output::Depth]);
    let mut instance = bench.start()?;
    let drawn = bench.draw_by(&mut instance, &shot)?;
    let whose = bench.whose(&instance, &Output::Normal);
    let normals = picture(&drawn, &Output::Normal)?;
    let depths = picture(&drawn, &Output::Depth)?;
    let world_from_view = view.camera.view_from_world().transpose();
    // Discs overlap 1.5 spacings of 0.04, and blend with those a radius behind.
    let bound = 0.13;
    let (mut n, mut wrong, mut worst) = (0, 0, 0.0f64);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let depth = f64::from(depths.pixel(x, y)[0]);
            let (_, ray) = view.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let place = view.camera.eye + world_from_view * (ray * (depth / -ray.z));
            let truth = place.normalize_or_zero();
            let slant = -(world_from_view * ray).normalize_or_zero().dot(truth);
            // At the rim single discs of the far side show.
            if depth <= 0.0 || slant < 0.3 {
                continue;
            }
            n += 1;
            let found = Vec3::from_slice(normals.pixel(x, y)).as_dvec3();
            let off = (found - truth).length();
            worst = worst.max(off);
            wrong += usize::from(off > bound);
        }
    }
    let line =
        format!("{wrong} of {n} normals are off by more than {bound}; worst {worst:.3}{whose}");
    match wrong == 0 && n > 100 {
        true => Ok(Said::Measured(line)),
        false => Err(Failure::showing(line, [("normal", &normals)]).counting(wrong, n)),
    }
}
