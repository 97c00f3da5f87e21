//! The rules that passes of splats must keep.

use crate::graph::plan::{Node, Plan, Planned};
use surfelshop_api::graph::{Composition, Format, Pass, Splats, TextureId};

/// Most splats of a pass.
const MAX_SPLATS: u64 = 1 << 28;

/// Most tries of a stochastic composition.
const MAX_SAMPLES: u32 = 64;

impl Plan {
    /// # Errors
    /// The first rule that a pass of splats breaks.
    pub(in crate::graph) fn check_splats(
        &self,
        pass: &Pass,
        splats: &Splats,
        planned: &mut Planned,
    ) -> Result<(), String> {
        if splats.n > MAX_SPLATS {
            return Err(format!("it draws {} splats; at most {MAX_SPLATS} are drawn", splats.n));
        }
        if let Composition::Stochastic { samples } = splats.composition
            && !(1..=MAX_SAMPLES).contains(&samples)
        {
            return Err(format!("it takes {samples} samples; 1 to {MAX_SAMPLES} are taken"));
        }
        if splats.depths.len() > 2 {
            return Err(format!("it draws {} depths; at most 2 are drawn", splats.depths.len()));
        }
        for target in &splats.targets {
            self.check_splat_target(pass, *target, Format::Rgba32Float, planned)?;
        }
        for (_, target) in &splats.depths {
            self.check_splat_target(pass, *target, Format::R32Float, planned)?;
        }
        if splats.tested {
            planned.surface = Some(splats.surface);
        }
        Ok(())
    }

    fn check_splat_target(
        &self,
        pass: &Pass,
        target: TextureId,
        format: Format,
        planned: &mut Planned,
    ) -> Result<(), String> {
        let index = target.index();
        let Some(texture) = self.structure.textures.get(index) else {
            return Err("it draws into a texture the graph does not have".to_owned());
        };
        let label = &texture.label;
        let [width, height, depth] = self.extent(index);
        let seen = self.size_of(pass);
        if [width, height] != seen || depth != 1 || texture.mips != 1 || texture.volume {
            return Err(format!(
                "texture `{label}` is {width} x {height} x {depth}; splats are drawn into one level of {} x {}",
                seen[0], seen[1]
            ));
        }
        if texture.format != format {
            let found = texture.format;
            return Err(format!("texture `{label}` is {found:?}; expected {format:?} there"));
        }
        let node = Node::Texture(index);
        if planned.writes.contains(&node) {
            return Err(format!("it draws into texture `{label}` twice"));
        }
        if planned.reads.contains(&node) {
            return Err(format!("it reads and draws into texture `{label}`"));
        }
        planned.writes.push(node);
        Ok(())
    }
}
