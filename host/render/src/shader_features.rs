//! What only some devices' shaders can do, and passes that need it use.

use naga::valid::Capabilities;

/// Something that shaders use where a device has it and a pass says that it needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShaderFeature {
    /// What plugins call it.
    pub(crate) word: &'static str,
    /// The name that is set while a shader of such a pass is composed.
    pub(crate) define: &'static str,
    /// The word of WGSL's `enable` that may stand in its text.
    pub(crate) enable: Option<&'static str>,
    /// What the device must have.
    wanted: wgpu::Features,
    /// What naga allows then.
    pub(crate) capabilities: Capabilities,
}

impl ShaderFeature {
    /// All of them.
    pub(crate) const ALL: [Self; 6] = [
        Self {
            word: "subgroups",
            define: "NEEDS_SUBGROUPS",
            enable: Some("subgroups"),
            wanted: wgpu::Features::SUBGROUP,
            capabilities: Capabilities::SUBGROUP,
        },
        Self {
            word: "f16",
            define: "NEEDS_F16",
            enable: Some("f16"),
            wanted: wgpu::Features::SHADER_F16,
            capabilities: Capabilities::SHADER_FLOAT16,
        },
        Self {
            word: "64-bit-integers",
            define: "NEEDS_INT64",
            enable: None,
            wanted: wgpu::Features::SHADER_INT64,
            capabilities: Capabilities::SHADER_INT64,
        },
        Self {
            word: "64-bit-atomic-max",
            define: "NEEDS_ATOMIC64_MAX",
            enable: None,
            wanted: wgpu::Features::SHADER_INT64.union(wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX),
            capabilities: Capabilities::SHADER_INT64
                .union(Capabilities::SHADER_INT64_ATOMIC_MIN_MAX),
        },
        Self {
            word: "64-bit-atomics",
            define: "NEEDS_ATOMIC64",
            enable: None,
            wanted: wgpu::Features::SHADER_INT64.union(wgpu::Features::SHADER_INT64_ATOMIC_ALL_OPS),
            capabilities: Capabilities::SHADER_INT64
                .union(Capabilities::SHADER_INT64_ATOMIC_MIN_MAX)
                .union(Capabilities::SHADER_INT64_ATOMIC_ALL_OPS),
        },
        Self {
            word: "float32-atomics",
            define: "NEEDS_FLOAT32_ATOMICS",
            enable: None,
            wanted: wgpu::Features::SHADER_FLOAT32_ATOMIC,
            capabilities: Capabilities::SHADER_FLOAT32_ATOMIC,
        },
    ];

    /// The one that plugins call so.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|feature| feature.word == word)
    }

    /// Those whose names are set.
    pub(crate) fn set_in<'a>(defines: &'a [&str]) -> impl Iterator<Item = Self> + 'a {
        Self::ALL.into_iter().filter(|feature| defines.contains(&feature.define))
    }

    /// What a device is asked for that has all of them.
    pub(crate) fn wanted() -> wgpu::Features {
        let each = Self::ALL.iter().map(|feature| feature.wanted);
        each.fold(wgpu::Features::empty(), wgpu::Features::union)
    }

    /// Whether a device with these features has it.
    pub(crate) fn is_of(&self, features: wgpu::Features) -> bool {
        features.contains(self.wanted)
    }
}
