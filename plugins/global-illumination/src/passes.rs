//! The passes of a frame, in the order in which they run.

use crate::lamps::{Lamps, extent_of, side_in_motion};
use crate::lights::Maps;
use crate::{Near, Settings, Show};
use surfelshop_api::graph::{BufferId, CameraId, TextureId, UniformId};
use surfelshop_api::prelude::*;

/// Bytes of what a texel of the light surface buffer has.
const TEXEL_BYTES: u64 = 32;

/// The radius of a virtual light, in extents of the scene, is this over the root of how many there are.
/// Discs that cover a lit surface of 0.8 squared extents, as a box of which one corner is lit has, would
/// have 0.5. Larger ones flicker less where lights move near surfaces, and with compensation the picture
/// comes as near to the reference, while more of it is what the picture happens to show.
const RADIUS: f32 = 0.7;

/// A shadow's distance from what throws it, over the root of points in a map, extents: the radius of a
/// disc where so many cover a surface of three squared extents.
const THICKNESS: f32 = 1.0;
/// And at most so far.
const THICKEST: f32 = 0.05;

/// How far compensation looks, in radii: there a disc leaves out a seventeenth of a light, and less beyond.
const REACH: f32 = 4.0;

/// A frame being described.
pub(crate) struct Passes<'a> {
    pub(crate) frame: &'a Frame<Settings>,
    pub(crate) graph: &'a mut Graph,
    pub(crate) lamps: Lamps,
    /// Scene units.
    pub(crate) extent: f64,
    /// Lights of a bounce, and bounces: 0 where only direct light counts.
    pub(crate) n_vpls: u32,
    pub(crate) n_bounces: u32,
    pub(crate) faces: UniformId,
    pub(crate) material: UniformId,
    /// How far the lamps see.
    pub(crate) depths: BufferId,
    /// The light surface buffer.
    pub(crate) texels: BufferId,
}

/// Brings along a module of the plugin's own.
macro_rules! with {
    ($pass:expr, $($name:literal),*) => {
        $pass$(.module(
            concat!("gi::", $name),
            concat!($name, ".wgsl"),
            include_str!(concat!($name, ".wgsl")),
        ))*
    };
}

pub(crate) use with;

impl<'a> Passes<'a> {
    pub(crate) fn new(frame: &'a Frame<Settings>, graph: &'a mut Graph) -> Self {
        let p = &frame.params;
        let lamps = Lamps::new(frame, side_in_motion(p.light_map, graph.stride()));
        let extent = extent_of(&frame.cloud);
        let is_lit = !lamps.faces.is_empty() && frame.cloud.n_surfels > 0;
        let bounces = is_lit && p.vpls > 0 && p.bounces > 0 && p.show != Show::Direct;
        let (n_vpls, n_bounces) = if bounces { (p.vpls, p.bounces) } else { (0, 0) };
        let faces = graph.uniform(lamps.uniform(frame.view.camera.eye, extent));
        let material = graph
            .uniform(Uniform::new().f32(p.diffuse).f32(p.specular).f32(p.shininess).f32(p.ior));
        let n_texels = |side: u32| u64::from(side).pow(2) * lamps.faces.len().max(1) as u64;
        let depths = graph.buffer("depths of lights", Buffer::new(n_texels(lamps.side) * 4));
        let n_lit = if n_bounces > 0 { n_texels(lamps.lit_side()) } else { 1 };
        let texels = graph.buffer("light surfaces", Buffer::new(n_lit * TEXEL_BYTES));
        Self { frame, graph, lamps, extent, n_vpls, n_bounces, faces, material, depths, texels }
    }

    pub(crate) fn shines(&self) -> bool {
        self.frame.params.specular > 0.0
    }

    pub(crate) fn per_extent(&self) -> f32 {
        (1.0 / self.extent) as f32
    }

    fn picture(&mut self, label: &str) -> TextureId {
        self.graph.texture(label, Texture::view_sized(Format::Rgba32Float))
    }

    /// A picture of what shines; as good as none where nothing does.
    fn shiny_picture(&mut self, label: &str) -> TextureId {
        match self.shines() {
            true => self.picture(label),
            false => self.graph.texture(label, Texture::fixed(Format::Rgba32Float, 1, 1)),
        }
    }

    /// Describes all passes.
    pub(crate) fn all(mut self) {
        let cameras = self.lamps.cameras(self.graph);
        self.see_from(&cameras);
        let direct = self.direct();
        let color = if self.n_bounces == 0 {
            match self.frame.params.show {
                Show::Indirect => self.dark(),
                Show::All | Show::Direct => direct,
            }
        } else {
            let maps = self.bounces();
            let [matte, shiny] = self.shade(&maps);
            self.debug(&maps);
            let missing = self.compensate(direct, matte);
            self.merge(direct, matte, shiny, missing)
        };
        self.graph.output(Output::Color, color);
        let frames = self.frame.params.frames;
        if self.n_bounces > 0 && self.frame.frame_index.saturating_add(1) < frames {
            self.graph.request_another_frame();
        }
    }

