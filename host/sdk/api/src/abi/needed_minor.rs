//! Which minor version of the ABI a graph needs: packages that say that older hosts will do hold their graphs against it,
//! so that what such a host would pass over is refused where its author sees it.
//!
//! Everything of a graph is named here and nothing is passed over, so that what is added does not compile without its
//! version.

use crate::error::{Error, Result};
use crate::graph::{
    Buffer, Composition, Extent, Footprint, Format, Groups, Lifetime, Output, Pass, Resource,
    SamplerKind, SplatDepth, Splats, Structure, SurfaceMode, Texture, Work,
};

/// Refuses a graph that needs a newer minor version than this.
pub(super) fn check_minor(structure: &Structure, minor: u16) -> Result<()> {
    let mut needed = Needed::default();
    needed.structure(structure);
    if needed.minor <= minor {
        return Ok(());
    }
    Err(Error::new(format!(
        "the graph has {}, which came with ABI 3.{}; the plugin says that hosts of ABI 3.{minor} will do: raise \
         `minor` of export_plugin!, or do without",
        needed.what, needed.minor
    )))
}

/// The newest thing of a graph.
#[derive(Default)]
struct Needed {
    minor: u16,
    what: &'static str,
}

impl Needed {
    fn add(&mut self, minor: u16, what: &'static str, is_there: bool) {
        if is_there && minor > self.minor {
            (self.minor, self.what) = (minor, what);
        }
    }

    fn structure(&mut self, structure: &Structure) {
        let Structure {
            textures,
            buffers,
            uniforms: _,
            passes,
            outputs,
            wants_another_frame: _,
            cameras,
            members,
            taken,
            encoded_over,
        } = structure;
        textures.iter().for_each(|texture| self.texture(texture));
        buffers.iter().for_each(|buffer| self.buffer(buffer));
        passes.iter().for_each(|pass| self.pass(pass));
        for (output, _) in outputs {
            match output {
                Output::Color
                | Output::Depth
                | Output::Normal
                | Output::Albedo
                | Output::Ao
                | Output::Debug(_) => {}
            }
        }
        self.add(5, "a camera of its own", !cameras.is_empty());
        self.add(
            7,
            "a uniform by name (`settings`, `members` or `parameters`)",
            !members.is_empty(),
        );
        self.add(9, "clouds that it takes from the host", !taken.is_empty());
        self.add(10, "a picture that goes over others as encoded numbers", *encoded_over);
    }

    fn texture(&mut self, texture: &Texture) {
        let Texture { label: _, format, extent, volume: _, mips: _, lifetime } = texture;
        match format {
            Format::Rgba8Unorm
            | Format::Rgba16Float
            | Format::R32Float
            | Format::Rg32Float
            | Format::Rgba32Float
            | Format::R32Uint
            | Format::Rgba32Uint
            | Format::Depth32Float => {}
        }
        match extent {
            Extent::View { divisor: _ } | Extent::Fixed(_) => {}
        }
        self.lifetime(lifetime);
    }

    fn buffer(&mut self, buffer: &Buffer) {
        let Buffer { label: _, size: _, lifetime, upload: _, surfels, columns, resident } = buffer;
        self.lifetime(lifetime);
        self.add(5, "a buffer of surfels", surfels.is_some());
        self.add(9, "a buffer of columns", columns.is_some());
        self.add(10, "a buffer whose bytes stay", resident.is_some());
    }

    fn lifetime(&mut self, lifetime: &Lifetime) {
        match lifetime {
            Lifetime::Frame | Lifetime::Persistent { key: _, stored: _ } => {}
            Lifetime::History => self.add(5, "a buffer with a history", true),
        }
    }

