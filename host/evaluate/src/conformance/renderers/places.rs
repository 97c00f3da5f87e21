//! Where a scene is, how large and how it stands; and clouds that are hard.

use super::bench::{Bench, DrawRequest, alike, front, parallel, picture, view};
use crate::conformance::clouds::{self, Surfels};
use crate::conformance::hard;
use crate::conformance::verdict::{Failure, Judged, Said};
use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::{Light, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;

const SIZE: u32 = 96;

/// Share of the covered pixels that may differ where a scene is rounded anew: those on whose centre a
/// disc's edge lies, or two depths that agree, within rounding.
const ROUNDED: f64 = 0.005;

fn ball() -> Surfels {
    clouds::sphere(3000, 1.0)
}

pub(super) fn moved(bench: &mut Bench<'_>) -> Judged {
    let mut surfels = ball();
    let view = front(SIZE);
    let here = bench.color(&DrawRequest::new(surfels.cloud(), view))?;
    surfels.origin = hard::FAR;
    let mut far = view;
    far.camera.eye += hard::FAR;
    far.camera.target += hard::FAR;
    let there = bench.color(&DrawRequest::new(surfels.cloud(), far))?;
    alike("moved", &here, &there, ROUNDED).map(Said::Measured)
}

fn scaled_view(view: View, factor: f64) -> View {
    let mut view = view;
    view.camera.eye *= factor;
    view.camera.target *= factor;
    view.near *= factor;
    view.far *= factor;
    if let surfelshop_api::Projection::Orthographic { height } = &mut view.camera.projection {
        *height *= factor;
    }
    view
}

pub(super) fn scaled(bench: &mut Bench<'_>) -> Judged {
    let mut said = String::new();
    for (name, view) in [("central", front(SIZE)), ("parallel", parallel(SIZE))] {
        let usual = bench.color(&DrawRequest::new(ball().cloud(), view))?;
        for factor in hard::SIZES {
            let what = format!("{name}, {factor:e} times the size");
            let cloud = hard::sized(&ball(), factor).cloud();
            let shot = DrawRequest::new(cloud, scaled_view(view, f64::from(factor)));
            let found = bench.color(&shot).map_err(|failure| failure.of(&what))?;
            said = alike(&what, &usual, &found, ROUNDED)?;
        }
    }
    Ok(Said::Measured(said))
}

/// A third of a turn around the diagonal: no coordinate is rounded.
fn turned_vector<T: Copy>([x, y, z]: [T; 3]) -> [T; 3] {
    [z, x, y]
}

pub(super) fn turned(bench: &mut Bench<'_>) -> Judged {
    let outputs = [Output::Normal, Output::Color];
    // Longer in one direction than in the others, so that no turn leaves it as it was.
    let stretch = |surfels: &mut Surfels| {
        for (place, normal) in surfels.positions.iter_mut().zip(&mut surfels.normals) {
            *place *= Vec3::new(1.0, 0.6, 0.8);
            *normal = (*normal / Vec3::new(1.0, 0.6, 0.8)).normalize_or(Vec3::X);
        }
    };
    let mut surfels = ball();
    stretch(&mut surfels);
    let mut turned = surfels.clone();
    for list in [&mut turned.positions, &mut turned.normals] {
        list.iter_mut().for_each(|v| *v = turned_vector(v.to_array()).into());
    }
    let mut view = front(SIZE);
    let camera = &mut view.camera;
    for vector in [&mut camera.eye, &mut camera.target, &mut camera.up] {
        *vector = turned_vector(vector.to_array()).into();
    }
    let mut said = String::new();
    let sun = DVec3::new(0.3, 0.9, 0.5);
    for (what, follows_camera) in [("light beside the camera", true), ("light of the world", false)]
    {
        let shot = |surfels: &Surfels, view, towards| {
            let mut shot = DrawRequest::new(surfels.cloud(), view).of(&outputs);
            if !follows_camera {
                let radiance = Vec3::ONE;
                shot.scene.lights = vec![Light::Directional { towards, radiance, follows_camera }];
            }
            shot
        };
        let here = bench.draw(&shot(&surfels, front(SIZE), sun))?;
        let there = bench.draw(&shot(&turned, view, turned_vector(sun.to_array()).into()))?;
        normals_turned(&picture(&here, &Output::Normal)?, &picture(&there, &Output::Normal)?)?;
        let color = |drawn| picture(drawn, &Output::Color);
        said = alike(what, &color(&here)?, &color(&there)?, ROUNDED)?;
    }
    Ok(Said::Measured(said))
}

fn normals_turned(here: &Image, there: &Image) -> Result<(), Failure> {
    let n = (here.components as usize, there.components as usize);
    let pairs = here.data.chunks_exact(n.0).zip(there.data.chunks_exact(n.1));
    let (mut covered, mut wrong) = (0, 0);
    for (a, b) in pairs {
        let expected = Vec3::from_array(turned_vector([a[0], a[1], a[2]]));
        if expected != Vec3::ZERO {
            covered += 1;
            wrong += usize::from(expected.distance(Vec3::from_slice(b)) > 0.01);
        }
    }
    match covered > 0 && wrong as f64 <= ROUNDED * f64::from(covered) {
        true => Ok(()),
        false => {
            let line = format!("{wrong} of {covered} normals do not turn with the scene");
            let pictures = [("here", here), ("turned", there)];
            Err(Failure::showing(line, pictures).counting(wrong, covered as usize))
        }
    }
}

/// Draws clouds of which nothing but finite pictures is expected.
fn finite<S: AsRef<str>>(bench: &mut Bench<'_>, clouds: Vec<(S, Cloud)>) -> Judged {
    let n = clouds.len();
    for (what, cloud) in clouds {
        let what = what.as_ref();
        for view in [view(DVec3::new(0.3, 0.4, 3.0), DVec3::ZERO, 48), parallel(48)] {
            let shot = DrawRequest::new(cloud.clone(), view);
            bench.draw(&shot).map_err(|failure| failure.of(what))?;
        }
    }
    Ok(Said::Measured(format!("{n} clouds")))
}

pub(super) fn degenerate(bench: &mut Bench<'_>) -> Judged {
    finite(bench, hard::degenerate())
}

pub(super) fn damaged(bench: &mut Bench<'_>) -> Judged {
    let usual = hard::damaged().into_iter().map(|(what, cloud)| (what.to_owned(), cloud));
    let needed = bench.fitting().damaged(&clouds::sphere(400, 1.0).cloud())?;
    finite(bench, usual.chain(needed).collect())
}

pub(super) fn occluded(bench: &mut Bench<'_>) -> Judged {
    finite(bench, hard::occluded())
}

pub(super) fn equal_colours(bench: &mut Bench<'_>) -> Judged {
    let code = [240u8, 120, 30];
    let mut surfels = Surfels::default();
    for _ in 0..3000 {
        surfels.push(Vec3::ZERO, Vec3::Z, 0.5);
        surfels.colors.push(code);
    }
    let view = view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    // Gaussians radiate their colour and have no albedo.
    let output = match bench.fitting().has_gaussians() {
        true => Output::Color,
        false => Output::Albedo,
    };
    let shot = DrawRequest::new(surfels.cloud(), view).of(&[Output::Color, output.clone()]);
    let albedo = picture(&bench.draw(&shot)?, &output)?;
    let expected = code.map(|code| srgb_to_linear(f32::from(code) / 255.0));
    let found = albedo.pixel(16, 16);
    let line = format!("{} {:?}, expected {expected:?}", output.name(), &found[..3]);
    // Half precision on the way to the device and in the surface.
    let is_near = |(found, expected): (&f32, &f32)| (found / expected - 1.0).abs() < 3e-3;
    match found.iter().zip(&expected).all(is_near) {
        true => Ok(Said::Measured(line)),
        false => Err(Failure::showing(line, [(output.name().as_str(), &albedo)])),
    }
}
