//! Checks of tracers.

use crate::conformance::cast::{Agreement, cast};
use crate::conformance::renderers::{driven, may_be_refused};
use crate::conformance::verdict::{Failure, Judged, Judges, Said, limits_name, run};
use crate::conformance::{Case, Outcome, Setup, clouds, hard};
use glam::DVec3;
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::job::CANCELLED;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, FrameRequest, Projection, Scene, UnitKind, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{LoadedUnit, Timeouts};
use surfelshop_runtime::trace::{TraceOrder, trace};

type Criteria = fn(&mut Bench<'_>) -> Judged;

const fn case(name: &'static str, about: &'static str, judge: Criteria) -> (Case, Criteria) {
    (Case { kind: UnitKind::Tracer, name, about }, judge)
}

const CASES: &[(Case, Criteria)] = &[
    case("limits", "limits that it declares are those of cases that there are", limits),
    case("outputs", "the picture has the view's size and is finite", outputs),
    case("silhouette", "a ball covers the pixels that rays meet", silhouette),
    case("threads", "one thread and three make the same picture, bit by bit", threads),
    case("viewport", "pictures of one pixel, one row and one column are whole", viewport),
    case(
        "orthographic",
        "parallel projection gives a finite picture with something in it",
        orthographic,
    ),
    case(
        "degenerate",
        "no, one, two, collinear, coplanar and coincident surfels give finite pictures",
        degenerate,
    ),
    case(
        "damaged",
        "normals, radii, positions and colours from nothing to the largest number give finite pictures",
        damaged,
    ),
    case(
        "scaled",
        "scenes from 1e-30 to 1e30 times the size give finite pictures with something in them",
        scaled,
    ),
    case(
        "parameters",
        "every parameter but `samples` at both ends of its range and beyond gives finite pictures",
        parameters,
    ),
    case("cancel", "it stops when it is asked to", cancel),
];

fn limits(bench: &mut Bench<'_>) -> Judged {
    limits_name(&bench.unit.description.limits, &cases())
}

pub(crate) fn cases() -> Vec<Case> {
    CASES.iter().map(|(case, _)| *case).collect()
}

pub(crate) fn check(
    unit: &LoadedUnit,
    setup: &Setup<'_>,
    wanted: &dyn Fn(&Case) -> bool,
    tell: &mut dyn FnMut(&Outcome) -> bool,
) -> Vec<Outcome> {
    let mut bench = Bench { unit, patience: &setup.patience };
    let cases: Vec<(Case, Judges<Bench<'_>>)> = CASES.to_vec();
    run(unit, &cases, wanted, tell, &mut bench)
}

struct Bench<'a> {
    unit: &'a LoadedUnit,
    patience: &'a Timeouts,
}

/// Side of pictures.
const SIZE: u32 = 40;

/// How long a tracer may take for a picture of that size.
const LONGEST: Duration = Duration::from_secs(20);

/// How long it works before it is asked to stop.
const WORKED: Duration = Duration::from_millis(200);

fn view(projection: Projection) -> View {
    let eye = DVec3::new(0.5, 1.0, 3.0);
    let camera = Camera { eye, target: DVec3::ZERO, up: DVec3::Y, projection };
    View { camera, size_px: [SIZE; 2], near: 1e-5, far: 1e3 }
}

const CENTRAL: Projection = Projection::Perspective { fov_y: 0.8 };

fn ball() -> Cloud {
    clouds::sphere(500, 1.0).cloud()
}

impl Bench<'_> {
    fn trace(
        &self,
        cloud: &Cloud,
        view: View,
        own: &Values,
        threads: usize,
    ) -> Result<Image, Failure> {
        // Few samples, where it says how many it takes.
        let mut values = Values::from([("samples".to_owned(), Value::Int(2))]);
        values.extend(own.clone());
        let request = FrameRequest {
            view,
            scene: Scene::default(),
            cloud: cloud.facts().clone(),
            frame_index: 0,
            values,
            environment: None,
        };
        let texels: Arc<[[f32; 3]]> = Vec::new().into();
        let clouds = vec![cloud.clone()];
        let order = TraceOrder { clouds, request, texels, samples: 2, threads };
        let started = Instant::now();
        let traced = trace(self.unit, order, self.patience, |_| started.elapsed() < LONGEST);
        let traced = traced.map_err(|fault| match started.elapsed() < LONGEST {
            true => failed(&fault),
            false => {
                let line = format!("it works longer than {} s", LONGEST.as_secs());
                Failure { is_silent: matches!(fault, Fault::TimedOut(_)), ..Failure::fault(line) }
            }
        })?;
        let is_odd = |pixel: &&[f32]| pixel.iter().any(|value| !value.is_finite());
        match traced.color.data.chunks_exact(4).filter(is_odd).count() {
            0 => Ok(traced.color),
            n => {
                let line = format!("{n} pixels are not finite");
                let shown = Failure::showing(line, [("color", &traced.color)]);
                Err(Failure { is_fault: true, ..shown })
            }
        }
    }

    fn usual(&self, cloud: &Cloud) -> Result<Image, Failure> {
        self.trace(cloud, view(CENTRAL), &Values::new(), 0)
    }
}

fn failed(fault: &Fault) -> Failure {
    let is_silent = matches!(fault, Fault::TimedOut(_));
    let is_fault = !matches!(fault, Fault::Error(_));
    Failure { is_silent, is_fault, ..Failure::new(fault.to_string()) }
}

fn outputs(bench: &mut Bench<'_>) -> Judged {
    let color = bench.usual(&ball())?;
    let covered = color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.0).count();
    match covered {
        0 => Err(Failure::new("the picture of a ball is empty")),
        n => Ok(Said::Measured(format!("{n} pixels covered"))),
    }
}

