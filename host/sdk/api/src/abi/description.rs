//! What a unit says of itself once it is loaded.

use crate::need::Need;
use crate::params::{ParamDecl, ParamKind, Value};
use crate::stroke::Handling;
use crate::unit::{Limit, Scope};
use serde::{Deserialize, Serialize};

/// Most parameters of a unit; a panel of so many is of no use to anybody.
const MAX_PARAMS: usize = 1024;

/// Least and largest distance of dabs, in radii.
const SPACINGS: [f32; 2] = [0.01, 10.0];

/// What a unit says of itself once it is loaded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Description {
    /// Its parameters.
    pub params: Vec<ParamDecl>,
    /// What it cannot do. ABI 3.2.
    pub limits: Vec<Limit>,
    /// Of a tool: how much of a cloud it has to see.
    pub scope: Scope,
    /// Of a renderer: the columns that it reads. ABI 3.9.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<Need>,
    /// Of a tool: how it is handled. ABI 3.11.
    #[serde(skip_serializing_if = "is_of_clouds")]
    pub handling: Handling,
}

fn is_of_clouds(handling: &Handling) -> bool {
    *handling == Handling::Cloud
}

impl Description {
    /// Whether a host can make a panel of it: ids that can be typed, each once, ranges with a lower and an
    /// upper end, and defaults that are what they themselves ask for.
    ///
    /// # Errors
    /// A line that names the parameter, with what was expected and what was found.
    pub fn check(&self) -> Result<(), String> {
        if self.params.len() > MAX_PARAMS {
            let found = self.params.len();
            return Err(format!("expected at most {MAX_PARAMS} parameters, found {found}"));
        }
        for (i, declared) in self.params.iter().enumerate() {
            let id = &declared.id;
            let typed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
            if id.is_empty() || id.len() > 128 || !id.chars().all(typed) {
                let id = id.escape_debug();
                return Err(format!(
                    "parameter `{id}`: expected an id of letters, digits, -, _ and ."
                ));
            }
            if self.params[..i].iter().any(|other| other.id == *id) {
                return Err(format!("parameter `{id}` is declared twice"));
            }
            check(declared).map_err(|what| format!("parameter `{id}`: {what}"))?;
        }
        let spacing = self.handling.dabs().spacing;
        if !(SPACINGS[0]..=SPACINGS[1]).contains(&spacing) {
            let [low, high] = SPACINGS;
            return Err(format!(
                "handling: expected a spacing of {low} to {high} radii, found {spacing}"
            ));
        }
        Ok(())
    }
}

fn check(declared: &ParamDecl) -> Result<(), String> {
    let [low, high] = declared.range.unwrap_or([0.0, 1.0]);
    if !(low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY) {
        return Err(format!("expected a range from lower to upper end, found {low} to {high}"));
    }
    if matches!(&declared.kind, ParamKind::Choice(ids) if ids.is_empty()) {
        return Err("expected choices, found none".to_owned());
    }
    let same = |fitted: &Value| match (fitted, &declared.default) {
        // A default of 1.2 in f32 lies beyond a range that ends at 1.2 in f64.
        (Value::Float(a), Value::Float(b)) => (a - b).abs() <= f64::from(f32::EPSILON) * b.abs(),
        (fitted, default) => fitted == default,
    };
    match declared.fitted(&declared.default) {
        Some(fitted) if same(&fitted) => Ok(()),
        _ => Err(format!(
            "expected a default that is {}, found {:?}",
            declared.expectation(),
            declared.default
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_panel_could_show_is_refused_by_the_parameters_name() {
        let good = ParamDecl::new("gain", &1.0f32, "Gain.").range(0.0..=4.0);
        let of = |params: Vec<ParamDecl>| Description { params, ..Description::default() }.check();
        assert_eq!(of(vec![good.clone()]), Ok(()));
        let bad = |change: &dyn Fn(&mut ParamDecl), words: &str| {
            let mut declared = good.clone();
            change(&mut declared);
            let line = of(vec![declared]).unwrap_err();
            assert!(line.contains(words), "{line}");
        };
        let edge = ParamDecl::new("edge", &1.2f32, "Edge.").range(0.0..=1.2);
        assert_eq!(of(vec![edge]), Ok(()));
        bad(&|d| d.range = Some([f64::NAN, 4.0]), "`gain`: expected a range");
        bad(&|d| d.range = Some([4.0, 0.0]), "found 4 to 0");
        bad(&|d| d.range = Some([f64::INFINITY; 2]), "found inf to inf");
        bad(&|d| d.default = Value::Float(5.0), "a number from 0 to 4");
        bad(&|d| d.default = Value::Float(f64::NAN), "found Float(NaN)");
        bad(&|d| d.default = Value::Bool(true), "found Bool(true)");
        bad(&|d| d.kind = ParamKind::Choice(Vec::new()), "expected choices");
        bad(&|d| d.id = "a\tb".to_owned(), "expected an id");
        bad(&|d| d.id = String::new(), "expected an id");
        assert!(of(vec![good.clone(), good]).unwrap_err().contains("twice"));
    }
}
