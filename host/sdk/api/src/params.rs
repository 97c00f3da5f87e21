//! Parameters a unit declares once; the host draws the panel, checks ranges, keeps presets and
//! reads `--set id=value`.

mod macros;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::Path;

/// A parameter's value on its way across the boundary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// A switch.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f64),
    /// Text, a path, or the id of a choice.
    Text(String),
    /// Linear Rec. 709 colour.
    Color([f32; 3]),
}

/// Values by parameter id.
pub type Values = BTreeMap<String, Value>;

/// What kind of value a parameter takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ParamKind {
    /// A switch.
    Bool,
    /// A whole number.
    Int,
    /// A number.
    Float,
    /// Free text.
    Text,
    /// A colour, linear Rec. 709.
    Color,
    /// One of several ids.
    Choice(Vec<String>),
    /// The path of a file, or nothing: from the current folder, and in scenes from the scene's. The
    /// window draws anew when the file changes.
    File {
        /// Endings of such files, without the dot; any where there are none.
        endings: Vec<String>,
    },
}

/// One declared parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ParamDecl {
    /// Stable id: presets and `--set` refer to it.
    pub id: String,
    /// What the window calls it; the id where it is empty.
    pub label: String,
    /// The kind of value.
    pub kind: ParamKind,
    /// The value where none is set.
    pub default: Value,
    /// Smallest and largest number allowed, inclusive.
    pub range: Option<[f64; 2]>,
    /// Unit shown behind the number, such as `deg`.
    pub unit: String,
    /// What the parameter does, in a sentence or two.
    pub doc: String,
    /// Whether the parameter trades time for quality, so that reports sweep it.
    pub quality: bool,
    /// Whether a slider for it should be logarithmic.
    pub logarithmic: bool,
}

/// Unit of a text that holds pairs of places of two clouds, with semicolons between: `0 0 0 1 0 0; 0 1 0 1 1 0`. The window
/// lets them be clicked. ABI 3.11.
pub const PLACE_PAIRS: &str = "x y z x y z";
/// Unit of a text that holds pairs of a place and of where it is in the picture that the unit's first parameter of a file names,
/// shares from its left and top: `0 0 0 0 1; 1 0 0 1 1`. The window lets them be clicked. ABI 3.11.
pub const PICTURE_PAIRS: &str = "x y z u v";

impl Default for ParamDecl {
    fn default() -> Self {
        Self {
            id: String::new(),
            label: String::new(),
            kind: ParamKind::Bool,
            default: Value::Bool(false),
            range: None,
            unit: String::new(),
            doc: String::new(),
            quality: false,
            logarithmic: false,
        }
    }
}

impl ParamDecl {
    /// Declares a parameter named after a field: underscores become hyphens, the documentation
    /// comment becomes the help text.
    #[must_use]
    pub fn new<T: ParamType>(field: &str, default: &T, doc: &str) -> Self {
        Self {
            id: field.replace('_', "-"),
            kind: T::kind(),
            default: default.to_value(),
            doc: doc.split_whitespace().collect::<Vec<_>>().join(" "),
            ..Self::default()
        }
    }

    /// Uses another id than the field's name.
    #[must_use]
    pub fn id(mut self, id: &str) -> Self {
        id.clone_into(&mut self.id);
        self
    }

    /// Has the window call it so, where the id is an abbreviation or a symbol of a paper.
    #[must_use]
    pub fn label(mut self, label: &str) -> Self {
        label.clone_into(&mut self.label);
        self
    }

    /// What the window calls it.
    #[must_use]
    pub fn title(&self) -> &str {
        if self.label.is_empty() { &self.id } else { &self.label }
    }

    /// Allows only numbers in this range.
    #[must_use]
    pub fn range(mut self, range: impl ParamRange) -> Self {
        self.range = Some(range.ends());
        self
    }

    /// Shows this unit behind the number.
    #[must_use]
    pub fn unit(mut self, unit: &str) -> Self {
        unit.clone_into(&mut self.unit);
        self
    }

    /// Names the endings, without the dot, that the files of a path have.
    #[must_use]
    pub fn endings(mut self, endings: &[&str]) -> Self {
        let endings = endings.iter().map(|&ending| ending.to_owned()).collect();
        self.kind = ParamKind::File { endings };
        self
    }

    /// Says whether the parameter trades time for quality.
    #[must_use]
    pub fn quality(mut self, quality: bool) -> Self {
        self.quality = quality;
        self
    }

    /// Says whether a slider for it should be logarithmic.
    #[must_use]
    pub fn logarithmic(mut self, logarithmic: bool) -> Self {
        self.logarithmic = logarithmic;
        self
    }

