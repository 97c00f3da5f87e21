//! The members of a WGSL uniform structure, by name: the host lays them out.

use crate::params::{ParamKind, ParamSet, Value};
use glam::{Mat4, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

/// The type of a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MemberType {
    /// `f32`.
    F32,
    /// `u32`.
    U32,
    /// `i32`.
    I32,
    /// `u32` or `i32`, as the structure declares it.
    Int,
    /// `vec2<f32>`.
    Vec2,
    /// `vec3<f32>`.
    Vec3,
    /// `vec4<f32>`.
    Vec4,
    /// `mat4x4<f32>`.
    Mat4,
}

impl MemberType {
    /// The type in WGSL; of [`Int`](Self::Int) `i32`. ABI 3.10.
    #[must_use]
    pub const fn wgsl(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::U32 => "u32",
            Self::I32 | Self::Int => "i32",
            Self::Vec2 => "vec2<f32>",
            Self::Vec3 => "vec3<f32>",
            Self::Vec4 => "vec4<f32>",
            Self::Mat4 => "mat4x4<f32>",
        }
    }

    /// Bytes of a value.
    #[must_use]
    pub const fn size(self) -> u64 {
        match self {
            Self::F32 | Self::U32 | Self::I32 | Self::Int => 4,
            Self::Vec2 => 8,
            Self::Vec3 => 12,
            Self::Vec4 => 16,
            Self::Mat4 => 64,
        }
    }
}

/// A member as it crosses the boundary; its bytes follow those of the members before it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// The name, as in WGSL.
    pub name: String,
    /// The type.
    pub kind: MemberType,
}

/// Members of a uniform structure with their values, in any order.
///
/// The host finds each by its name in the structure that the shader declares. A member without a value, a
/// value without a member and a value of another type are refused by name.
///
/// ```
/// use surfelshop_api::graph::{Graph, Members};
/// let mut graph = Graph::new();
/// let settings = graph.members(Members::new().u32("n_steps", 8).f32("gain", 0.5));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    list: Vec<(Member, Vec<u8>)>,
    /// Names of parameters that are `u32` where nothing else says what they are.
    unsigned: Vec<String>,
}

impl Members {
    /// No members.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A member for each parameter that is a number, a switch (`u32`, 0 or 1), a colour (`vec3<f32>`) or a
    /// choice (`u32`, its position among the choices). It is called as the parameter's id, with underscores
    /// for hyphens. Texts and files have no member.
    #[must_use]
    pub fn of(params: &impl ParamSet) -> Self {
        let values = params.values();
        let name_of = |id: &str| id.replace('-', "_");
        let unsigned = params.unsigned().iter().map(|id| name_of(id)).collect();
        let mut members = Self { unsigned, ..Self::new() };
        for declared in params.declared() {
            let name = name_of(&declared.id);
            let choices: &[String] = match &declared.kind {
                ParamKind::Choice(ids) => ids,
                _ => &[],
            };
            members = match values.get(&declared.id) {
                Some(Value::Bool(on)) => members.u32(&name, u32::from(*on)),
                Some(Value::Int(number)) => members.int(&name, *number),
                Some(Value::Float(number)) => members.f32(&name, *number as f32),
                Some(Value::Color(linear)) => members.vec3(&name, Vec3::from_array(*linear)),
                Some(Value::Text(text)) => match choices.iter().position(|id| id == text) {
                    Some(position) => members.u32(&name, position as u32),
                    None => members,
                },
                None => members,
            };
        }
        members
    }

    /// Leaves a member out, where there is one.
    #[must_use]
    pub fn without(mut self, name: &str) -> Self {
        self.list.retain(|(member, _)| member.name != name);
        self
    }

    /// Sets an `f32`.
    #[must_use]
    pub fn f32(self, name: &str, value: f32) -> Self {
        self.set(name, MemberType::F32, value.to_le_bytes())
    }

    /// Sets a `u32`.
    #[must_use]
    pub fn u32(self, name: &str, value: u32) -> Self {
        self.set(name, MemberType::U32, value.to_le_bytes())
    }

    /// Sets an `i32`.
    #[must_use]
    pub fn i32(self, name: &str, value: i32) -> Self {
        self.set(name, MemberType::I32, value.to_le_bytes())
    }

