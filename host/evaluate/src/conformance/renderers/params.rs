//! Parameters of the renderer, and settings of the surface, at their ends.

use super::bench::{Bench, DrawRequest, front};
use crate::conformance::clouds;
use crate::conformance::verdict::{Judged, Said};
use surfelshop_api::SurfaceSettings;
use surfelshop_api::params::{ParamDecl, ParamKind, Value, Values};

const SIZE: u32 = 48;

fn ball() -> DrawRequest<'static> {
    let mut surfels = clouds::sphere(600, 1.0);
    surfels.ao = (0..600).map(|i| (i % 5) as f32 / 4.0).collect();
    DrawRequest::new(surfels.cloud(), front(SIZE))
}

pub(super) fn settings(bench: &mut Bench<'_>) -> Judged {
    let usual = SurfaceSettings::default();
    let cases = [
        SurfaceSettings { depth_tolerance: 0.0, ..usual },
        SurfaceSettings { depth_tolerance: 16.0, ..usual },
        SurfaceSettings { two_sided: false, ..usual },
        SurfaceSettings { radius_scale: 1e-3, ..usual },
        SurfaceSettings { radius_scale: 1e3, ..usual },
        SurfaceSettings { low_pass: 0.0, ..usual },
        SurfaceSettings { low_pass: 4.0, ..usual },
    ];
    let n = cases.len();
    for surface in cases {
        let mut shot = ball();
        shot.scene.surface = surface;
        bench.draw(&shot).map_err(|failure| failure.of(&format!("{surface:?}")))?;
    }
    Ok(Said::Measured(format!("{n} settings")))
}

/// What a parameter is driven to: its ends, beyond them, and what is no value at all.
pub(crate) fn driven(declared: &ParamDecl) -> Vec<Value> {
    let [low, high] = declared.range.unwrap_or([-1e6, 1e6]);
    match &declared.kind {
        ParamKind::Float => {
            let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300];
            let all = [low, high, low - 1.0, high + 1.0].into_iter().chain(odd);
            all.map(Value::Float).collect()
        }
        ParamKind::Int => {
            let ends = [low as i64, high as i64];
            let beyond = [ends[0].saturating_sub(1), ends[1].saturating_add(1), i64::MIN, i64::MAX];
            ends.into_iter().chain(beyond).map(Value::Int).collect()
        }
        ParamKind::Bool => vec![Value::Bool(false), Value::Bool(true)],
        ParamKind::Choice(ids) => {
            let texts = ids.iter().map(String::as_str).chain(["", "no such choice"]);
            texts.map(|text| Value::Text(text.to_owned())).collect()
        }
        ParamKind::Color => {
            let all = [[0.0; 3], [1.0; 3], [1e30; 3], [-1.0; 3], [f32::NAN; 3]];
            all.map(Value::Color).to_vec()
        }
        ParamKind::Text | ParamKind::File { .. } => {
            let texts = ["", "no such file", "\u{0}\u{1F300}"];
            texts.map(|text| Value::Text(text.to_owned())).to_vec()
        }
    }
}

/// Whether a unit may refuse a value in words: what a text or a file must be is its own matter.
pub(crate) fn may_be_refused(declared: &ParamDecl) -> bool {
    matches!(declared.kind, ParamKind::Text | ParamKind::File { .. })
}

pub(super) fn parameters(bench: &mut Bench<'_>) -> Judged {
    let declared = bench.unit.description.params.clone();
    let mut n = 0;
    for declared in &declared {
        let mut instance = bench.start()?;
        for value in driven(declared) {
            let what = format!("{}={value:?}", declared.id);
            let values = Values::from([(declared.id.clone(), value)]);
            n += 1;
            match bench.draw_by(&mut instance, &DrawRequest { values, ..ball() }) {
                Err(failure) if !may_be_refused(declared) || failure.is_fault => {
                    return Err(failure.of(&what));
                }
                _ => {}
            }
        }
    }
    match declared.len() {
        0 => Ok(Said::LeftOut("it has no parameters".to_owned())),
        of => Ok(Said::Measured(format!("{n} values of {of} parameters"))),
    }
}