    /// What the lamps see: how far all texels do, and of one of each block the surface, for the first lights.
    fn see_from(&mut self, cameras: &[CameraId]) {
        for (i, camera) in cameras.iter().enumerate() {
            let which = self.graph.uniform(Uniform::new().u32(i as u32));
            let (side, lit_side) = (self.lamps.side, self.lamps.lit_side());
            let pass = self.seeing(&format!("light depths {}", i + 1), "measure", side);
            let depths = pass.seen_from(*camera).bind("which", which).bind("depths", self.depths);
            self.graph.pass(depths);
            if self.n_bounces > 0 {
                let pass = self.seeing(&format!("light surface {}", i + 1), "fill", lit_side);
                let texels =
                    pass.seen_from(*camera).bind("which", which).bind("texels", self.texels);
                self.graph.pass(texels);
            }
        }
    }

    /// A pass over so many texels on a side of what a lamp sees.
    fn seeing(&self, name: &str, entry: &str, side: u32) -> Pass {
        let groups = Groups::Fixed([side / 8, side / 8, 1]);
        let pass = Pass::compute(name, include_str!("light_surface.wgsl"), entry, groups);
        with!(pass, "lamps").merges(true).bind("faces", self.faces)
    }

    fn direct(&mut self) -> TextureId {
        let direct = self.picture("direct light");
        let pass = Pass::shading("direct light", include_str!("direct.wgsl"), "shade");
        self.graph.pass(
            with!(pass, "lamps", "material")
                .merges(true)
                .bind("faces", self.faces)
                .bind("body", self.material)
                .bind("depths", self.depths)
                .feature("gi::material::SHINES", self.shines())
                .target(direct),
        );
        direct
    }

    /// No light where there are surfaces.
    fn dark(&mut self) -> TextureId {
        let dark = self.picture("no light");
        let wgsl = "#import surfelshop::surface::Surface\n\
                    fn dark(s: Surface) -> vec4<f32> { return vec4(0.0, 0.0, 0.0, 1.0); }\n";
        self.graph.pass(Pass::shading("no light", wgsl, "dark").merges(true).target(dark));
        dark
    }

    /// The largest of the scene's clouds, in extents of the scene: lights are as far apart as what they lie
    /// on is large, however far clouds are from each other.
    fn object_size(&self) -> f32 {
        let sizes = self.frame.cloud.objects.iter().map(|object| object.size / self.extent);
        let largest = sizes.fold(0.0, f64::max);
        // Of one cloud the extent is its size rounded to a power of two.
        if largest > 0.0 && self.frame.cloud.objects.len() > 1 {
            largest.min(1.0) as f32
        } else {
            1.0
        }
    }

    /// Square of the radius of a virtual light, squared extents.
    fn radius_squared(&self) -> f32 {
        let radius = self.frame.params.softening * RADIUS * self.object_size();
        radius * radius / self.n_vpls.max(1) as f32
    }

    fn bounded(&self) -> u32 {
        u32::from(self.frame.params.near == Near::Bounded)
    }

    /// Light of all virtual lights, matte and shiny, the mean of all frames.
    fn shade(&mut self, maps: &Maps) -> [TextureId; 2] {
        let p = &self.frame.params;
        let per_map = f64::from(maps.n_points) / f64::from(self.n_vpls);
        let thickness = (THICKNESS / (per_map as f32).sqrt()).min(THICKEST) * self.object_size();
        let n = p.interleaving;
        let settings = Uniform::new()
            .u32(self.n_vpls)
            .u32(self.n_bounces)
            .u32(n)
            .u32(self.frame.frame_index % (n * n))
            .f32(self.radius_squared())
            .u32(self.bounded())
            .f32(thickness);
        let settings = self.graph.uniform(settings);
        let groups = self.frame.view.size_px.map(|side| (side.div_ceil(n) * n).div_ceil(8));
        let (matte, shiny) = (self.picture("matte light"), self.shiny_picture("shiny light"));
        let wgsl = include_str!("shade.wgsl");
        let groups = Groups::Fixed([groups[0], groups[1], 1]);
        let pass = Pass::compute("light of virtual lights", wgsl, "shade", groups);
        self.graph.pass(
            with!(pass, "material", "vpl", "hemisphere", "maps")
                .merges(true)
                .bind("settings", settings)
                .bind("sizes", maps.sizes)
                .bind("body", self.material)
                .bind("senders", maps.senders)
                .bind("shines", maps.shines)
                .bind("maps_filled", maps.filled)
                .bind("matte", matte)
                .bind("shiny", shiny)
                .feature("gi::material::SHINES", self.shines()),
        );
        if self.frame.params.frames < 2 {
            return [matte, shiny];
        }
        let shiny = if self.shines() { self.gathered("shiny", shiny) } else { shiny };
        [self.gathered("matte", matte), shiny]
    }