    fn pass(&mut self, pass: &Pass) {
        let Pass {
            name: _,
            work,
            wgsl: _,
            modules: _,
            entry: _,
            constants: _,
            bindings,
            merges: _,
            features,
            camera,
            needs,
            instead,
        } = pass;
        match work {
            Work::Shading { surface, target: _, elsewhere: _, per_surfel: _ } => {
                self.surface(*surface);
            }
            Work::Fullscreen { surface, targets: _ } => self.surface(*surface),
            Work::Compute { surface, groups } => {
                self.surface(*surface);
                match groups {
                    Groups::Fixed(_) | Groups::PerPixel { divisor: _ } => {}
                    Groups::Counted { buffer: _, offset: _, at_most: _ } => {
                        self.add(10, "a pass of counted workgroups", true);
                    }
                }
            }
            Work::Splats(splats) => self.splats(splats),
            Work::Sort(_) => self.add(10, "a pass that sorts", true),
            Work::Scan(_) => self.add(10, "a pass that sums up", true),
        }
        for resource in bindings.values() {
            match resource {
                Resource::Uniform(_)
                | Resource::Texture { id: _, mip: _ }
                | Resource::Buffer(_) => {}
                Resource::Sampler(kind) => match kind {
                    SamplerKind::Nearest | SamplerKind::Linear | SamplerKind::LinearRepeat => {}
                },
            }
        }
        self.add(3, "features of passes", !features.is_empty());
        self.add(5, "a pass that looks from a camera of its own", camera.is_some());
        self.add(10, "a pass that needs a feature of the device", !needs.is_empty());
        if let Some(instead) = instead {
            self.pass(instead);
        }
    }

    fn surface(&mut self, surface: SurfaceMode) {
        match surface {
            SurfaceMode::Nearest | SurfaceMode::Blended => {}
            SurfaceMode::Fields => self.add(4, "normals that vary over surfels", true),
        }
    }

    fn splats(&mut self, splats: &Splats) {
        let Splats {
            n: _,
            footprint,
            composition,
            targets: _,
            depths,
            tested: _,
            surface,
            per_pixel,
        } = splats;
        self.add(9, "a pass of splats", true);
        self.add(10, "splats that are told pixel by pixel", per_pixel.is_some());
        match footprint {
            Footprint::Conic | Footprint::Planar => {}
        }
        match composition {
            Composition::Over
            | Composition::Additive
            | Composition::Nearest
            | Composition::Stochastic { samples: _ } => {}
            Composition::Normalized { tolerance: _ } => {
                self.add(10, "splats that are averaged within a tolerance", true);
            }
        }
        for (which, _) in depths {
            match which {
                SplatDepth::Expected | SplatDepth::Median => {}
                SplatDepth::Distortion => self.add(10, "a picture of distortion", true),
            }
        }
        self.surface(*surface);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Graph, Members};
    use crate::uniform::Uniform;

    #[test]
    fn a_graph_needs_the_version_of_its_newest_part() {
        let mut graph = Graph::new();
        let settings = graph.uniform(Uniform::new().f32(1.0));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("shade", "", "shade").bind("settings", settings).target(color));
        graph.output(Output::Color, color);
        assert!(check_minor(graph.structure(), 0).is_ok());

        let mut older = graph.clone();
        older.pass(Pass::shading("again", "", "shade").feature("GLOWS", true).target(color));
        assert!(check_minor(older.structure(), 3).is_ok());
        assert!(check_minor(older.structure(), 2).is_err());

        graph.settings("params", Members::new().f32("gain", 1.0));
        let n = graph.surfels("points", 10, 10);
        graph.pass(Pass::compute("go", "", "go", Groups::Fixed([1; 3])).bind("points", n));
        assert!(check_minor(graph.structure(), 7).is_ok());
        let line = check_minor(graph.structure(), 6).unwrap_err().to_string();
        let expected = "the graph has a uniform by name (`settings`, `members` or `parameters`), which came with \
                        ABI 3.7; the plugin says that hosts of ABI 3.6 will do: raise `minor` of \
                        export_plugin!, or do without";
        assert_eq!(line, expected);

        graph.pass(Pass::splats("splats", "", "draw", Footprint::Conic, 4).target(color));
        assert!(check_minor(graph.structure(), 8).is_err());
        assert!(check_minor(graph.structure(), 9).is_ok());
    }
}
