use glam::{Mat4, Vec2, Vec3, Vec4};

/// The bytes of a WGSL uniform structure, member by member.
///
/// Members are written in the order the structure declares them; padding follows WGSL's rules, so
/// the author never counts bytes. The host compares the size with the shader's structure and
/// names both when they differ.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Uniform {
    bytes: Vec<u8>,
    align: usize,
}

impl Uniform {
    /// An empty structure.
    #[must_use]
    pub fn new() -> Self {
        Self { bytes: Vec::new(), align: 4 }
    }

    fn member(mut self, align: usize, bytes: &[u8]) -> Self {
        self.bytes.resize(self.bytes.len().next_multiple_of(align), 0);
        self.bytes.extend_from_slice(bytes);
        self.align = self.align.max(align);
        self
    }

    /// Appends an `f32`.
    #[must_use]
    pub fn f32(self, value: f32) -> Self {
        self.member(4, &value.to_le_bytes())
    }

    /// Appends a `u32`.
    #[must_use]
    pub fn u32(self, value: u32) -> Self {
        self.member(4, &value.to_le_bytes())
    }

    /// Appends an `i32`.
    #[must_use]
    pub fn i32(self, value: i32) -> Self {
        self.member(4, &value.to_le_bytes())
    }

    /// Appends a `vec2<f32>`.
    #[must_use]
    pub fn vec2(self, value: Vec2) -> Self {
        self.floats(8, &value.to_array())
    }

    /// Appends a `vec3<f32>`.
    #[must_use]
    pub fn vec3(self, value: Vec3) -> Self {
        self.floats(16, &value.to_array())
    }

    /// Appends a `vec3<u32>`.
    #[must_use]
    pub fn uvec3(self, value: [u32; 3]) -> Self {
        let bytes: Vec<u8> = value.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.member(16, &bytes)
    }

    /// Appends a `vec4<f32>`.
    #[must_use]
    pub fn vec4(self, value: Vec4) -> Self {
        self.floats(16, &value.to_array())
    }

    /// Appends a `mat4x4<f32>`.
    #[must_use]
    pub fn mat4(self, value: Mat4) -> Self {
        self.floats(16, &value.to_cols_array())
    }

    /// Appends an `array<vec4<f32>, N>`.
    #[must_use]
    pub fn vec4_array(self, values: &[Vec4]) -> Self {
        let floats: Vec<f32> = values.iter().flat_map(Vec4::to_array).collect();
        self.floats(16, &floats)
    }

    fn floats(self, align: usize, values: &[f32]) -> Self {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.member(align, &bytes)
    }

    /// The bytes, padded to the structure's size.
    #[must_use]
    pub fn into_bytes(mut self) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(self.align), 0);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_padded_as_wgsl_lays_them_out() {
        // struct { a: f32, b: vec3<f32>, c: f32, d: vec2<f32> }: offsets 0, 16, 28, 32, size 48.
        let bytes = Uniform::new().f32(1.0).vec3(Vec3::splat(2.0)).f32(3.0).vec2(Vec2::splat(4.0));
        let bytes = bytes.into_bytes();
        assert_eq!(bytes.len(), 48);
        let at = |offset: usize| f32::from_le_bytes(bytes[offset..offset + 4].try_into().unwrap());
        assert_eq!((at(0), at(16), at(28), at(32)), (1.0, 2.0, 3.0, 4.0));
    }
}
