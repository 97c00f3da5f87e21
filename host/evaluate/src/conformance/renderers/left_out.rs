//! What frames do without.

use super::bench::{Bench, DrawRequest, front, picture, same};
use super::columns::{bare, full};
use super::params::driven;
use crate::conformance::verdict::{Failure, Judged, Said};
use glam::DMat3;
use std::collections::BTreeSet;
use surfelshop_api::Environment;
use surfelshop_api::graph::Output;
use surfelshop_cloud::environment_map::Probe;

const SIZE: u32 = 64;
const N: usize = 1500;

/// With usual parameters, and each parameter at each of its ends, where most of what is left out is not
/// needed; with and without light from around.
pub(super) fn left_out(bench: &mut Bench<'_>) -> Judged {
    let probe = Probe::studio();
    let (facts, probe_from_world) = (probe.facts.clone(), DMat3::IDENTITY);
    let environment = Environment { facts, probe_from_world, gain: 1.0 };
    let mut names = BTreeSet::new();
    let mut n_pictures = 0;
    for (cloud, surfels) in [("a bare cloud", bare(N)), ("a cloud with everything", full(N))] {
        for (under, natural) in [("under lights", false), ("in natural light", true)] {
            let usual = DrawRequest {
                probe: natural.then(|| (&probe, environment.clone())),
                ..DrawRequest::new(surfels.cloud(), front(SIZE)).of(&[Output::Color])
            };
            let mut shots = vec![(String::new(), "usual parameters".to_owned(), usual.clone())];
            for declared in &bench.unit.description.params {
                // The ends come first.
                for value in driven(declared).into_iter().take(2) {
                    let mut shot = usual.clone();
                    let said = format!("{} = {value:?}", declared.id);
                    shot.values.insert(declared.id.clone(), value);
                    shots.push((declared.id.clone(), said, shot));
                }
            }
            for (of, said, shot) in shots {
                let mut instance = bench.start()?;
                let drawn = match bench.draw_by(&mut instance, &shot) {
                    Ok(drawn) => drawn,
                    Err(failure) if failure.is_fault => return Err(failure.of(&said)),
                    // A value that is refused in words is the parameters' case.
                    Err(_) => continue,
                };
                let expected = picture(&drawn, &Output::Color)?;
                n_pictures += 1;
                for kept in bench.left_out(&instance, &shot)? {
                    let what = format!("{cloud} {under}, {said}, {kept}");
                    // What was seen to change nothing is asked once with each cloud, light and parameter.
                    if !names.insert((cloud, under, of.clone(), kept.to_string())) {
                        continue;
                    }
                    bench.keep(vec![kept]);
                    let drawn = bench.draw_by(&mut instance, &shot);
                    bench.keep(Vec::new());
                    same(&what, &expected, &picture(&drawn?, &Output::Color)?)?;
                }
            }
        }
    }
    if n_pictures == 0 {
        return Err(Failure::new("it refuses every picture"));
    }
    let kinds: BTreeSet<&str> = names.iter().map(|(_, _, _, kept)| kept.as_str()).collect();
    Ok(Said::Measured(format!("{} things in {n_pictures} pictures", kinds.len())))
}
