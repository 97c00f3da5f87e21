//! TOML text with the keys in a given order, each number in the fewest digits that are read as the same one.

use glam::Vec3;
use std::fmt::Write as _;
use surfelshop_api::params;
use toml::{Table, Value};

/// Keys in the order they are written.
pub(crate) type Entries = Vec<(String, Node)>;

/// What stands behind a key.
pub(crate) enum Node {
    /// Something on the line of its key.
    Value(Value),
    /// A table under a header of its own.
    Table(Entries),
    /// Tables that each have the header.
    Tables(Vec<Entries>),
}

pub(crate) fn entry(key: &str, value: impl Into<Value>) -> (String, Node) {
    (key.to_owned(), Node::Value(value.into()))
}

pub(crate) fn with_unknown(entries: &mut Entries, unknown: &Table) {
    entries.extend(unknown.iter().map(|(key, value)| (key.clone(), Node::from(value))));
}

/// The value of a parameter.
pub(crate) fn parameter(value: &params::Value) -> Value {
    match value {
        params::Value::Bool(value) => (*value).into(),
        params::Value::Int(value) => (*value).into(),
        params::Value::Float(value) => (*value).into(),
        params::Value::Text(value) => value.as_str().into(),
        params::Value::Color(value) => color(Vec3::from(*value)),
    }
}

/// Parameters on one line, as an inline table.
pub(crate) fn values_text(values: &params::Values) -> String {
    let table = values.iter().map(|(id, value)| (id.clone(), parameter(value))).collect();
    let mut text = String::new();
    value_text(&mut text, &Value::Table(table));
    text
}

pub(crate) fn vector<const N: usize>(numbers: [f64; N]) -> Value {
    Value::Array(numbers.into_iter().map(Value::Float).collect())
}

pub(crate) fn color(channels: Vec3) -> Value {
    vector(channels.to_array().map(float))
}

/// The number of fewest digits that is read as this one.
pub(crate) fn float(number: f32) -> f64 {
    let short = format!("{number:?}").parse().unwrap_or(f64::from(number));
    if short as f32 == number { short } else { f64::from(number) }
}

impl From<&Value> for Node {
    fn from(value: &Value) -> Self {
        let entries = |table: &Table| -> Entries {
            table.iter().map(|(key, value)| (key.clone(), Self::from(value))).collect()
        };
        match value {
            Value::Table(table) => Self::Table(entries(table)),
            Value::Array(array) if !array.is_empty() && array.iter().all(Value::is_table) => {
                Self::Tables(array.iter().filter_map(Value::as_table).map(entries).collect())
            }
            other => Self::Value(other.clone()),
        }
    }
}

/// Appends the lines of a table: what has no header of its own must stand before what has.
pub(crate) fn lines(text: &mut String, name: &str, entries: &Entries) {
    for (key, node) in entries {
        if let Node::Value(value) = node {
            *text += &key_text(key);
            *text += " = ";
            value_text(text, value);
            text.push('\n');
        }
    }
    for (key, node) in entries {
        let name =
            if name.is_empty() { key_text(key) } else { format!("{name}.{}", key_text(key)) };
        match node {
            Node::Value(_) => {}
            Node::Table(inner) => {
                *text += &format!("\n[{name}]\n");
                lines(text, &name, inner);
            }
            Node::Tables(tables) => {
                for inner in tables {
                    *text += &format!("\n[[{name}]]\n");
                    lines(text, &name, inner);
                }
            }
        }
    }
}

/// A key, quoted where it must be.
fn key_text(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(is_bare) { key.to_owned() } else { string(key) }
}

/// A text in quotes, on one line.
fn string(text: &str) -> String {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted += "\\n",
            '\t' => quoted += "\\t",
            '\r' => quoted += "\\r",
            // Writing to a string does not fail.
            c if c.is_control() => drop(write!(quoted, "\\u{:04X}", u32::from(c))),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// A value on one line.
fn value_text(text: &mut String, value: &Value) {
    match value {
        Value::String(value) => *text += &string(value),
        Value::Integer(value) => *text += &value.to_string(),
        Value::Boolean(value) => *text += &value.to_string(),
        Value::Datetime(value) => *text += &value.to_string(),
        Value::Float(value) if value.is_nan() => *text += "nan",
        // The fewest digits that are read as the same number, always with a point or an exponent.
        Value::Float(value) => *text += &format!("{value:?}"),
        Value::Array(values) => {
            text.push('[');
            for (i, value) in values.iter().enumerate() {
                *text += if i == 0 { "" } else { ", " };
                value_text(text, value);
            }
            text.push(']');
        }
        Value::Table(table) => {
            for (i, (key, value)) in table.iter().enumerate() {
                *text += if i == 0 { "{ " } else { ", " };
                *text += &format!("{} = ", key_text(key));
                value_text(text, value);
            }
            *text += if table.is_empty() { "{}" } else { " }" };
        }
    }
}

/// Parameters on one line, as [`values_text`] writes them.
pub(crate) fn values_of_text(text: &str) -> Option<params::Values> {
    let mut table: Table = toml::from_str(&format!("values = {text}")).ok()?;
    let Value::Table(values) = table.remove("values")? else { return None };
    if !table.is_empty() {
        return None;
    }
    let value = |value: Value| match value {
        Value::Boolean(value) => Some(params::Value::Bool(value)),
        Value::Integer(value) => Some(params::Value::Int(value)),
        Value::Float(value) => Some(params::Value::Float(value)),
        Value::String(value) => Some(params::Value::Text(value)),
        Value::Array(channels) => {
            let channels = channels.iter().map(|c| c.as_float().map(|c| c as f32));
            let color: Vec<f32> = channels.collect::<Option<_>>()?;
            color.try_into().ok().map(params::Value::Color)
        }
        Value::Datetime(_) | Value::Table(_) => None,
    };
    values.into_iter().map(|(id, given)| Some((id, value(given)?))).collect()
}
