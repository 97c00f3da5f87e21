//! Shading: the light of the virtual lights at each pixel, added up over frames, compensated and merged.

use crate::frame::Passes;
use crate::modules::{HEMISPHERE, MAPS, MATERIAL, RANDOM, VPL, with};
use crate::settings::{Near, Show};
use crate::shadow_maps::ShadowMaps;
use surfelshop_api::graph::TextureId;
use surfelshop_api::prelude::*;

/// The radius of a virtual light, in extents of the scene, is this over the root of how many there are.
/// Discs that cover a lit surface of 0.8 squared extents, as a box of which one corner is lit has, would
/// have 0.5. Larger ones flicker less where lights move near surfaces, and with compensation the picture
/// comes as near to the reference, while more of it is what the picture happens to show.
const RADIUS: f32 = 0.7;

/// A shadow's distance from its occluder, over the root of points in a map, extents: the radius of a
/// disc where so many cover a surface of three squared extents.
const THICKNESS: f32 = 1.0;
/// And at most so far.
const THICKEST: f32 = 0.05;

/// How far compensation looks, in radii: there a disc leaves out a seventeenth of a light, and less beyond.
const REACH: f32 = 4.0;

impl Passes<'_> {
    /// A picture of specular light; as good as none where nothing has highlights.
    fn specular_picture(&mut self, label: &str) -> TextureId {
        match self.shines() {
            true => self.picture(label),
            false => self.graph.texture(label, Texture::fixed(Format::Rgba32Float, 1, 1)),
        }
    }

    /// No light where there are surfaces.
    pub(crate) fn dark(&mut self) -> TextureId {
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

    /// Light of all virtual lights, diffuse and specular, the mean of all frames.
    pub(crate) fn shade(&mut self, maps: &ShadowMaps) -> [TextureId; 2] {
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
        let (diffuse, specular) =
            (self.picture("matte light"), self.specular_picture("shiny light"));
        let wgsl = include_str!("shade.wgsl");
        let groups = Groups::Fixed([groups[0], groups[1], 1]);
        let pass = Pass::compute("light of virtual lights", wgsl, "shade", groups);
        self.graph.pass(
            with(pass, &[MATERIAL, VPL, HEMISPHERE, MAPS])
                .merges(true)
                .bind("settings", settings)
                .bind("sizes", maps.sizes)
                .bind("body", self.material)
                .bind("diffuse_vpls", maps.diffuse_vpls)
                .bind("specular_vpls", maps.specular_vpls)
                .bind("maps_filled", maps.filled)
                .bind("diffuse_light", diffuse)
                .bind("specular_light", specular)
                .feature("gi::material::SHINES", self.shines()),
        );
        if self.frame.params.frames < 2 {
            return [diffuse, specular];
        }
        let specular = if self.shines() { self.accumulated("shiny", specular) } else { specular };
        [self.accumulated("matte", diffuse), specular]
    }

    /// The mean of a picture over all frames since something changed.
    fn accumulated(&mut self, what: &str, latest: TextureId) -> TextureId {
        let [width, height] = self.frame.view.size_px.map(u64::from);
        let sums = Buffer::new(width * height * 16).history();
        let sums = self.graph.buffer(&format!("sum of {what} light"), sums);
        let mean = self.picture(&format!("mean of {what} light"));
        let settings = self.graph.uniform(Uniform::new().u32(self.frame.frame_index));
        let wgsl = include_str!("accumulate.wgsl");
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
    pub(crate) fn merge(
        &mut self,
        direct: TextureId,
        diffuse: TextureId,
        specular: TextureId,
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
            with(pass, &[MATERIAL])
                .merges(true)
                .bind("settings", settings)
                .bind("body", self.material)
                .bind("direct_light", direct)
                .bind("diffuse_light", diffuse)
                .bind("specular_light", specular)
                .bind("missing", missing.unwrap_or(diffuse))
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
    pub(crate) fn compensate(
        &mut self,
        direct: TextureId,
        diffuse: TextureId,
    ) -> Option<TextureId> {
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
            with(pass, &[RANDOM, MATERIAL, VPL])
                .merges(true)
                .bind("settings", settings)
                .bind("body", self.material)
                .bind("direct_light", direct)
                .bind("diffuse_light", diffuse)
                .bind("missing", missing),
        );
        Some(if p.frames < 2 { missing } else { self.accumulated("missing", missing) })
    }

    /// Pictures of lights and maps.
    pub(crate) fn debug(&mut self, maps: &ShadowMaps) {
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
            let pass = with(pass, &[MATERIAL, VPL, HEMISPHERE, MAPS])
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