    /// Sets a `u32` or `i32`, as the structure declares it; of larger numbers the low 32 bits.
    fn int(self, name: &str, value: i64) -> Self {
        let [a, b, c, d, ..] = value.to_le_bytes();
        self.set(name, MemberType::Int, [a, b, c, d])
    }

    /// Sets a `vec2<f32>`.
    #[must_use]
    pub fn vec2(self, name: &str, value: Vec2) -> Self {
        self.floats(name, MemberType::Vec2, &value.to_array())
    }

    /// Sets a `vec3<f32>`.
    #[must_use]
    pub fn vec3(self, name: &str, value: Vec3) -> Self {
        self.floats(name, MemberType::Vec3, &value.to_array())
    }

    /// Sets a `vec4<f32>`.
    #[must_use]
    pub fn vec4(self, name: &str, value: Vec4) -> Self {
        self.floats(name, MemberType::Vec4, &value.to_array())
    }

    /// Sets a `mat4x4<f32>`.
    #[must_use]
    pub fn mat4(self, name: &str, value: Mat4) -> Self {
        self.floats(name, MemberType::Mat4, &value.to_cols_array())
    }

    fn floats(self, name: &str, kind: MemberType, values: &[f32]) -> Self {
        self.set(name, kind, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    }

    /// Sets a member, instead of one of that name.
    fn set(mut self, name: &str, kind: MemberType, bytes: impl Into<Vec<u8>>) -> Self {
        let known = self.list.iter().position(|(member, _)| member.name == name);
        let new = (Member { name: name.to_owned(), kind }, bytes.into());
        match known {
            Some(i) => self.list[i] = new,
            None => self.list.push(new),
        }
        self
    }

    /// The members of a structure in WGSL, a line each.
    pub(super) fn declarations(&self) -> String {
        let line = |(member, _): &(Member, Vec<u8>)| {
            let is_unsigned =
                member.kind == MemberType::Int && self.unsigned.contains(&member.name);
            let kind = if is_unsigned { MemberType::U32 } else { member.kind };
            format!("    {}: {},\n", member.name, kind.wgsl())
        };
        self.list.iter().map(line).collect()
    }

    /// The members and, behind one another, the bytes of their values.
    pub(super) fn into_parts(self) -> (Vec<Member>, Vec<u8>) {
        let (members, bytes): (Vec<Member>, Vec<Vec<u8>>) = self.list.into_iter().unzip();
        (members, bytes.concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::choices! {
        /// A choice.
        enum Model { First = "first", Second = "second" }
    }

    crate::params! {
        /// One of each kind.
        struct Settings {
            /// A number.
            gain: f32 { default: 0.5 },
            /// A whole number.
            n_steps: u32 { default: 7 },
            /// A switch.
            filter: bool { default: true },
            /// A colour.
            tint: [f32; 3] { default: [0.1, 0.2, 0.3] },
            /// A choice.
            model: Model { default: Model::Second },
            /// A text.
            title: String { default: "none".to_owned() },
        }
    }

    #[test]
    fn parameters_are_members_by_id_and_kind() {
        let (members, bytes) = Members::of(&Settings::default()).into_parts();
        let found: Vec<_> = members.iter().map(|m| (m.name.as_str(), m.kind)).collect();
        let expected = [
            ("gain", MemberType::F32),
            ("n_steps", MemberType::Int),
            ("filter", MemberType::U32),
            ("tint", MemberType::Vec3),
            ("model", MemberType::U32),
        ];
        assert_eq!(found, expected);
        assert_eq!(bytes.len() as u64, members.iter().map(|m| m.kind.size()).sum::<u64>());
        assert_eq!(bytes[..4], 0.5f32.to_le_bytes());
        assert_eq!(bytes[bytes.len() - 4..], 1u32.to_le_bytes());
    }

    #[test]
    fn a_name_has_the_value_that_was_set_last_or_none() {
        let twice = Members::new().f32("a", 1.0).u32("b", 2).u32("a", 3);
        assert_eq!(twice, Members::new().u32("a", 3).u32("b", 2));
        assert_eq!(twice.without("a").without("c"), Members::new().u32("b", 2));
    }

    #[test]
    fn declarations_have_the_types_of_the_parameters() {
        let members = Members::of(&Settings::default()).without("tint").i32("offset", -1);
        let expected = "    gain: f32,\n    n_steps: u32,\n    filter: u32,\n    model: u32,\n    offset: i32,\n";
        assert_eq!(members.declarations(), expected);
    }
}
