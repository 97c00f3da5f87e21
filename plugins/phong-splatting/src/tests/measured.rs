//! Tables of what is measured; run by hand, since they take a while and hold nothing.

use super::audit::{Drawn, errors, n_bare};
use super::shapes::{cone, cube, ell, smooth};
use super::*;
use std::time::Instant;

#[test]
#[ignore = "prints tables"]
#[allow(clippy::print_stdout, reason = "a table for people")]
fn smooth_surfaces() {
    println!(
        "surface    tolerance splats of-ideal overlap  field-rms (x)   const-rms (x)   field-max const-max bare  s"
    );
    for surface in smooth(40_000) {
        let mut before: Option<audit::Errors> = None;
        for tolerance in [0.032, 0.008, 0.002, 0.0005] {
            let settings = within(surface.given.share(tolerance));
            let started = Instant::now();
            let ran = surface.given.run(&settings).unwrap();
            let time = started.elapsed().as_secs_f64();
            let splats = Drawn::all(&ran);
            let (errors, overlap) = errors(&surface.given, &splats, tolerance);
            let bare = n_bare(&surface.given, &[], &splats, tolerance, 1e-6);
            let ratio = |a: f64, b: fn(&audit::Errors) -> f64| {
                before.as_ref().map_or(0.0, |before| b(before) / a)
            };
            println!(
                "{:10} {tolerance:8} {:6} {:8.2} {overlap:8.2} {:10.5} {:5.2} {:10.5} {:5.2} {:9.4} {:9.4} {bare:4} {time:5.2}",
                surface.name,
                splats.len(),
                surface.ideal.map_or(0.0, |ideal| splats.len() as f64 / (ideal / tolerance)),
                errors.field,
                ratio(errors.field, |e| e.field),
                errors.constant,
                ratio(errors.constant, |e| e.constant),
                errors.field_max,
                errors.constant_max,
            );
            before = Some(errors);
        }
    }
}

#[test]
#[ignore = "prints tables"]
#[allow(clippy::print_stdout, reason = "a table for people")]
fn faces() {
    for (name, given) in [("cube", cube(60)), ("ell", ell(40)), ("cone", cone(20_000))] {
        for share in [1e-2, 1e-3, 1e-4] {
            let ran = given.run(&within(share)).unwrap();
            let splats = Drawn::all(&ran);
            let n_cut = |kind: f64| splats.iter().filter(|splat| splat.clip[6] == kind).count();
            println!("{name} {share}: {} one {} two {}", ran.message, n_cut(1.0), n_cut(2.0));
        }
    }
}
