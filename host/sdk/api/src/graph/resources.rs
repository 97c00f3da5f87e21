//! Textures, buffers, samplers and uniforms of a graph.

use crate::graph::columns::ColumnsOf;
use serde::{Deserialize, Serialize};

/// A texture of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TextureId(pub(crate) u32);

/// A buffer of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct BufferId(pub(crate) u32);

/// A camera of the graph, besides the view's own. ABI 3.5.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CameraId(pub(crate) u32);

/// Bytes given with the frame, bound as a uniform.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct UniformId(pub(crate) u32);

impl TextureId {
    /// Position in [`Structure::textures`](super::Structure::textures).
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl BufferId {
    /// Position in [`Structure::buffers`](super::Structure::buffers).
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl CameraId {
    /// Position in [`Structure::cameras`](super::Structure::cameras).
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl UniformId {
    /// Position in [`Structure::uniforms`](super::Structure::uniforms).
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Texel formats a graph may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Four 8-bit values in [0, 1].
    Rgba8Unorm,
    /// Four 16-bit floats; largest finite value 65,504.
    Rgba16Float,
    /// One 32-bit float.
    R32Float,
    /// Two 32-bit floats.
    Rg32Float,
    /// Four 32-bit floats.
    Rgba32Float,
    /// One 32-bit unsigned integer.
    R32Uint,
    /// Four 32-bit unsigned integers.
    Rgba32Uint,
    /// 32-bit float depth, reverse-Z: 1 near, 0 far.
    Depth32Float,
}

impl Format {
    /// Bytes of one texel.
    #[must_use]
    pub const fn bytes_per_texel(self) -> u32 {
        match self {
            Self::Rgba8Unorm | Self::R32Float | Self::R32Uint | Self::Depth32Float => 4,
            Self::Rgba16Float | Self::Rg32Float => 8,
            Self::Rgba32Float | Self::Rgba32Uint => 16,
        }
    }
}

/// How large a texture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Extent {
    /// The view's size divided by this number, rounded up; 1 is full size.
    View {
        /// The divisor, at least 1.
        divisor: u32,
    },
    /// A fixed number of texels in each direction, each at least 1.
    Fixed([u32; 3]),
}

/// Whether a resource lives for a frame or for longer.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Lifetime {
    /// Contents are undefined before the first pass that writes it in this frame.
    Frame,
    /// Contents stay while the key is the same: passes that write only such resources run when
    /// the key is new and not again. The key names everything the contents depend on.
    Persistent {
        /// What the contents depend on.
        key: String,
        /// Whether they are also kept on disk for the next start: for what takes long to make and
        /// is the same whenever its key is. Textures only.
        #[serde(default)]
        stored: bool,
    },
    /// What the passes of one frame leave is there in the next frame of the same view: what is added
    /// up while nothing changes. Zeros at first, when the size changes, and after the view was not
    /// drawn for a while: whoever adds up counts what was added there, too, and begins anew where
    /// [`Frame::frame_index`](crate::Frame::frame_index) is 0. Buffers only. ABI 3.5.
    History,
}

/// A texture declared by a graph.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Texture {
    /// Name in messages and lists.
    #[serde(default)]
    pub label: String,
    /// Texel format.
    pub format: Format,
    /// Size in texels.
    pub extent: Extent,
    /// Whether the third extent counts slices of a volume rather than layers of an array.
    #[serde(default)]
    pub volume: bool,
    /// Number of mip levels, at least 1.
    #[serde(default = "one")]
    pub mips: u32,
    /// Whether the contents outlive the frame.
    pub lifetime: Lifetime,
}

const fn one() -> u32 {
    1
}

impl Texture {
    /// A texture of the view's size that lives for the frame.
    #[must_use]
    pub fn view_sized(format: Format) -> Self {
        Self {
            label: String::new(),
            format,
            extent: Extent::View { divisor: 1 },
            volume: false,
            mips: 1,
            lifetime: Lifetime::Frame,
        }
    }

    /// A texture of fixed size that lives for the frame.
    #[must_use]
    pub fn fixed(format: Format, width: u32, height: u32) -> Self {
        Self { extent: Extent::Fixed([width, height, 1]), ..Self::view_sized(format) }
    }

