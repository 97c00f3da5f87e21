//! Takes a rebuilt plugin as far as its first graph before anything is handed over.
//!
//! Lifecycle: load the file as it is now; keep the parameters that still fit; make an instance;
//! have it describe one frame; decode that. The caller then puts the new instance into a
//! [`RendererView`](crate::RendererView) beside the old one and swaps them once the engine has
//! rendered a frame of it, since only the engine compiles shaders. Whatever fails on the way, the
//! old instance runs on: its library stays loaded and its file was never mapped.

use super::find::UnitRef;
use super::load::{LoadError, LoadTimes, LoadedUnit};
use super::watchdog::Hosted;
use super::watchdog::Timeouts;
use crate::boundary::{Fault, decode};
use std::time::{Duration, Instant};
use surfelshop_api::graph::Structure;
use surfelshop_api::params::{ParamDecl, Value, Values};
use surfelshop_api::{FrameRequest, HostInfo};

/// A unit loaded again, with an instance that described a first frame.
#[derive(Debug)]
pub struct Reloaded {
    /// The unit as it is now.
    pub unit: LoadedUnit,
    /// The instance.
    pub hosted: Hosted,
    /// The parameters for it.
    pub kept: CarriedValues,
    /// How long it took.
    pub took: ReloadTimes,
}

/// How long the steps took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReloadTimes {
    /// Loading and the unit's description of itself.
    pub load: LoadTimes,
    /// Making an instance and describing and decoding the first frame.
    pub first_graph: Duration,
}

impl ReloadTimes {
    /// All of it.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.load.load + self.load.handshake + self.first_graph
    }
}

/// Parameters carried over to another declaration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarriedValues {
    /// The values that fit; the others have their default.
    pub values: Values,
    /// What was changed or lost, a line each that names the parameter.
    pub notes: Vec<String>,
}

impl UnitRef {
    /// Loads the unit from its file as it is now and has it describe the frame of `request`, with
    /// those of its parameters that still fit.
    ///
    /// # Errors
    /// Where any step fails; names the plugin, its file and the reason.
    pub fn reload(
        &self,
        host: &HostInfo,
        request: &FrameRequest,
        patience: &Timeouts,
    ) -> Result<Reloaded, LoadError> {
        let unit = self.load(patience)?;
        let started = Instant::now();
        let kept = keep_values(&request.values, &unit.description.params);
        let mut hosted = unit
            .start(host, patience)
            .map_err(|fault| LoadError::Start { unit: Box::new(self.clone()), fault })?;
        let request = FrameRequest { values: kept.values.clone(), ..request.clone() };
        first_graph(&mut hosted, request)
            .map_err(|fault| LoadError::Frame { unit: Box::new(self.clone()), fault })?;
        let took = ReloadTimes { load: unit.took, first_graph: started.elapsed() };
        Ok(Reloaded { unit, hosted, kept, took })
    }
}

fn first_graph(hosted: &mut Hosted, request: FrameRequest) -> Result<Structure, Fault> {
    decode(&hosted.frame(request)?)
}

/// Carries values over to a declaration: those of the same id and a fitting kind, brought into
/// the range.
#[must_use]
pub fn keep_values(old: &Values, declared: &[ParamDecl]) -> CarriedValues {
    let mut kept = CarriedValues::default();
    for (id, value) in old {
        let Some(declaration) = declared.iter().find(|declaration| declaration.id == *id) else {
            kept.notes.push(format!("parameter `{id}` is gone, and its value {}", shown(value)));
            continue;
        };
        let takes = declaration.expectation();
        match declaration.fitted(value) {
            None => kept.notes.push(format!(
                "parameter `{id}` now takes {takes}: {} instead of {}",
                shown(&declaration.default),
                shown(value)
            )),
            Some(fitted) => {
                if number(&fitted) != number(value) {
                    kept.notes.push(format!(
                        "parameter `{id}` now takes {takes}: {} instead of {}",
                        shown(&fitted),
                        shown(value)
                    ));
                }
                kept.values.insert(id.clone(), fitted);
            }
        }
    }
    kept
}

/// A number of either kind; a whole one and an equal float are the same.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Int(v) => Some(*v as f64),
        Value::Float(v) => Some(*v),
        Value::Bool(_) | Value::Text(_) | Value::Color(_) => None,
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Bool(v) => v.to_string(),
        Value::Int(v) => v.to_string(),
        Value::Float(v) => v.to_string(),
        Value::Text(v) => format!("`{}`", v.escape_debug()),
        Value::Color([r, g, b]) => format!("{r},{g},{b}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::params::ParamKind;

    fn declared() -> Vec<ParamDecl> {
        let gain = ParamDecl::new("gain", &1.0f32, "").range(0.0..=2.0);
        let samples = ParamDecl::new("samples", &4u32, "").range(1..=16);
        let kind = ParamKind::Choice(vec!["fast".to_owned(), "exact".to_owned()]);
        let mode = ParamDecl { kind, ..ParamDecl::new("mode", &"exact".to_owned(), "") };
        vec![gain, samples, mode, ParamDecl::new("tint", &[0.5f32; 3], "")]
    }

    fn kept(old: &[(&str, Value)]) -> CarriedValues {
        let old = old.iter().map(|(id, value)| ((*id).to_owned(), value.clone()));
        keep_values(&old.collect(), &declared())
    }

    #[test]
    fn fitting_values_are_kept_without_a_word() {
        let old = [
            ("gain", Value::Float(1.5)),
            ("samples", Value::Int(16)),
            ("mode", Value::Text("fast".into())),
            ("tint", Value::Color([0.1, 0.2, 0.3])),
        ];
        let kept = kept(&old);
        assert_eq!(kept.notes, [] as [String; 0]);
        assert_eq!(kept.values.into_iter().collect::<Vec<_>>(), {
            let mut old = old.map(|(id, value)| (id.to_owned(), value));
            old.sort_by(|a, b| a.0.cmp(&b.0));
            old
        });
    }

    #[test]
    fn whole_numbers_become_floats_and_back() {
        let kept = kept(&[("gain", Value::Int(2)), ("samples", Value::Float(3.0))]);
        assert_eq!(kept.notes, [] as [String; 0]);
        assert_eq!(kept.values["gain"], Value::Float(2.0));
        assert_eq!(kept.values["samples"], Value::Int(3));
    }

    #[test]
    fn what_no_longer_fits_is_brought_into_range_or_dropped_and_named() {
        let kept = kept(&[
            ("gain", Value::Float(7.0)),
            ("samples", Value::Text("many".into())),
            ("mode", Value::Text("slow".into())),
            ("tint", Value::Color([f32::NAN; 3])),
            ("old", Value::Bool(true)),
        ]);
        assert_eq!(kept.values.len(), 1);
        assert_eq!(kept.values["gain"], Value::Float(2.0));
        assert_eq!(
            kept.notes,
            [
                "parameter `gain` now takes a number from 0 to 2: 2 instead of 7",
                "parameter `mode` now takes one of fast, exact: `exact` instead of `slow`",
                "parameter `old` is gone, and its value true",
                "parameter `samples` now takes a whole number from 1 to 16: 4 instead of `many`",
                "parameter `tint` now takes a colour as #rrggbb or r,g,b (linear): 0.5,0.5,0.5 \
                 instead of NaN,NaN,NaN",
            ]
        );
    }
}
