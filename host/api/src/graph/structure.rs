use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A texture of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TextureId(pub(crate) u32);

/// A buffer of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct BufferId(pub(crate) u32);

/// Bytes given with the frame, bound as a uniform.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct UniformId(pub(crate) u32);

impl TextureId {
    /// Position in [`Structure::textures`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl BufferId {
    /// Position in [`Structure::buffers`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl UniformId {
    /// Position in [`Structure::uniforms`].
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
}

impl Buffer {
    /// A buffer of this many bytes that lives for the frame, zero at its start.
    #[must_use]
    pub fn new(size: u64) -> Self {
        Self { label: String::new(), size, lifetime: Lifetime::Frame, upload: None }
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

/// Which surfels make up a pixel of the host's surface buffer.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceMode {
    /// The nearest surfel alone.
    Nearest,
    /// All surfels within the scene's depth tolerance, weighted.
    #[default]
    Blended,
}

/// A texture drawn into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Target {
    /// The texture.
    pub texture: TextureId,
    /// Mip level drawn into.
    pub mip: u32,
    /// Layer or slice drawn into.
    pub layer: u32,
}

impl From<TextureId> for Target {
    fn from(texture: TextureId) -> Self {
        Self { texture, mip: 0, layer: 0 }
    }
}

/// How many workgroups a compute pass runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Groups {
    /// A fixed number in each direction.
    Fixed([u32; 3]),
    /// Enough to give each pixel of the view (divided by the divisor) one invocation.
    PerPixel {
        /// Divisor of the view's size, at least 1.
        divisor: u32,
    },
}

/// What a pass does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Work {
    /// Calls a WGSL function `fn(Surface) -> vec4<f32>` for each covered pixel of the host's
    /// surface buffer; other pixels become zero unless `elsewhere` is given.
    Shading {
        /// Which surfels make up a pixel.
        surface: SurfaceMode,
        /// The texture written, of the view's size.
        target: TextureId,
        /// A WGSL function `fn(pixel: vec2<u32>) -> vec4<f32>` for the other pixels.
        #[serde(default)]
        elsewhere: Option<String>,
        /// Whether the function is called for each surfel instead, and the results are blended.
        #[serde(default)]
        per_surfel: bool,
    },
    /// Runs a fragment entry point over the targets.
    Fullscreen {
        /// Which surface the pass reads, if it imports `surfelshop::surface`.
        surface: SurfaceMode,
        /// The textures written, in the order of the entry point's outputs.
        targets: Vec<Target>,
    },
    /// Runs a compute entry point.
    Compute {
        /// Which surface the pass reads, if it imports `surfelshop::surface`.
        surface: SurfaceMode,
        /// How many workgroups run.
        groups: Groups,
    },
}

/// A pass of the graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Name in messages, lists and timings.
    pub name: String,
    /// What the pass does.
    pub work: Work,
    /// WGSL source; resources need no `@group` and `@binding`.
    pub wgsl: String,
    /// The entry point, or the shading function.
    pub entry: String,
    /// Values of WGSL `override` constants by name.
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
    /// What the WGSL variables are bound to, by name.
    #[serde(default)]
    pub bindings: BTreeMap<String, Resource>,
}

impl Pass {
    fn new(name: &str, wgsl: &str, entry: &str, work: Work) -> Self {
        Self {
            name: name.to_owned(),
            work,
            wgsl: wgsl.to_owned(),
            entry: entry.to_owned(),
            constants: BTreeMap::new(),
            bindings: BTreeMap::new(),
        }
    }

    /// A pass that calls `function` for each covered pixel; add a [`target`](Self::target).
    #[must_use]
    pub fn shading(name: &str, wgsl: &str, function: &str) -> Self {
        let target = TextureId(u32::MAX);
        let surface = SurfaceMode::Blended;
        Self::new(
            name,
            wgsl,
            function,
            Work::Shading { surface, target, elsewhere: None, per_surfel: false },
        )
    }

    /// A pass that runs a fragment entry point; add [`target`](Self::target)s.
    #[must_use]
    pub fn fullscreen(name: &str, wgsl: &str, entry: &str) -> Self {
        let work = Work::Fullscreen { surface: SurfaceMode::Blended, targets: Vec::new() };
        Self::new(name, wgsl, entry, work)
    }