    /// Makes it a volume or an array of this many slices.
    #[must_use]
    pub fn depth(mut self, slices: u32, volume: bool) -> Self {
        if let Extent::Fixed(size) = &mut self.extent {
            size[2] = slices;
        }
        self.volume = volume;
        self
    }

    /// Gives it mip levels.
    #[must_use]
    pub fn mips(mut self, mips: u32) -> Self {
        self.mips = mips;
        self
    }

    /// Keeps the contents for as long as the key stays the same.
    #[must_use]
    pub fn persistent(mut self, key: impl Into<String>) -> Self {
        self.lifetime = Lifetime::Persistent { key: key.into(), stored: false };
        self
    }

    /// Keeps persistent contents on disk, too, for the next start.
    #[must_use]
    pub fn stored(mut self) -> Self {
        if let Lifetime::Persistent { stored, .. } = &mut self.lifetime {
            *stored = true;
        }
        self
    }
}

/// A storage buffer declared by a graph.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Buffer {
    /// Name in messages and lists.
    #[serde(default)]
    pub label: String,
    /// Size in bytes, at least 4; rounded up to a multiple of 4.
    pub size: u64,
    /// Whether the contents outlive the frame.
    pub lifetime: Lifetime,
    /// Range of the frame's data that fills the buffer before the first pass.
    #[serde(default)]
    pub upload: Option<Span>,
    /// Whether the host fills it with the scene's surfels, and with how many at most; see
    /// [`Graph::surfels`](crate::Graph::surfels). ABI 3.5.
    #[serde(default)]
    pub surfels: Option<u32>,
    /// Whether the host fills it with columns of clouds, and with which; see [`Graph::columns`](crate::Graph::columns).
    /// ABI 3.9.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<ColumnsOf>,
    /// What names the bytes that it was filled with once and that stay on the device; see
    /// [`Graph::resident`](crate::Graph::resident). ABI 3.10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resident: Option<String>,
}

impl Buffer {
    /// A buffer of this many bytes that lives for the frame, zero at its start.
    #[must_use]
    pub fn new(size: u64) -> Self {
        let (label, lifetime) = (String::new(), Lifetime::Frame);
        let (upload, surfels, columns, resident) = (None, None, None, None);
        Self { label, size, lifetime, upload, surfels, columns, resident }
    }

    /// Keeps what a frame leaves in it for the next frame of the same view. ABI 3.5.
    #[must_use]
    pub fn history(mut self) -> Self {
        self.lifetime = Lifetime::History;
        self
    }

    /// Keeps the contents for as long as the key stays the same.
    #[must_use]
    pub fn persistent(mut self, key: impl Into<String>) -> Self {
        self.lifetime = Lifetime::Persistent { key: key.into(), stored: false };
        self
    }
}

/// A range of the bytes that travel beside the structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Span {
    /// First byte.
    pub offset: u64,
    /// Number of bytes.
    pub len: u64,
}

/// How a texture is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SamplerKind {
    /// Nearest texel, clamped to the edge.
    Nearest,
    /// Linear between texels and mips, clamped to the edge.
    Linear,
    /// Linear between texels and mips, repeating.
    LinearRepeat,
}

/// What a WGSL variable is bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Resource {
    /// Bytes of this frame.
    Uniform(UniformId),
    /// A texture: all of it, or one mip level of it.
    Texture {
        /// The texture.
        id: TextureId,
        /// The only mip level visible; all where `None`.
        mip: Option<u32>,
    },
    /// A storage buffer.
    Buffer(BufferId),
    /// A sampler.
    Sampler(SamplerKind),
}

impl From<UniformId> for Resource {
    fn from(id: UniformId) -> Self {
        Self::Uniform(id)
    }
}

impl From<TextureId> for Resource {
    fn from(id: TextureId) -> Self {
        Self::Texture { id, mip: None }
    }
}

impl From<BufferId> for Resource {
    fn from(id: BufferId) -> Self {
        Self::Buffer(id)
    }
}

impl From<SamplerKind> for Resource {
    fn from(kind: SamplerKind) -> Self {
        Self::Sampler(kind)
    }
}