fn threads(bench: &mut Bench<'_>) -> Judged {
    let drawn = |threads| bench.trace(&ball(), view(CENTRAL), &Values::new(), threads);
    let (one, three) = (drawn(1)?, drawn(3)?);
    let bits = |image: &Image| image.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    match bits(&one) == bits(&three) {
        true => Ok(Said::Measured("the same picture".to_owned())),
        false => Err(Failure::showing("the pictures differ", [("one", &one), ("three", &three)])),
    }
}

fn viewport(bench: &mut Bench<'_>) -> Judged {
    for size_px in [[1, 1], [1, 61], [61, 1]] {
        let view = View { size_px, ..view(CENTRAL) };
        let what = format!("{} x {}", size_px[0], size_px[1]);
        bench.trace(&ball(), view, &Values::new(), 0).map_err(|failure| failure.of(&what))?;
    }
    Ok(Said::Measured("3 sizes".to_owned()))
}

fn orthographic(bench: &mut Bench<'_>) -> Judged {
    let view = view(Projection::Orthographic { height: 2.5 });
    let color = bench.trace(&ball(), view, &Values::new(), 0)?;
    let covered = color.data.chunks_exact(4).filter(|pixel| pixel[3] > 0.5).count();
    // A ball of radius 1 in a picture 2.5 high, within a disc's reach of its outline.
    let expected = std::f64::consts::PI * (f64::from(SIZE) / 2.5).powi(2);
    let line = format!("{covered} pixels covered, expected about {expected:.0}");
    match (covered as f64 / expected - 1.0).abs() < 0.15 {
        true => Ok(Said::Measured(line)),
        false => Err(Failure::showing(line, [("color", &color)])),
    }
}

fn finite(bench: &mut Bench<'_>, clouds: Vec<hard::Hard>) -> Judged {
    let n = clouds.len();
    for (what, cloud) in clouds {
        bench.usual(&cloud).map_err(|failure| failure.of(what))?;
    }
    Ok(Said::Measured(format!("{n} clouds")))
}

fn degenerate(bench: &mut Bench<'_>) -> Judged {
    finite(bench, hard::degenerate())
}

fn damaged(bench: &mut Bench<'_>) -> Judged {
    finite(bench, hard::damaged())
}

fn scaled(bench: &mut Bench<'_>) -> Judged {
    for factor in hard::SIZES {
        let what = format!("{factor:e} times the size");
        let cloud = hard::sized(&clouds::sphere(500, 1.0), factor).cloud();
        let mut view = view(CENTRAL);
        let scale = f64::from(factor);
        view.camera.eye *= scale;
        (view.near, view.far) = (view.near * scale, view.far * scale);
        let color = bench.trace(&cloud, view, &Values::new(), 0).map_err(|f| f.of(&what))?;
        if color.data.chunks_exact(4).all(|pixel| pixel[3] == 0.0) {
            return Err(Failure::new(format!("{what}: the picture is empty")));
        }
    }
    Ok(Said::Measured(format!("{} sizes", hard::SIZES.len())))
}

fn parameters(bench: &mut Bench<'_>) -> Judged {
    let declared = bench.unit.description.params.clone();
    let mut n = 0;
    // How long it works is its own matter.
    for declared in declared.iter().filter(|declared| declared.id != "samples") {
        for value in driven(declared) {
            let what = format!("{}={value:?}", declared.id);
            let values = Values::from([(declared.id.clone(), value)]);
            n += 1;
            let view = View { size_px: [8; 2], ..view(CENTRAL) };
            match bench.trace(&ball(), view, &values, 0) {
                Err(failure) if !may_be_refused(declared) || failure.is_fault => {
                    return Err(failure.of(&what));
                }
                _ => {}
            }
        }
    }
    match n {
        0 => Ok(Said::LeftOut("it has no parameters but its number of samples".to_owned())),
        _ => Ok(Said::Measured(format!("{n} values"))),
    }
}

fn cancel(bench: &mut Bench<'_>) -> Judged {
    let cloud = ball();
    let request = FrameRequest {
        view: view(CENTRAL),
        scene: Scene::default(),
        cloud: cloud.facts().clone(),
        frame_index: 0,
        values: Values::from([("samples".to_owned(), Value::Int(1 << 20))]),
        environment: None,
    };
    let texels: Arc<[[f32; 3]]> = Vec::new().into();
    let order = TraceOrder { clouds: vec![cloud], request, texels, samples: 1 << 20, threads: 0 };
    let started = Instant::now();
    match trace(bench.unit, order, bench.patience, |_| started.elapsed() < WORKED) {
        Err(Fault::Error(line)) if line == CANCELLED => {
            Ok(Said::Measured(format!("it stopped after {:?}", started.elapsed())))
        }
        Err(fault) => Err(failed(&fault)),
        Ok(_) => Ok(Said::LeftOut("it ended before it was asked to stop".to_owned())),
    }
}

/// What a ball covers, but for the rim, where samples lie to both sides.
fn silhouette(bench: &mut Bench<'_>) -> Judged {
    let (cloud, view) = (ball(), view(CENTRAL));
    let reference = cast(&cloud, &view);
    let color = bench.usual(&cloud)?;
    let covered = color.data.chunks_exact(4).map(|p| if p[3] > 0.5 { 1.0 } else { 0.0 });
    let agreement = Agreement::new(covered, &reference, f64::INFINITY);
    let line = format!(
        "rays meet discs at {} pixels, {} are covered, {} of them rightly",
        agreement.cast, agreement.drawn, agreement.both
    );
    match agreement.coverage() > 0.95 && agreement.both > 100 {
        true => Ok(Said::Measured(line)),
        false => Err(Failure::showing(line, [("color", &color)])),
    }
}