    /// The mean of a picture over all frames since something changed.
    fn gathered(&mut self, what: &str, latest: TextureId) -> TextureId {
        let [width, height] = self.frame.view.size_px.map(u64::from);
        let sums = Buffer::new(width * height * 16).history();
        let sums = self.graph.buffer(&format!("sum of {what} light"), sums);
        let mean = self.picture(&format!("mean of {what} light"));
        let settings = self.graph.uniform(Uniform::new().u32(self.frame.frame_index));
        let wgsl = include_str!("gather.wgsl");
        let groups = Groups::PerPixel { divisor: 1 };
        self.graph.pass(
            Pass::compute(&format!("add up {what} light"), wgsl, "gather", groups)
                .bind("settings", settings)
                .bind("latest", latest)
                .bind("sums", sums)
                .bind("mean", mean),
        );
        mean
    }

    /// The picture: what is reflected of direct light and of the virtual lights'.
    fn merge(
        &mut self,
        direct: TextureId,
        matte: TextureId,
        shiny: TextureId,
        missing: Option<TextureId>,
    ) -> TextureId {
        let p = &self.frame.params;
        let n = p.interleaving;
        let is_direct = u32::from(p.show == Show::All);
        let settings = Uniform::new().u32(n).u32(p.smoothing).u32(is_direct);
        let settings = self.graph.uniform(settings);
        let color = self.picture("color");
        let pass = Pass::shading("merge pixels", include_str!("merge.wgsl"), "reflect_light");
        self.graph.pass(
            with!(pass, "material")
                .merges(true)
                .bind("settings", settings)
                .bind("body", self.material)
                .bind("direct_light", direct)
                .bind("matte", matte)
                .bind("shiny", shiny)
                .bind("missing", missing.unwrap_or(matte))
                .feature("COMPENSATES", missing.is_some())
                .feature("gi::material::SHINES", self.shines())
                .target(color),
        );
        color
    }

    /// Share of the light of all bounces that is of those before the last, as if each had half the light
    /// of the one before: what the last bounce lights sends nothing on.
    fn reflected_again(&self) -> f32 {
        let left = 0.5f32.powi(self.n_bounces.try_into().unwrap_or(i32::MAX));
        (1.0 - 2.0 * left) / (1.0 - left)
    }

    /// What virtual lights leave out near surfaces, where it is made up for.
    fn compensate(&mut self, direct: TextureId, matte: TextureId) -> Option<TextureId> {
        let p = &self.frame.params;
        if p.compensation == 0 || p.softening <= 0.0 {
            return None;
        }
        let settings = Uniform::new()
            .u32(p.compensation)
            .u32(self.frame.frame_index)
            .f32(self.radius_squared())
            .u32(self.bounded())
            .f32(self.per_extent())
            .f32(REACH)
            .f32(self.reflected_again());
        let settings = self.graph.uniform(settings);
        let missing = self.picture("missing light");
        let wgsl = include_str!("compensate.wgsl");
        let groups = Groups::PerPixel { divisor: 1 };
        let pass = Pass::compute("compensate", wgsl, "compensate", groups);
        self.graph.pass(
            with!(pass, "chance", "material", "vpl")
                .merges(true)
                .bind("settings", settings)
                .bind("body", self.material)
                .bind("direct_light", direct)
                .bind("matte", matte)
                .bind("missing", missing),
        );
        Some(if p.frames < 2 { missing } else { self.gathered("missing", missing) })
    }

    /// Pictures of lights and maps.
    fn debug(&mut self, maps: &Maps) {
        let columns = (self.frame.view.size_px[0] / maps.side).max(1);
        let settings = self.graph.uniform(Uniform::new().u32(self.n_vpls).u32(columns));
        for (output, entry, depths) in [
            ("vpls", "show_vpls", None),
            ("ism", "show_maps", Some(maps.filled)),
            ("ism-points", "show_maps", Some(maps.first)),
        ] {
            let picture = self.picture(output);
            // By compute, since OpenGL may not draw into such a picture.
            let (name, groups) = (format!("show {output}"), Groups::PerPixel { divisor: 1 });
            let pass = Pass::compute(&name, include_str!("show.wgsl"), entry, groups);
            let pass = with!(pass, "material", "vpl", "hemisphere", "maps")
                .bind("settings", settings)
                .bind("sizes", maps.sizes);
            let pass = match depths {
                Some(depths) => pass.bind("depths", depths),
                None => pass.bind("vpls", maps.own),
            };
            self.graph.pass(pass.bind("picture", picture));
            self.graph.output(Output::Debug(output.to_owned()), picture);
        }
    }
}
