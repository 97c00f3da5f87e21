//! Parameter values as TOML, and back.

use surfelshop_api::params::Value;
use toml::Value as Toml;

/// The value of a parameter; `None` for dates and tables.
pub(crate) fn value_of(toml: &Toml) -> Option<Value> {
    // A colour's channel may be written as an integer.
    let number = |value: &Toml| value.as_float().or_else(|| Some(value.as_integer()? as f64));
    match toml {
        Toml::Boolean(value) => Some(Value::Bool(*value)),
        Toml::Integer(value) => Some(Value::Int(*value)),
        Toml::Float(value) => Some(Value::Float(*value)),
        Toml::String(value) => Some(Value::Text(value.clone())),
        Toml::Array(values) => {
            let channel = |i: usize| values.get(i).and_then(number).map(|v| v as f32);
            Some(Value::Color([channel(0)?, channel(1)?, channel(2)?]))
        }
        Toml::Datetime(_) | Toml::Table(_) => None,
    }
}

/// A parameter's value as TOML.
pub(crate) fn toml_of(value: &Value) -> Toml {
    match value {
        Value::Bool(value) => Toml::Boolean(*value),
        Value::Int(value) => Toml::Integer(*value),
        Value::Float(value) => Toml::Float(*value),
        Value::Text(value) => Toml::String(value.clone()),
        Value::Color(value) => {
            Toml::Array(value.iter().map(|&channel| Toml::Float(f64::from(channel))).collect())
        }
    }
}
