//! Passes of a graph: what they do, with which resources.

use crate::graph::primitives::{Scan, Sort};
use crate::graph::resources::{BufferId, CameraId, Resource, TextureId};
use crate::graph::splats::Splats;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// The same with normals that vary over each surfel, where a cloud has the column
    /// [`NORMAL_FIELD`](crate::columns::NORMAL_FIELD): each pixel blends the normals of the points that it
    /// shows. Other clouds look as with `Blended`. ABI 3.4.
    Fields,
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
    /// Enough for as many invocations as a `u32` of a buffer says when the pass runs, and never for more than
    /// `at_most`: what is larger counts as `at_most`. The groups lie in rows where they are more than 65,535;
    /// `invocation_of` of the WGSL module `surfelshop::numbers` counts their invocations, and those beyond the number
    /// must return. ABI 3.10.
    Counted {
        /// The buffer.
        buffer: BufferId,
        /// Bytes before the number, a multiple of 4.
        offset: u64,
        /// Most invocations, at least 1.
        at_most: u32,
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
    /// Calls a WGSL function `fn(u32) -> Splat` for each of many splats and puts them together. ABI 3.9.
    Splats(Splats),
    /// Sorts pairs of numbers. ABI 3.10.
    Sort(Sort),
    /// Puts the sum of those before it in the place of each number. ABI 3.10.
    Scan(Scan),
}

/// A WGSL module that a pass brings along, for its shader and later modules to import.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Module {
    /// The path it is imported by, such as `marble::veins`; not below `surfelshop`.
    pub path: String,
    /// What messages call its text, such as the name of its file.
    pub file: String,
    /// Its text. Resources are bound to a pass under `path::variable`.
    pub wgsl: String,
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
    /// Modules that it imports besides those of the host, in the order in which they import each
    /// other.
    #[serde(default)]
    pub modules: Vec<Module>,
    /// The entry point, or the shading function.
    pub entry: String,
    /// Values of WGSL `override` constants by name.
    #[serde(default)]
    pub constants: BTreeMap<String, f64>,
    /// What the WGSL variables are bound to, by name.
    #[serde(default)]
    pub bindings: BTreeMap<String, Resource>,
    /// Whether several surfels may be drawn as one where they are small on the screen.
    #[serde(default)]
    pub merges: bool,
    /// Boolean WGSL `override` constants by name, and whether what each guards is there. ABI 3.3.
    #[serde(default)]
    pub features: BTreeMap<String, bool>,
    /// The camera that it looks from, where that is not the view's own. ABI 3.5.
    #[serde(default)]
    pub camera: Option<CameraId>,
    /// Features of the device that it cannot do without, as [`HostInfo::features`](crate::HostInfo::features) names
    /// them. ABI 3.10.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<String>,
    /// The pass that runs where the device lacks one of these. ABI 3.10.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instead: Option<Box<Self>>,
}

impl Pass {
    pub(super) fn new(name: &str, wgsl: &str, entry: &str, work: Work) -> Self {
        Self {
            name: name.to_owned(),
            work,
            wgsl: wgsl.to_owned(),
            modules: Vec::new(),
            entry: entry.to_owned(),
            constants: BTreeMap::new(),
            bindings: BTreeMap::new(),
            merges: false,
            features: BTreeMap::new(),
            camera: None,
            needs: Vec::new(),
            instead: None,
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

    /// Draws into this texture; a fullscreen pass and one of splats may have several, in order.
    #[must_use]
    pub fn target(mut self, to: impl Into<Target>) -> Self {
        let to = to.into();
        match &mut self.work {
            Work::Shading { target, .. } => *target = to.texture,
            Work::Fullscreen { targets, .. } => targets.push(to),
            Work::Splats(splats) => splats.add(to),
            Work::Compute { .. } | Work::Sort(_) | Work::Scan(_) => {}
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

    /// Takes merged surfels: where several are small on the screen, one may stand for them, with the
    /// mean of their positions, normals, albedos and accessibilities, weighted by area. Surfels of
    /// different materials are never merged, nor are ellipses. It happens where the user asks for less
    /// detail, if all passes of the graph that look at the surface take it. Previews while a view moves
    /// merge what the CPU draws, whatever is said here.
    #[must_use]
    pub fn merges(mut self, yes: bool) -> Self {
        self.merges = yes;
        self
    }

    /// Looks from another camera than the view's own: `surfelshop::view`, `surfelshop::surface` and the
    /// places of `surfelshop::light` are as seen from there, a shading pass draws into a texture of that
    /// camera's size, and [`Groups::PerPixel`] counts its pixels. What a light sees is its shadow map.
    /// ABI 3.5.
    #[must_use]
    pub fn seen_from(mut self, camera: CameraId) -> Self {
        self.camera = Some(camera);
        self
    }

    /// Says that the pass cannot do without a feature of the device, one of
    /// [`HostInfo::features`](crate::HostInfo::features): its shader may then use `subgroups`, `f16` and what else
    /// only some devices have. Where one is missing, the pass [`instead`](Self::instead) of it runs, or the graph is
    /// refused in a line that names pass, feature and device. ABI 3.10.
    #[must_use]
    pub fn needs(mut self, feature: &str) -> Self {
        self.needs.push(feature.to_owned());
        self
    }

    /// The pass that runs in place of this one where the device lacks what it [`needs`](Self::needs). It may need
    /// something itself, and have another instead; 16 at most, one behind the other. ABI 3.10.
    #[must_use]
    pub fn instead(mut self, pass: Self) -> Self {
        let pass = match self.instead.take() {
            Some(before) => before.instead(pass),
            None => pass,
        };
        self.instead = Some(Box::new(pass));
        self
    }

    /// Reads this kind of surface buffer.
    #[must_use]
    pub fn surface(mut self, mode: SurfaceMode) -> Self {
        match &mut self.work {
            Work::Shading { surface, .. }
            | Work::Fullscreen { surface, .. }
            | Work::Compute { surface, .. } => *surface = mode,
            Work::Splats(splats) => splats.surface = mode,
            Work::Sort(_) | Work::Scan(_) => {}
        }
        self
    }

    /// Binds a WGSL variable by name.
    #[must_use]
    pub fn bind(mut self, variable: &str, resource: impl Into<Resource>) -> Self {
        self.bindings.insert(variable.to_owned(), resource.into());
        self
    }

    /// Brings a module along, which the shader and modules added later may import as `path`;
    /// `file` is what messages call it.
    #[must_use]
    pub fn module(mut self, path: &str, file: &str, wgsl: &str) -> Self {
        let [path, file, wgsl] = [path, file, wgsl].map(str::to_owned);
        self.modules.push(Module { path, file, wgsl });
        self
    }

    /// Sets a WGSL `override` constant by name.
    #[must_use]
    pub fn constant(mut self, name: &str, value: f64) -> Self {
        self.constants.insert(name.to_owned(), value);
        self
    }

    /// Says whether something is there that the shader guards with `if NAME { ... }`, where NAME is an
    /// `override` of type `bool`. What is not there is left out of the shader, and columns that only it
    /// reads are left out of the frame.
    ///
    /// Where it is not there, the guarded lines must change nothing: while a shader without them is being
    /// compiled, the host may draw with one that has them, under the same bindings. What does change the
    /// picture is a [`constant`](Self::constant). ABI 3.3.
    #[must_use]
    pub fn feature(mut self, name: &str, is_there: bool) -> Self {
        self.features.insert(name.to_owned(), is_there);
        self
    }
}
