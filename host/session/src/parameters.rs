//! Parameters typed with `--set` or given by a scene, checked against what the unit declares.

use crate::options::values::Setting;
use crate::output::files;
use crate::setup::SelectedView;
use anyhow::{anyhow, bail};
use std::path::{Path, PathBuf};
use surfelshop_api::params::{ParamDecl, ParamKind, Value, Values};
use surfelshop_runtime::plugins::UnitRef;

/// The values meant for a unit; the last one of an id counts.
pub fn values<'a>(
    unit: &UnitRef,
    declared: &[ParamDecl],
    typed: impl IntoIterator<Item = &'a Setting>,
) -> anyhow::Result<Values> {
    let mut values = Values::new();
    for setting in typed {
        if let Some(meant) = &setting.unit
            && !names(unit, meant)
        {
            let (id, value) = (&setting.id, &setting.value);
            bail!(
                "--set {meant}:{id}={value} is meant for `{meant}`, which is not used; the {} is \
                 `{}`",
                unit.kind.word(),
                unit.id
            );
        }
        let declaration = declared
            .iter()
            .find(|declaration| declaration.id == setting.id)
            .ok_or_else(|| anyhow!(unknown(unit, declared, &setting.id)))?;
        let value = declaration
            .parse(&setting.value)
            .map_err(|line| anyhow!("{} `{}`: {line}", unit.kind.word(), unit.id))?;
        if let (ParamKind::File { .. }, Value::Text(path)) = (&declaration.kind, &value) {
            files::protect([Path::new(path)]);
        }
        values.insert(setting.id.clone(), value);
    }
    Ok(values)
}

/// The values of a view of a scene, where there is one, and over them those that were typed; and a line
/// for each of the view's that the unit does not know.
pub fn resolved(
    unit: &UnitRef,
    declared: &[ParamDecl],
    view: Option<&SelectedView<'_>>,
    typed: &[Setting],
) -> anyhow::Result<(Values, Vec<String>)> {
    let typed = values(unit, declared, typed)?;
    let (mut values, unknown) =
        view.map(|view| of_view(unit, declared, view)).transpose()?.unwrap_or_default();
    values.extend(typed);
    Ok((values, unknown))
}

/// The settings meant for each of several units that are used one after the other; where there are
/// several, each setting says for which.
pub fn dealt<'a>(units: &[UnitRef], typed: &'a [Setting]) -> anyhow::Result<Vec<Vec<&'a Setting>>> {
    for Setting { unit, id, value } in typed {
        let ids = || units.iter().map(|unit| unit.id.as_str()).collect::<Vec<_>>().join(", ");
        match unit {
            None if units.len() > 1 => {
                let first = units.first().map_or("", |unit| unit.id.as_str());
                bail!("--set {id}={value} could be meant for {}; say {first}:{id}={value}", ids())
            }
            Some(meant) if !units.iter().any(|unit| names(unit, meant)) => bail!(
                "--set {meant}:{id}={value} is meant for `{meant}`, which is not used; used: {}",
                ids()
            ),
            _ => {}
        }
    }
    let is_for = |unit: &UnitRef, setting: &&Setting| {
        setting.unit.as_ref().is_none_or(|meant| names(unit, meant))
    };
    let of = |unit| typed.iter().filter(|setting| is_for(unit, setting)).collect();
    Ok(units.iter().map(of).collect())
}

/// The values of a scene's view, and a line for each that the renderer does not know: it may be
/// another version of the plugin.
pub fn of_view(
    unit: &UnitRef,
    declared: &[ParamDecl],
    SelectedView { view, place, folder }: &SelectedView<'_>,
) -> anyhow::Result<(Values, Vec<String>)> {
    let (mut values, mut unknown_ids) = (Values::new(), Vec::new());
    for (id, value) in &view.values {
        let Some(declaration) = declared.iter().find(|declaration| declaration.id == *id) else {
            unknown_ids.push(format!("{place}: {}", unknown(unit, declared, id)));
            continue;
        };
        let value = accepted(declaration, value, folder)
            .map_err(|line| anyhow!("{place}: renderer `{}`: {line}", unit.id))?;
        if let (ParamKind::File { .. }, Value::Text(path)) = (&declaration.kind, &value) {
            files::protect([Path::new(path)]);
        }
        values.insert(id.clone(), value);
    }
    Ok((values, unknown_ids))
}

