//! Uniforms given by name, laid out as a shader's structure declares them.

use crate::gpu::Gpu;
use crate::graph::shading::list;
use crate::shader_compiler::UniformMember;
use std::borrow::Cow;
use surfelshop_api::graph::{Member, MemberType, Span};

/// A uniform's bytes as one structure has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct UniformLayout {
    /// The uniform.
    pub(crate) uniform: usize,
    /// Bytes of the structure.
    pub(crate) size: u64,
    /// Pieces of the uniform's own bytes: where each is there, where it belongs, and how long it is.
    pieces: Vec<[usize; 3]>,
}

impl UniformLayout {
    /// Finds each member that is given in the structure `declared`, which takes `size` bytes.
    ///
    /// # Errors
    /// Where one is missing on either side, there twice, or of another type.
    pub(crate) fn new(
        uniform: usize,
        given: &[Member],
        declared: &[UniformMember],
        size: u64,
    ) -> Result<Self, String> {
        let mut pieces = Vec::with_capacity(given.len());
        let mut from = 0;
        for (i, member) in given.iter().enumerate() {
            let name = &member.name;
            if given[..i].iter().any(|earlier| earlier.name == *name) {
                return Err(format!("member `{name}` is given twice"));
            }
            let Some(there) = declared.iter().find(|there| there.name == *name) else {
                let names: Vec<&str> = declared.iter().map(|there| there.name.as_str()).collect();
                return Err(format!(
                    "member `{name}` is given, which the structure lacks; it has: {}",
                    list(&names)
                ));
            };
            if !fits(member.kind, &there.kind) {
                return Err(format!(
                    "member `{name}` is {} in the shader, {} given",
                    there.kind,
                    word(member.kind)
                ));
            }
            let len = member.kind.size() as usize;
            pieces.push([from, there.offset, len]);
            from += len;
        }
        let is_given = |name: &String| given.iter().any(|member| member.name == *name);
        if let Some(missing) = declared.iter().find(|there| !is_given(&there.name)) {
            return Err(format!("member `{}` ({}) is not given", missing.name, missing.kind));
        }
        Ok(Self { uniform, size, pieces })
    }

    /// Appends the structure's bytes; padding is zero.
    ///
    /// # Errors
    /// Where the uniform has too few bytes, or lies outside the frame's data.
    pub(crate) fn append(&self, span: Span, data: &[u8], to: &mut Vec<u8>) -> Result<(), String> {
        let range = usize::try_from(span.offset).ok().zip(usize::try_from(span.len).ok());
        let own = range.and_then(|(start, len)| data.get(start..start.checked_add(len)?));
        let start = to.len();
        to.resize(start + self.size as usize, 0);
        for &[from, at, len] in &self.pieces {
            let bytes = own.and_then(|own| own.get(from..from + len));
            let place = to.get_mut(start + at..start + at + len);
            match (bytes, place) {
                (Some(bytes), Some(place)) => place.copy_from_slice(bytes),
                _ => return Err(format!("a uniform of {} bytes has too few", span.len)),
            }
        }
        Ok(())
    }
}

/// Whether a value of this type is one of the WGSL type.
fn fits(kind: MemberType, declared: &str) -> bool {
    word(kind) == declared || kind == MemberType::Int && ["u32", "i32"].contains(&declared)
}

/// The WGSL type.
fn word(kind: MemberType) -> &'static str {
    match kind {
        MemberType::F32 => "f32",
        MemberType::U32 => "u32",
        MemberType::I32 => "i32",
        MemberType::Int => "a whole number",
        MemberType::Vec2 => "vec2<f32>",
        MemberType::Vec3 => "vec3<f32>",
        MemberType::Vec4 => "vec4<f32>",
        MemberType::Mat4 => "mat4x4<f32>",
    }
}

/// Uniforms start at multiples of this many bytes, as any device takes it.
const UNIFORM_ALIGN: usize = 256;

/// All uniforms of a frame, in one buffer: the frame's data, and behind it the uniforms that are given by
/// name, as the structures of shaders have them.
pub(super) struct Uniforms<'a> {
    pub(super) buffer: wgpu::Buffer,
    laid_out: Vec<(&'a UniformLayout, Span)>,
}

