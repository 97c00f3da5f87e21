//! Lights and surroundings at their ends.

use super::bench::{Bench, DrawRequest, front};
use crate::conformance::clouds;
use crate::conformance::verdict::{Judged, Said};
use glam::{DMat3, DVec3, Vec3};
use surfelshop_api::{Environment, Light};
use surfelshop_cloud::environment_map::Probe;

const SIZE: u32 = 48;

fn ball() -> DrawRequest<'static> {
    DrawRequest::new(clouds::sphere(600, 1.0).cloud(), front(SIZE))
}

pub(super) fn lights(bench: &mut Bench<'_>) -> Judged {
    let directional =
        |towards, radiance| Light::Directional { towards, radiance, follows_camera: false };
    let point = |position| Light::Point { position, intensity: Vec3::splat(4.0) };
    let on_surface = clouds::sphere(600, 1.0).positions[300].as_dvec3();
    let spot = |angle| Light::Spot {
        position: DVec3::Y * 2.0,
        target: DVec3::ZERO,
        intensity: Vec3::ONE,
        angle,
        softness: 0.0,
    };
    let cases: [(&str, Vec<Light>); 9] = [
        ("no light", Vec::new()),
        (
            "eight lights",
            (0..8)
                .map(|i| directional(DVec3::new(f64::from(i) - 3.5, 1.0, 1.0), Vec3::ONE))
                .collect(),
        ),
        ("radiance 0", vec![directional(DVec3::Y, Vec3::ZERO)]),
        ("radiance 1e5", vec![directional(DVec3::Y, Vec3::splat(1e5))]),
        ("radiance 1e30", vec![directional(DVec3::Y, Vec3::splat(1e30))]),
        ("a direction of no length", vec![directional(DVec3::ZERO, Vec3::ONE)]),
        ("a lamp on the surface", vec![point(on_surface)]),
        ("a lamp at 1e30", vec![point(DVec3::splat(1e30))]),
        ("spots of no and of every angle", vec![spot(0.0), spot(std::f64::consts::PI)]),
    ];
    let n = cases.len();
    for (what, lights) in cases {
        let mut shot = ball();
        shot.scene.lights = lights;
        bench.draw(&shot).map_err(|failure| failure.of(what))?;
    }
    Ok(Said::Measured(format!("{n} sets of lights")))
}

pub(super) fn surroundings(bench: &mut Bench<'_>) -> Judged {
    let probes = [("studio", Probe::studio(), 1.0), ("sky", Probe::sky(), 1.0)];
    let bright = [("sky at 1e5", Probe::sky(), 1e5), ("studio at 0", Probe::studio(), 0.0)];
    for (what, probe, gain) in probes.iter().chain(&bright) {
        let facts = probe.facts.clone();
        let environment = Environment { facts, probe_from_world: DMat3::IDENTITY, gain: *gain };
        let shot = DrawRequest { probe: Some((probe, environment)), ..ball() };
        bench.draw(&shot).map_err(|failure| failure.of(what))?;
    }
    Ok(Said::Measured("4 surroundings".to_owned()))
}