    /// What the parameter accepts, in words: `a number from 0 to 1`.
    #[must_use]
    pub fn expectation(&self) -> String {
        let numbers = |what: &str| match self.range {
            Some([low, high]) => format!("{what} from {low} to {high}"),
            None => what.to_owned(),
        };
        match &self.kind {
            ParamKind::Bool => "true or false".to_owned(),
            ParamKind::Int => numbers("a whole number"),
            ParamKind::Float => numbers("a number"),
            ParamKind::Text => "text".to_owned(),
            ParamKind::File { endings } if endings.is_empty() => "the path of a file".to_owned(),
            ParamKind::File { endings } => format!("the path of a .{} file", endings.join(" or .")),
            ParamKind::Color => "a colour as #rrggbb or r,g,b (linear)".to_owned(),
            ParamKind::Choice(ids) => format!("one of {}", ids.join(", ")),
        }
    }

    /// Reads a value from text as typed behind `--set id=`.
    ///
    /// # Errors
    /// A line that says what was expected and what was found.
    pub fn parse(&self, text: &str) -> Result<Value, String> {
        let text = text.trim();
        let value = match &self.kind {
            ParamKind::Bool => match text {
                "true" | "on" | "yes" | "1" => Some(Value::Bool(true)),
                "false" | "off" | "no" | "0" => Some(Value::Bool(false)),
                _ => None,
            },
            ParamKind::Int => text.parse().ok().map(Value::Int),
            ParamKind::Float => text.parse().ok().filter(|v: &f64| v.is_finite()).map(Value::Float),
            ParamKind::Text | ParamKind::File { .. } => Some(Value::Text(text.to_owned())),
            ParamKind::Color => parse_color(text).map(Value::Color),
            ParamKind::Choice(ids) => {
                ids.iter().find(|id| *id == text).map(|id| Value::Text(id.clone()))
            }
        };
        value.filter(|value| self.in_range(value)).ok_or_else(|| {
            format!("parameter `{}` takes {}, found `{text}`", self.id, self.expectation())
        })
    }

    fn in_range(&self, value: &Value) -> bool {
        let number = match value {
            Value::Int(v) => *v as f64,
            Value::Float(v) => *v,
            _ => return true,
        };
        self.range.is_none_or(|[low, high]| (low..=high).contains(&number))
    }

    /// The value to use for a received one: of the declared kind and inside the range; the
    /// default where it is missing or of another kind, NaN included.
    #[must_use]
    pub fn sanitise(&self, value: Option<&Value>) -> Value {
        value.and_then(|value| self.fitted(value)).unwrap_or_else(|| self.default.clone())
    }

    /// A value brought into the range; `None` where it is of another kind or not a number.
    #[must_use]
    pub fn fitted(&self, value: &Value) -> Option<Value> {
        let clamp = |number: f64| match self.range {
            // Unlike `clamp` these take a range without order.
            Some([low, high]) => number.max(low).min(high),
            None => number,
        };
        match (&self.kind, value) {
            (ParamKind::Int, Value::Int(v)) => Some(Value::Int(clamp(*v as f64).round() as i64)),
            (ParamKind::Int, Value::Float(v)) if v.is_finite() => {
                Some(Value::Int(clamp(*v).round() as i64))
            }
            (ParamKind::Float, Value::Float(v)) if v.is_finite() => Some(Value::Float(clamp(*v))),
            (ParamKind::Float, Value::Int(v)) => Some(Value::Float(clamp(*v as f64))),
            (ParamKind::Color, Value::Color(v)) => {
                v.iter().all(|c| c.is_finite()).then(|| value.clone())
            }
            (ParamKind::Choice(ids), Value::Text(v)) => ids.contains(v).then(|| value.clone()),
            (ParamKind::Bool, Value::Bool(_))
            | (ParamKind::Text | ParamKind::File { .. }, Value::Text(_)) => Some(value.clone()),
            _ => None,
        }
    }
}

fn parse_color(text: &str) -> Option<[f32; 3]> {
    if let Some(hex) = text.strip_prefix('#') {
        let bits = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6)?;
        let channel = |shift: u32| srgb_to_linear(((bits >> shift) & 255) as f32 / 255.0);
        return Some([channel(16), channel(8), channel(0)]);
    }
    let mut numbers = text.split(',').map(|part| part.trim().parse::<f32>());
    let color = [numbers.next()?.ok()?, numbers.next()?.ok()?, numbers.next()?.ok()?];
    (numbers.next().is_none() && color.iter().all(|c| c.is_finite())).then_some(color)
}

