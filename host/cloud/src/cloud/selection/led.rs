//! Strokes of tools over clouds that are larger than memory: done again to what is read of them.

use super::{Selection, SelectionError, SurfelRuns};
use crate::cloud::Cloud;
use crate::cloud::edit::EditedCloud;
use crate::cloud::part::CloudPart;
use crate::cloud::transform::Transform;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};
use std::cmp::Ordering;
use std::fmt::Debug;
use surfelshop_api::Stroke;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::params::{ParamDecl, Value, Values};

/// A stroke with the tool that it was made with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedStroke {
    /// The tool, as PACKAGE/ID or ID.
    pub tool: String,
    /// Its parameters; those that are missing have their defaults.
    #[serde(default)]
    pub values: Map<String, Json>,
    /// What the hand did, in world space.
    pub stroke: Stroke,
    /// Surfels of the cloud that it was led over, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n_surfels: Option<u64>,
    /// The surfels that it concerned, where others near it were left out: some were selected or hidden.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub among: Option<SurfelRuns>,
}

/// Runs tools along strokes.
pub trait StrokeTools: Debug + Send + Sync {
    /// Whether the tool of a stroke is there, and takes its parameters.
    ///
    /// # Errors
    /// A line why not.
    fn check(&self, led: &NamedStroke) -> Result<(), String>;

    /// Runs the tool over a part of a cloud along the stroke; nothing where it changes nothing.
    ///
    /// # Errors
    /// A line why it did not come to its end.
    fn lead(&self, led: &NamedStroke, part: CloudPart) -> Result<Option<EditedCloud>, String>;
}

/// Columns that say where surfels are, how large and how turned: merged ones follow from them.
const PLACES: [&str; 5] = [POSITION, NORMAL, RADIUS, TANGENT_U, TANGENT_V];

/// Most samples of a stroke of a layer, and dabs: a hand makes some hundreds, and each is looked at for each surfel near
/// it.
const MOST_DABS: usize = 1 << 14;

impl NamedStroke {
    /// Whether it was made with a tool.
    #[must_use]
    pub fn is_of(&self, package: &str, id: &str) -> bool {
        self.tool == id || self.tool == format!("{package}/{id}")
    }

    /// Its parameters as a tool declares them.
    ///
    /// # Errors
    /// A line, where the tool has no such parameter or takes other values.
    pub fn fitted(&self, declared: &[ParamDecl]) -> Result<Values, String> {
        let mut values = Values::new();
        for (id, json) in &self.values {
            let declared = declared.iter().find(|declared| declared.id == *id);
            let declared = declared.ok_or_else(|| format!("it has no parameter `{id}`"))?;
            // Hands cannot lead a tool with others.
            let is_within = |value: &Value| match (value, declared.range) {
                (Value::Float(number), Some([low, high])) => (low..=high).contains(number),
                (Value::Int(number), Some([low, high])) => (low..=high).contains(&(*number as f64)),
                _ => true,
            };
            let value = value_of(json).filter(is_within).and_then(|value| declared.fitted(&value));
            let value = value.ok_or_else(|| {
                format!("`{id}`: expected {}, found {json}", declared.expectation())
            })?;
            values.insert(id.clone(), value);
        }
        Ok(values)
    }