    /// A pass that runs a compute entry point.
    #[must_use]
    pub fn compute(name: &str, wgsl: &str, entry: &str, groups: Groups) -> Self {
        let work = Work::Compute { surface: SurfaceMode::Blended, groups };
        Self::new(name, wgsl, entry, work)
    }

    /// Draws into this texture; a fullscreen pass may have several, in order.
    #[must_use]
    pub fn target(mut self, to: impl Into<Target>) -> Self {
        let to = to.into();
        match &mut self.work {
            Work::Shading { target, .. } => *target = to.texture,
            Work::Fullscreen { targets, .. } => targets.push(to),
            Work::Compute { .. } => {}
        }
        self
    }

    /// Calls this WGSL function, `fn(pixel: vec2<u32>) -> vec4<f32>`, where a shading pass finds no
    /// surface: a background.
    #[must_use]
    pub fn elsewhere(mut self, function: &str) -> Self {
        if let Work::Shading { elsewhere, .. } = &mut self.work {
            *elsewhere = Some(function.to_owned());
        }
        self
    }

    /// Calls the function of a shading pass for each surfel, with its own centre, normal and albedo,
    /// and blends what it returns: lighting as older hardware had it. `Surface::pixel` is then 0.
    /// Devices that cannot blend 32-bit floats clamp the radiance at 1.9.
    #[must_use]
    pub fn per_surfel(mut self, yes: bool) -> Self {
        if let Work::Shading { per_surfel, .. } = &mut self.work {
            *per_surfel = yes;
        }
        self
    }

    /// Reads this kind of surface buffer.
    #[must_use]
    pub fn surface(mut self, mode: SurfaceMode) -> Self {
        match &mut self.work {
            Work::Shading { surface, .. }
            | Work::Fullscreen { surface, .. }
            | Work::Compute { surface, .. } => *surface = mode,
        }
        self
    }

    /// Binds a WGSL variable by name.
    #[must_use]
    pub fn bind(mut self, variable: &str, resource: impl Into<Resource>) -> Self {
        self.bindings.insert(variable.to_owned(), resource.into());
        self
    }

    /// Sets a WGSL `override` constant by name.
    #[must_use]
    pub fn constant(mut self, name: &str, value: f64) -> Self {
        self.constants.insert(name.to_owned(), value);
        self
    }
}

/// A picture a renderer offers.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Output {
    /// Linear Rec. 709 radiance and coverage in alpha, before exposure and tone mapping.
    Color,
    /// Distance along the viewing axis, scene units, in the first component; 0 where empty.
    Depth,
    /// Unit normal in world space; zero where empty.
    Normal,
    /// Linear Rec. 709 albedo.
    Albedo,
    /// Ambient accessibility in the first component.
    Ao,
    /// Something to look at while developing.
    Debug(String),
}

impl Output {
    /// The name on the command line and in files: `color`, `depth`, `debug.NAME`.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Color => "color".to_owned(),
            Self::Depth => "depth".to_owned(),
            Self::Normal => "normal".to_owned(),
            Self::Albedo => "albedo".to_owned(),
            Self::Ao => "ao".to_owned(),
            Self::Debug(name) => format!("debug.{name}"),
        }
    }

    /// The output of a name as in [`Output::name`]; `None` where there is none, and for `debug.`
    /// without a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "color" => Self::Color,
            "depth" => Self::Depth,
            "normal" => Self::Normal,
            "albedo" => Self::Albedo,
            "ao" => Self::Ao,
            _ => {
                let name = name.strip_prefix("debug.").filter(|name| !name.is_empty())?;
                Self::Debug(name.to_owned())
            }
        })
    }
}

/// Everything about a frame but the bytes of its uniforms and uploads.
///
/// Two frames with equal structure differ only in those bytes, so the host recompiles and
/// replans nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Structure {
    /// Textures, by [`TextureId`].
    pub textures: Vec<Texture>,
    /// Buffers, by [`BufferId`].
    pub buffers: Vec<Buffer>,
    /// Where each uniform's bytes lie, by [`UniformId`].
    pub uniforms: Vec<Span>,
    /// Passes in the order they run.
    pub passes: Vec<Pass>,
    /// What the renderer offers; the host adds depth, normal, albedo and ao of the surface.
    pub outputs: Vec<(Output, TextureId)>,
    /// Whether another frame would refine the picture.
    pub wants_another_frame: bool,
}