/// Decodes one sRGB-encoded value in [0, 1] to linear light.
///
/// Source: IEC 61966-2-1.
#[must_use]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes linear light in [0, 1] as sRGB; the inverse of [`srgb_to_linear`].
#[must_use]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Inclusive ends of a range, from whole numbers or floats.
pub trait ParamRange {
    /// Lower and upper end.
    fn ends(self) -> [f64; 2];
}

impl ParamRange for RangeInclusive<f64> {
    fn ends(self) -> [f64; 2] {
        [*self.start(), *self.end()]
    }
}

impl ParamRange for RangeInclusive<i32> {
    fn ends(self) -> [f64; 2] {
        [f64::from(*self.start()), f64::from(*self.end())]
    }
}

/// A Rust type that a parameter can have.
pub trait ParamType: Sized {
    /// The kind of value the host edits.
    fn kind() -> ParamKind;
    /// The value as it crosses the boundary.
    fn to_value(&self) -> Value;
    /// The Rust value; `None` for a value of another kind.
    fn from_value(value: &Value) -> Option<Self>;
    /// Whether it is a whole number that is never negative: a `u32` in shaders. ABI 3.10.
    #[must_use]
    fn is_unsigned() -> bool {
        false
    }
}

macro_rules! param_type {
    ($type:ty, $kind:ident, $value:pat => $from:expr, $self:ident => $to:expr) => {
        impl ParamType for $type {
            fn is_unsigned() -> bool {
                stringify!($type) == "u32"
            }
            fn kind() -> ParamKind {
                ParamKind::$kind
            }
            fn to_value(&self) -> Value {
                let $self = self;
                $to
            }
            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    $value => $from,
                    _ => None,
                }
            }
        }
    };
}

param_type!(bool, Bool, Value::Bool(v) => Some(*v), v => Value::Bool(*v));
param_type!(f32, Float, Value::Float(v) => Some(*v as Self), v => Value::Float(f64::from(*v)));
param_type!(f64, Float, Value::Float(v) => Some(*v), v => Value::Float(*v));
param_type!(u32, Int, Value::Int(v) => Self::try_from(*v).ok(), v => Value::Int(i64::from(*v)));
param_type!(i32, Int, Value::Int(v) => Self::try_from(*v).ok(), v => Value::Int(i64::from(*v)));
param_type!(String, Text, Value::Text(v) => Some(v.clone()), v => Value::Text(v.clone()));
param_type!([f32; 3], Color, Value::Color(v) => Some(*v), v => Value::Color(*v));

/// Whether a value's type is unsigned, where a macro has the value alone.
#[doc(hidden)]
#[must_use]
pub fn is_unsigned<T: ParamType>(_value: &T) -> bool {
    T::is_unsigned()
}

/// The path of a file that a parameter names; empty where it names none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FilePath(pub String);

impl FilePath {
    /// The path, for functions of the standard library. ABI 3.10.
    #[must_use]
    pub fn as_path(&self) -> &Path {
        Path::new(&self.0)
    }

    /// Whether it names no file. ABI 3.10.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl AsRef<Path> for FilePath {
    fn as_ref(&self) -> &Path {
        self.as_path()
    }
}

impl fmt::Display for FilePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl ParamType for FilePath {
    fn kind() -> ParamKind {
        ParamKind::File { endings: Vec::new() }
    }
    fn to_value(&self) -> Value {
        Value::Text(self.0.clone())
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(path) => Some(Self(path.clone())),
            _ => None,
        }
    }
}

/// A structure declared with [`params!`](crate::params!).
pub trait ParamSet: Default + Clone + Send + 'static {
    /// The declarations, in the order of the fields.
    fn declare() -> Vec<ParamDecl>;
    /// The structure with these values, each inside its declared range.
    fn from_values(values: &Values) -> Self;
    /// The declarations with this structure's values as defaults: a group can have other defaults where
    /// it is part of a set. ABI 3.7.
    fn declared(&self) -> Vec<ParamDecl> {
        Self::declare()
    }
    /// This structure with those of its values that are given, each inside its declared range. ABI 3.7.
    #[must_use]
    fn with_values(self, values: &Values) -> Self {
        Self::from_values(values)
    }
    /// The values by id. ABI 3.7.
    fn values(&self) -> Values {
        Values::new()
    }
    /// The ids of the parameters that are `u32` in shaders, of all whole numbers. ABI 3.10.
    fn unsigned(&self) -> Vec<String> {
        Vec::new()
    }
}

/// For units without parameters.
impl ParamSet for () {
    fn declare() -> Vec<ParamDecl> {
        Vec::new()
    }
    fn from_values(_values: &Values) -> Self {}
}

#[cfg(test)]
mod tests;