    /// Whether it comes near a ball in the world.
    pub(super) fn reaches(&self, middle: DVec3, radius: f64) -> bool {
        let Stroke { radius: own, samples, .. } = &self.stroke;
        // What rounding does is far less; a ball without numbers may be anywhere.
        let reach = (radius + own) * (1.0 + 1e-9);
        let is_near = |distance: f64| distance.partial_cmp(&reach) != Some(Ordering::Greater);
        let from_line = |a: DVec3, b: DVec3| {
            let (from, along) = (middle - a, b - a);
            let share = (from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            // Of samples at one place there is no share.
            (from - along * if share > 0.0 { share } else { 0.0 }).length()
        };
        samples.first().is_some_and(|sample| is_near(middle.distance(sample.place)))
            || samples.windows(2).any(|ends| is_near(from_line(ends[0].place, ends[1].place)))
    }

    /// Whether what a tool made of a part of a cloud can be an edit of a layer.
    ///
    /// # Errors
    /// Where it moved surfels, added some, or made a column that the cloud lacks.
    pub fn allows(&self, cloud: &Cloud, edited: &EditedCloud) -> Result<(), SelectionError> {
        let failed = |line: String| Err(SelectionError::Tool { tool: self.tool.clone(), line });
        if edited.n_added > 0 {
            return failed("expected values or removals, found new surfels".to_owned());
        }
        for name in &edited.columns {
            if PLACES.contains(&name.as_str()) {
                return failed(format!(
                    "expected a tool that leaves surfels where they are, found another `{name}`"
                ));
            }
            if cloud.column(name).is_none() {
                return failed(format!(
                    "it makes the column `{name}`, which the pyramid lacks; select all and set its value first"
                ));
            }
        }
        Ok(())
    }

    /// Whether it can be followed, and is no longer than what is followed in a moment.
    ///
    /// # Errors
    /// A line why not.
    pub(super) fn check(&self, cloud: &Cloud) -> Result<(), SelectionError> {
        if self.among.is_some() {
            return Err(SelectionError::Tool {
                tool: self.tool.clone(),
                line: "expected a stroke without `among`, which numbers surfels of a cloud in memory; remove it"
                    .to_owned(),
            });
        }
        let Stroke { radius, dabs, samples } = &self.stroke;
        let length: f64 =
            samples.windows(2).map(|ends| ends[0].place.distance(ends[1].place)).sum();
        let n_dabs = length / (radius * f64::from(dabs.spacing));
        if samples.len() > MOST_DABS || n_dabs > MOST_DABS as f64 {
            return Err(SelectionError::Tool {
                tool: self.tool.clone(),
                line: format!(
                    "expected a stroke of at most {MOST_DABS} samples and dabs, found {} and {n_dabs:.0}",
                    samples.len()
                ),
            });
        }
        CloudPart::along(cloud, &self.stroke, None)?;
        Ok(())
    }

    /// Does it to a cloud as its file has it, which `placed` puts into the world, and to what is chosen of it. Gives which
    /// surfels are left, where some are gone.
    ///
    /// # Errors
    /// Where the tool fails, moves surfels, adds some, or makes a column that the cloud lacks.
    pub(super) fn applied(
        &self,
        tools: &dyn StrokeTools,
        cloud: &Cloud,
        (placed, chosen): (&Transform, &Selection),
    ) -> Result<(Cloud, Option<Vec<bool>>), SelectionError> {
        let in_world = cloud.transformed(placed)?;
        let part = CloudPart::along(&in_world, &self.stroke, Some(chosen))?;
        if part.rows.is_empty() {
            return Ok((cloud.clone(), None));
        }
        let failed = |line: String| SelectionError::Tool { tool: self.tool.clone(), line };
        let Some(edited) = tools.lead(self, part).map_err(failed)? else {
            return Ok((cloud.clone(), None));
        };
        self.allows(cloud, &edited)?;
        let columns = edited.columns.iter().filter_map(|name| edited.cloud.column(name).cloned());
        let columns = columns.collect();
        let kept = match &edited.kept {
            Some(kept) => cloud.keep(kept)?,
            None => cloud.clone(),
        };
        Ok((kept.with_columns(columns)?, edited.kept))
    }
}

fn value_of(json: &Json) -> Option<Value> {
    Some(match json {
        Json::Bool(value) => Value::Bool(*value),
        Json::Number(number) => match number.as_i64() {
            Some(value) => Value::Int(value),
            None => Value::Float(number.as_f64()?),
        },
        Json::String(text) => Value::Text(text.clone()),
        Json::Array(channels) => {
            let channels: Option<Vec<f32>> =
                channels.iter().map(|channel| Some(channel.as_f64()? as f32)).collect();
            Value::Color(channels?.try_into().ok()?)
        }
        Json::Null | Json::Object(_) => return None,
    })
}
