//! Uniforms of the host's own shaders, member by member: each value carries the name that it has in WGSL, so
//! that tests can hold the order and the types against the shader.

use glam::{Mat4, Vec2, Vec3};
use surfelshop_api::Uniform;

/// The bytes of a uniform structure.
#[derive(Clone, Debug)]
pub(crate) struct HostUniform {
    uniform: Uniform,
    /// Name, WGSL type and offset of each member.
    #[cfg(test)]
    members: Vec<(&'static str, &'static str, usize)>,
    #[cfg(test)]
    end: usize,
}

impl HostUniform {
    /// An empty structure.
    pub(crate) fn new() -> Self {
        Self {
            uniform: Uniform::new(),
            #[cfg(test)]
            members: Vec::new(),
            #[cfg(test)]
            end: 0,
        }
    }

    #[cfg(not(test))]
    fn named(self, _: &'static str, _: &'static str, _: usize, _: usize) -> Self {
        self
    }

    #[cfg(test)]
    fn named(mut self, name: &'static str, kind: &'static str, align: usize, size: usize) -> Self {
        let offset = self.end.next_multiple_of(align);
        self.members.push((name, kind, offset));
        self.end = offset + size;
        self
    }

    fn with(mut self, append: impl FnOnce(Uniform) -> Uniform) -> Self {
        self.uniform = append(self.uniform);
        self
    }

    pub(crate) fn f32(self, name: &'static str, value: f32) -> Self {
        self.named(name, "f32", 4, 4).with(|uniform| uniform.f32(value))
    }

    pub(crate) fn u32(self, name: &'static str, value: u32) -> Self {
        self.named(name, "u32", 4, 4).with(|uniform| uniform.u32(value))
    }

    pub(crate) fn vec2(self, name: &'static str, value: Vec2) -> Self {
        self.named(name, "vec2<f32>", 8, 8).with(|uniform| uniform.vec2(value))
    }

    pub(crate) fn vec3(self, name: &'static str, value: Vec3) -> Self {
        self.named(name, "vec3<f32>", 16, 12).with(|uniform| uniform.vec3(value))
    }

    pub(crate) fn mat4(self, name: &'static str, value: Mat4) -> Self {
        self.named(name, "mat4x4<f32>", 16, 64).with(|uniform| uniform.mat4(value))
    }

    /// The bytes, padded to the structure's size.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.uniform.into_bytes()
    }

    /// Checks that the structure of a variable has these very members.
    #[cfg(test)]
    #[track_caller]
    pub(crate) fn assert_is_laid_out_as(self, source: &str, entry: &str, variable: &str) {
        use crate::shader_compiler::{BindingKind, Library, reflect};
        let composed = crate::shader_compiler::on_large_stack(|| {
            Library::new(true).unwrap().compose(source, &[], &[]).unwrap()
        })
        .unwrap();
        let stage = composed.module.entry_points.iter().find(|e| e.name == entry).unwrap().stage;
        let point = reflect(&composed, stage, entry).unwrap();
        let binding = point.bindings.iter().find(|binding| binding.name == variable).unwrap();
        let declared: Vec<(&str, &str, usize)> =
            binding.members.iter().map(|m| (m.name.as_str(), m.kind.as_str(), m.offset)).collect();
        assert_eq!(self.members, declared);
        let BindingKind::Uniform { size } = binding.kind else { panic!("{:?}", binding.kind) };
        assert_eq!(self.into_bytes().len() as u64, size);
    }
}