impl<'a> Uniforms<'a> {
    /// Those of a frame's data that lie there, and as they are laid out; `None` where there are none.
    pub(super) fn new(
        uniforms: &[Span],
        layouts: impl Iterator<Item = &'a UniformLayout>,
        data: &[u8],
        gpu: &Gpu,
    ) -> Result<Option<Self>, String> {
        if uniforms.is_empty() {
            return Ok(None);
        }
        let mut bytes = Cow::Borrowed(data);
        let mut laid_out: Vec<(&UniformLayout, Span)> = Vec::new();
        for layout in layouts {
            if laid_out.iter().any(|(known, _)| *known == layout) {
                continue;
            }
            let bytes = bytes.to_mut();
            bytes.resize(bytes.len().next_multiple_of(UNIFORM_ALIGN), 0);
            let offset = bytes.len() as u64;
            layout.append(uniforms[layout.uniform], data, bytes)?;
            laid_out.push((layout, Span { offset, len: layout.size }));
        }
        let buffer = gpu.filled_buffer("uniforms", &bytes, wgpu::BufferUsages::UNIFORM);
        Ok(Some(Self { buffer, laid_out }))
    }

    /// Where the bytes of a layout lie.
    pub(super) fn span_of(&self, layout: &UniformLayout) -> Option<Span> {
        self.laid_out.iter().find(|(known, _)| *known == layout).map(|(_, span)| *span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn declared(members: &[(&str, &str, usize)]) -> Vec<UniformMember> {
        let member = |(name, kind, offset): &(&str, &str, usize)| UniformMember {
            name: (*name).to_owned(),
            kind: (*kind).to_owned(),
            offset: *offset,
        };
        members.iter().map(member).collect()
    }

    fn given(members: &[(&str, MemberType)]) -> Vec<Member> {
        members
            .iter()
            .map(|(name, kind)| Member { name: (*name).to_owned(), kind: *kind })
            .collect()
    }

    #[test]
    fn members_go_where_the_structure_has_them_in_any_order() {
        // struct { gain: f32, tint: vec3<f32>, n: i32 }
        let there = declared(&[("gain", "f32", 0), ("tint", "vec3<f32>", 16), ("n", "i32", 28)]);
        let one =
            given(&[("n", MemberType::Int), ("tint", MemberType::Vec3), ("gain", MemberType::F32)]);
        let layout = UniformLayout::new(0, &one, &there, 32).unwrap();
        let mut data = (-2i32).to_le_bytes().to_vec();
        data.extend([1.0f32, 2.0, 3.0, 0.5].iter().flat_map(|v| v.to_le_bytes()));
        let mut bytes = vec![9; 4];
        layout.append(Span { offset: 0, len: 20 }, &data, &mut bytes).unwrap();
        let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(bytes.len(), 36);
        assert_eq!([float(4), float(8), float(20), float(28)], [0.5, 0.0, 1.0, 3.0]);
        assert_eq!(bytes[32..], (-2i32).to_le_bytes());
        // Too few bytes, and bytes that are not there.
        for span in [
            Span { offset: 0, len: 16 },
            Span { offset: 8, len: 20 },
            Span { offset: u64::MAX, len: 20 },
        ] {
            assert!(layout.append(span, &data, &mut Vec::new()).is_err(), "{span:?}");
        }
    }

    #[test]
    fn members_that_do_not_fit_are_named() {
        let there = declared(&[("gain", "f32", 0), ("n", "u32", 4)]);
        for (members, expected) in [
            (given(&[("gain", MemberType::F32)]), "member `n` (u32) is not given"),
            (
                given(&[("gain", MemberType::F32), ("n", MemberType::Int), ("m", MemberType::F32)]),
                "member `m` is given, which the structure lacks; it has: gain, n",
            ),
            (
                given(&[("gain", MemberType::U32), ("n", MemberType::U32)]),
                "member `gain` is f32 in the shader, u32 given",
            ),
            (
                given(&[("gain", MemberType::F32), ("gain", MemberType::F32)]),
                "member `gain` is given twice",
            ),
        ] {
            assert_eq!(UniformLayout::new(0, &members, &there, 8).unwrap_err(), expected);
        }
    }
}
