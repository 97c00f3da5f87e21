//! Which knobs are turned, and to which values.

use anyhow::bail;
use surfelshop_api::params::{ParamDecl, ParamKind, Value};
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::options::values::Setting;
use surfelshop_session::parameters;

/// Values that a knob is swept over unless they are given.
const MOST_VALUES: usize = 9;

/// What the host turns of a renderer's pictures: the radius of merged surfels in pixels, as `--detail`
/// of `render`.
pub(super) const DETAIL: &str = "detail";

/// The knobs of a renderer that are not its own; one of its own by that name comes first.
pub(super) fn of_host(declared: &[ParamDecl]) -> Option<ParamDecl> {
    let detail = ParamDecl {
        id: DETAIL.to_owned(),
        kind: ParamKind::Float,
        default: Value::Float(0.0),
        range: Some([0.0, 64.0]),
        unit: "px".to_owned(),
        doc: "Radius of merged surfels".to_owned(),
        ..ParamDecl::default()
    };
    (!declared.iter().any(|own| own.id == DETAIL)).then_some(detail)
}

/// A knob and the values it is turned to, as they are typed.
pub(super) struct Knob {
    pub(super) id: String,
    pub(super) values: Vec<String>,
}

/// The knobs that are swept: those typed, or all that are declared to trade time for quality.
pub(super) fn knobs(
    typed: &[Setting],
    unit: &UnitRef,
    declared: &[ParamDecl],
) -> anyhow::Result<Vec<Knob>> {
    let ids =
        || declared.iter().map(|declared| declared.id.as_str()).collect::<Vec<_>>().join(", ");
    if typed.is_empty() {
        let qualities = declared.iter().filter(|declared| declared.quality);
        let knobs: Vec<Knob> = qualities
            .map(|declared| Knob { id: declared.id.clone(), values: steps(declared) })
            .collect();
        if knobs.is_empty() {
            bail!(
                "{unit} declares no parameter that trades time for quality; name one with --knob, \
                 as id=value,value,…: {}",
                ids()
            );
        }
        return Ok(knobs);
    }
    let mut knobs: Vec<Knob> = Vec::new();
    for Setting { unit: meant, id, value } in typed {
        if let Some(meant) = meant
            && !parameters::names(unit, meant)
        {
            bail!("--knob {meant}:{id}={value} is meant for `{meant}`; what is swept is {unit}");
        }
        let Some(declared) = declared.iter().find(|declared| declared.id == *id) else {
            bail!("{unit} has no parameter `{id}`; it has: {}", ids());
        };
        let values: Vec<String> = value.split(',').map(|value| value.trim().to_owned()).collect();
        // Values that are written in two ways are one: 2 and 02.
        let mut seen = Vec::new();
        let mut different = Vec::new();
        for value in values {
            let parsed = declared.parse(&value).map_err(anyhow::Error::msg)?;
            if !seen.contains(&parsed) {
                seen.push(parsed);
                different.push(value);
            }
        }
        let values = different;
        match knobs.iter_mut().find(|knob| knob.id == *id) {
            Some(knob) => knob.values.extend(values),
            None => knobs.push(Knob { id: id.clone(), values }),
        }
    }
    for knob in &mut knobs {
        let mut seen = Vec::new();
        knob.values.retain(|value| {
            let is_new = !seen.contains(value);
            seen.push(value.clone());
            is_new
        });
    }
    Ok(knobs)
}

/// Values from one end of a declared range to the other, in even ratios where it is wide or where the
/// plugin says so. A logarithmic range that begins at 0 is entered at a ten thousandth of its end.
pub fn steps(declared: &ParamDecl) -> Vec<String> {
    let whole = declared.kind == ParamKind::Int;
    match (&declared.kind, declared.range) {
        (ParamKind::Choice(ids), _) => ids.clone(),
        (ParamKind::Bool, _) => vec!["false".to_owned(), "true".to_owned()],
        (ParamKind::Int, Some([low, high])) if high - low < MOST_VALUES as f64 => {
            (low as i64..=high as i64).map(|value| value.to_string()).collect()
        }
        (_, Some([low, high])) => {
            let n = MOST_VALUES as f64 - 1.0;
            let entered = if declared.logarithmic && low == 0.0 { high * 1e-4 } else { low };
            let ratio = entered > 0.0 && high / entered >= 8.0;
            let value = |i: usize| match (ratio, i == MOST_VALUES - 1) {
                (_, true) => high,
                (true, _) => entered * (high / entered).powf(i as f64 / n),
                (false, _) => low + (high - low) * i as f64 / n,
            };
            let round = |v: f64| if whole { v.round() } else { three_digits(v) };
            let values = (0..MOST_VALUES).map(value).map(round).map(|v| v.clamp(low, high));
            let mut values: Vec<String> = values.map(|value| value.to_string()).collect();
            values.dedup();
            values
        }
        _ => vec![typed(&declared.default)],
    }
}

/// A value as it is typed behind `--set id=`.
pub fn typed(value: &Value) -> String {
    match value {
        Value::Bool(value) => value.to_string(),
        Value::Int(value) => value.to_string(),
        Value::Float(value) => value.to_string(),
        Value::Text(text) => text.clone(),
        Value::Color([r, g, b]) => format!("{r},{g},{b}"),
    }
}

/// A value as it is read well: nobody asks for the fourth digit of a step.
fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::params::{ParamDecl, ParamSet as _};
    use surfelshop_api::prelude::*;

    params! {
        struct All {
            /// One.
            few: u32 { default: 1, range: 0..=4, quality: true },
            /// Two.
            wide: u32 { default: 1, range: 1..=65536, quality: true, logarithmic: true },
            /// Three.
            open: f32 { default: 0.008, range: 0.0..=1.0, quality: true, logarithmic: true },
            /// Four.
            even: f32 { default: 0.5, range: 0.0..=2.0, quality: true },
            /// Five.
            flag: bool { default: true, quality: true },
        }
    }

    fn steps_of(id: &str) -> Vec<String> {
        let declared = All::declare();
        steps(declared.iter().find(|declared: &&ParamDecl| declared.id == id).unwrap())
    }

    #[test]
    fn steps_go_from_end_to_end() {
        assert_eq!(steps_of("few"), ["0", "1", "2", "3", "4"]);
        assert_eq!(steps_of("wide").join(" "), "1 4 16 64 256 1024 4096 16384 65536");
        let open = steps_of("open");
        assert_eq!((open.len(), open[0].as_str(), open[4].as_str()), (9, "0.0001", "0.01"));
        assert_eq!(open.last().unwrap(), "1");
        assert_eq!(steps_of("even").join(" "), "0 0.25 0.5 0.75 1 1.25 1.5 1.75 2");
        assert_eq!(steps_of("flag"), ["false", "true"]);
    }
}
