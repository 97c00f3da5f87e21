//! Attributes besides positions.

use crate::accessor::{Accessor, Shape};
use crate::buffers::Buffers;
use crate::extensions;
use gltf::json::Root;
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use surfelshop_api::prelude::Result;

/// Most lines about attributes.
const MAX_LINES: usize = 10;

/// An attribute of an own name.
#[derive(Debug)]
pub(crate) struct Attribute {
    /// In lower case, without the underscore.
    pub name: String,
    pub accessor: Accessor,
}

/// Adds a line that is new, where there are not too many.
pub(crate) fn say(lines: &mut Vec<String>, line: String) {
    if lines.len() < MAX_LINES && !lines.contains(&line) {
        lines.push(line);
    }
}

/// An attribute that has one element for each point, of a shape that it can have; else it is left out.
pub(crate) fn checked(
    name: &str,
    accessor: Option<Accessor>,
    count: u32,
    lines: &mut Vec<String>,
) -> Option<Accessor> {
    let accessor = accessor?;
    let Shape { kind, components, normalized } = accessor.shape;
    let fits = match name {
        "NORMAL" => components == 3,
        "COLOR_0" => {
            let whole = matches!(kind, ComponentType::U8 | ComponentType::U16);
            matches!(components, 3 | 4) && (kind == ComponentType::F32 || whole && normalized)
        }
        _ => (1..=4).contains(&components),
    };
    if fits && accessor.count == count {
        return Some(accessor);
    }
    let reason = if fits {
        format!("expected {count} elements, found {}", accessor.count)
    } else {
        format!("{components} components of {kind:?} are not what it can have")
    };
    say(lines, format!("{name} was left out: {reason}"));
    None
}

/// The attributes of own names.
///
/// # Errors
/// Where an accessor is not there.
pub(crate) fn own(
    root: &Root,
    buffers: &Buffers,
    primitive: &Primitive,
    count: u32,
    lines: &mut Vec<String>,
) -> Result<Vec<Attribute>> {
    let mut found = Vec::new();
    for (semantic, index) in &primitive.attributes {
        let own = match semantic {
            Checked::Valid(Semantic::Extras(own)) => own,
            Checked::Valid(_) => continue,
            // Those of splats are read by themselves.
            Checked::Invalid if extensions::splats(primitive).is_some() => continue,
            Checked::Invalid => {
                say(lines, "attributes whose names glTF does not have were left out".to_owned());
                continue;
            }
        };
        let clean = own.chars().filter(|c| !c.is_control()).take(60);
        let name: String = clean.flat_map(char::to_lowercase).collect();
        let name = if name.is_empty() { "attribute".to_owned() } else { name };
        let accessor = Accessor::find(root, buffers, index.value())?;
        let shown = format!("_{}", name.to_uppercase());
        if let Some(accessor) = checked(&shown, Some(accessor), count, lines) {
            found.push(Attribute { name, accessor });
        }
    }
    Ok(found)
}