/// Brings values of a scene in a folder to the declared kinds and ranges, and returns a line for each
/// that the scene did not mean so; those that the renderer does not know are kept as they are.
pub fn fit(
    renderer: &str,
    declared: &[ParamDecl],
    values: &mut Values,
    folder: &Path,
) -> Vec<String> {
    let mut lines = Vec::new();
    for (id, value) in values {
        match declared.iter().find(|declaration| declaration.id == *id) {
            None => lines.push(format!("renderer `{renderer}` has no parameter `{id}`")),
            Some(declaration) => match accepted(declaration, value, folder) {
                Ok(fitted) => *value = fitted,
                Err(line) => {
                    *value = declaration.sanitise(Some(value));
                    lines
                        .push(format!("renderer `{renderer}`: {line}; {} is used", written(value)));
                }
            },
        }
    }
    lines
}

fn written(value: &Value) -> String {
    match value {
        Value::Bool(value) => value.to_string(),
        Value::Int(value) => value.to_string(),
        Value::Float(value) => format!("{value:?}"),
        Value::Text(value) => value.clone(),
        Value::Color(value) => format!("{value:?}"),
    }
}

/// The paths among a renderer's values, as `change` makes them; empty ones stay.
pub fn with_paths(
    declared: &[ParamDecl],
    mut values: Values,
    change: impl Fn(&Path) -> PathBuf,
) -> Values {
    for declaration in declared {
        if let ParamKind::File { .. } = declaration.kind
            && let Some(Value::Text(path)) = values.get_mut(&declaration.id)
            && !path.is_empty()
        {
            *path = change(Path::new(path)).display().to_string();
        }
    }
    values
}

/// The value of a parameter as a scene in a folder gives it, where it is of the kind and in the range.
fn accepted(declaration: &ParamDecl, value: &Value, folder: &Path) -> Result<Value, String> {
    let found = written(value);
    match (&declaration.kind, value) {
        // From the scene's folder, as all paths of a scene.
        (ParamKind::File { .. }, Value::Text(path)) if !path.is_empty() => {
            Ok(Value::Text(folder.join(path).display().to_string()))
        }
        (ParamKind::Bool, Value::Bool(_))
        | (ParamKind::Text | ParamKind::File { .. }, Value::Text(_))
        | (ParamKind::Color, Value::Color(_)) => Ok(value.clone()),
        // These are written alike in scenes and behind `--set`.
        (ParamKind::Int | ParamKind::Float, Value::Int(_) | Value::Float(_))
        | (ParamKind::Color | ParamKind::Choice(_), Value::Text(_)) => declaration.parse(&found),
        _ => {
            let (id, expected) = (&declaration.id, declaration.expectation());
            Err(format!("parameter `{id}` takes {expected}, found `{found}`"))
        }
    }
}

