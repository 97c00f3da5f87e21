//! Parameters typed with `--set`, checked against what the renderer declares.

use crate::values::Setting;
use anyhow::{anyhow, bail};
use surfelshop_api::params::{ParamDecl, Values};
use surfelshop_engine::plugins::UnitRef;

/// The values meant for a unit; the last one of an id counts.
pub(crate) fn values(
    unit: &UnitRef,
    declared: &[ParamDecl],
    typed: &[Setting],
) -> anyhow::Result<Values> {
    let mut values = Values::new();
    for setting in typed {
        if let Some(meant) = &setting.unit
            && !names(unit, meant)
        {
            let (id, value) = (&setting.id, &setting.value);
            bail!(
                "--set {meant}:{id}={value} is meant for `{meant}`, which is not rendered with; \
                 the renderer is `{}`",
                unit.id
            );
        }
        let declaration = declared
            .iter()
            .find(|declaration| declaration.id == setting.id)
            .ok_or_else(|| anyhow!(unknown(unit, declared, &setting.id)))?;
        let value = declaration
            .parse(&setting.value)
            .map_err(|line| anyhow!("renderer `{}`: {line}", unit.id))?;
        values.insert(setting.id.clone(), value);
    }
    Ok(values)
}

/// Whether a name as typed stands for the unit.
fn names(unit: &UnitRef, name: &str) -> bool {
    match name.rsplit_once('/') {
        Some((package, id)) => package == unit.package && id == unit.id,
        None => name == unit.id,
    }
}

fn unknown(unit: &UnitRef, declared: &[ParamDecl], id: &str) -> String {
    let known: Vec<String> = declared
        .iter()
        .map(|declaration| format!("{} ({})", declaration.id, declaration.expectation()))
        .collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join("; ") };
    format!("renderer `{}` has no parameter `{id}`; it has: {known}", unit.id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::UnitKind;
    use surfelshop_api::params::Value;

    fn read(typed: &[&str]) -> anyhow::Result<Values> {
        let unit = UnitRef {
            kind: UnitKind::Renderer,
            package: "org.example".to_owned(),
            id: "mine".to_owned(),
            path: "mine.so".into(),
        };
        let declared = [ParamDecl::new("some_gain", &1.0f32, "A gain.").range(0.0..=2.0)];
        let typed: Vec<Setting> = typed.iter().map(|text| Setting::parse(text).unwrap()).collect();
        values(&unit, &declared, &typed)
    }

    #[test]
    fn values_reach_the_renderer_they_name() {
        for text in ["some-gain=1.5", "mine:some-gain=1.5", "org.example/mine:some-gain=1.5"] {
            assert_eq!(read(&[text]).unwrap()["some-gain"], Value::Float(1.5), "{text}");
        }
        assert!(read(&["other:some-gain=1"]).unwrap_err().to_string().contains("`other`"));
        assert_eq!(read(&["some-gain=1", "some-gain=2"]).unwrap()["some-gain"], Value::Float(2.0));
    }

    #[test]
    fn mistakes_list_what_there_is() {
        let unknown = read(&["gain=1"]).unwrap_err().to_string();
        assert!(unknown.contains("some-gain (a number from 0 to 2)"), "{unknown}");
        let outside = read(&["some-gain=3"]).unwrap_err().to_string();
        assert!(outside.contains("from 0 to 2, found `3`"), "{outside}");
    }
}