/// Whether a name as typed stands for the unit.
pub fn names(unit: &UnitRef, name: &str) -> bool {
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
    format!("{} `{}` has no parameter `{id}`; it has: {known}", unit.kind.word(), unit.id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::UnitKind;
    use surfelshop_api::params::{FilePath, Value};
    use surfelshop_cloud::scene::SceneView;

    fn unit() -> UnitRef {
        UnitRef::named(UnitKind::Renderer, "org.example", "mine", "mine.so")
    }

    fn read(typed: &[&str]) -> anyhow::Result<Values> {
        let unit = unit();
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
    fn settings_reach_the_unit_they_name_among_several() {
        let other = UnitRef::named(UnitKind::Renderer, "org.example", "other", "mine.so");
        let dealt = |typed: &[&str]| {
            let typed: Vec<Setting> = typed.iter().map(|t| Setting::parse(t).unwrap()).collect();
            let units = [unit(), other.clone()];
            dealt(&units, &typed)
                .map(|dealt| dealt.iter().map(|d| d.len()).collect::<Vec<_>>())
                .map_err(|error| error.to_string())
        };
        assert_eq!(dealt(&["mine:a=1", "org.example/other:b=2", "mine:c=3"]), Ok(vec![2, 1]));
        let unsaid = dealt(&["a=1"]).unwrap_err();
        assert_eq!(unsaid, "--set a=1 could be meant for mine, other; say mine:a=1");
        assert!(dealt(&["third:a=1"]).unwrap_err().ends_with("is not used; used: mine, other"));
    }

    #[test]
    fn mistakes_list_what_there_is() {
        let unknown = read(&["gain=1"]).unwrap_err().to_string();
        assert!(unknown.contains("some-gain (a number from 0 to 2)"), "{unknown}");
        let outside = read(&["some-gain=3"]).unwrap_err().to_string();
        assert!(outside.contains("from 0 to 2, found `3`"), "{outside}");
    }

    #[test]
    fn values_of_scenes_are_brought_to_what_is_declared() {
        let declared = [
            ParamDecl::new("gain", &1.0f32, "A gain.").range(0.0..=2.0),
            ParamDecl::new("tint", &[1.0f32; 3], "A tint."),
        ];
        let mut values = Values::from([
            ("gain".to_owned(), Value::Float(3.0)),
            ("tint".to_owned(), Value::Text("#ff0000".to_owned())),
            ("mood".to_owned(), Value::Bool(true)),
        ]);
        let lines = fit("mine", &declared, &mut values, Path::new(""));
        assert_eq!(lines.len(), 2, "{lines:?}");
        assert!(lines[0].contains("from 0 to 2, found `3.0`; 2.0 is used"), "{lines:?}");
        assert!(lines[1].contains("no parameter `mood`"), "{lines:?}");
        assert_eq!(values["gain"], Value::Float(2.0));
        assert_eq!(values["tint"], Value::Color([1.0, 0.0, 0.0]));
        assert_eq!(values["mood"], Value::Bool(true));
        // What fits now is not told again.
        assert_eq!(fit("mine", &declared, &mut values, Path::new("")).len(), 1);
    }

    #[test]
    fn values_of_scenes_are_checked_like_typed_ones() {
        let declared = [
            ParamDecl::new("gain", &1.0f32, "A gain.").range(0.0..=2.0),
            ParamDecl::new("count", &1u32, "A count."),
            ParamDecl::new("tint", &[0.0f32; 3], "A tint."),
            ParamDecl::new("on", &true, "A switch."),
            ParamDecl::new("file", &FilePath::default(), "A file.").endings(&["wgsl"]),
        ];
        let path = |path: &str| Value::Text(path.to_owned());
        let given = |id: &str, value: Value| {
            let mut view = SceneView::new("mine");
            view.values.insert(id.to_owned(), value);
            let place = "a.scene.toml:7".to_owned();
            let chosen = SelectedView { view: &view, place, folder: PathBuf::from("scenes") };
            of_view(&unit(), &declared, &chosen)
        };
        for (id, value, expected) in [
            ("gain", Value::Int(2), Value::Float(2.0)),
            ("gain", Value::Float(0.1), Value::Float(0.1)),
            ("count", Value::Int(-3), Value::Int(-3)),
            ("tint", Value::Color([0.5; 3]), Value::Color([0.5; 3])),
            ("tint", Value::Text("#ffffff".into()), Value::Color([1.0; 3])),
            ("on", Value::Bool(false), Value::Bool(false)),
            // Paths are from the scene's folder, as all paths of a scene.
            ("file", path(""), path("")),
            ("file", path("a.wgsl"), path("scenes/a.wgsl")),
            ("file", path("/tmp/a.wgsl"), path("/tmp/a.wgsl")),
        ] {
            assert_eq!(given(id, value).unwrap().0[id], expected);
        }
        for (id, value, words) in [
            ("gain", Value::Float(2.5), "takes a number from 0 to 2, found `2.5`"),
            ("gain", Value::Text("2".into()), "takes a number from 0 to 2, found `2`"),
            ("count", Value::Float(2.5), "takes a whole number, found `2.5`"),
            ("tint", Value::Text("red".into()), "found `red`"),
            ("on", Value::Int(1), "takes true or false, found `1`"),
            ("file", Value::Int(1), "takes the path of a .wgsl file, found `1`"),
        ] {
            let error = given(id, value).unwrap_err().to_string();
            assert!(error.starts_with("a.scene.toml:7: renderer `mine`: parameter"), "{error}");
            assert!(error.ends_with(words), "{error}");
        }
        let (values, unknown) = given("gian", Value::Int(1)).unwrap();
        assert!(values.is_empty());
        assert!(unknown[0].starts_with("a.scene.toml:7: renderer `mine` has no parameter `gian`"));
    }
}
