//! The rules that passes of splats must keep.

use crate::gpu::Gpu;
use crate::graph::pipelines::Pipelines;
use crate::graph::plan::{Node, Plan, Planned, defines_of};
use crate::graph::shading::is_behind;
use crate::graph::splats::source::{
    COMPOSE_PER_PIXEL, Form, SPLAT_ENTRY, compose_defines, is_of_composing, per_pixel_source,
};
use crate::shader_compiler::{SPENT, called_by, members_read, reflect};
use surfelshop_api::graph::{Composition, Footprint, Format, Pass, Splats, TextureId};

/// Most splats of a pass.
const MAX_SPLATS: u64 = 1 << 28;

/// Most tries of a stochastic composition.
const MAX_SAMPLES: u32 = 64;

/// Most pictures of depths: one of each kind.
const MAX_DEPTHS: usize = 3;

/// Refuses a function that makes footprints of the other kind than its pass says, by the functions of
/// `surfelshop::splat` that it calls.
///
/// # Errors
/// One line that names both.
pub(in crate::graph) fn check_footprint(
    splats: &Splats,
    module: &naga::Module,
) -> Result<(), String> {
    let called = called_by(module, SPLAT_ENTRY);
    let calls = |names: &[&'static str]| {
        let is_called = |name: &&&str| called.contains(&format!("surfelshop::splat::{name}"));
        names.iter().find(is_called).copied()
    };
    let (of_conics, of_planes) = (calls(&["gaussian", "conic"]), calls(&["planar"]));
    let (own, other, needs) = match splats.footprint {
        Footprint::Conic => (of_conics, of_planes, "Planar"),
        Footprint::Planar => (of_planes, of_conics, "Conic"),
    };
    match (own, other) {
        (None, Some(other)) => Err(format!(
            "its function calls `splat::{other}`, whose footprints are of `Footprint::{needs}`; the pass says `Footprint::{:?}`",
            splats.footprint
        )),
        _ => Ok(()),
    }
}

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
        if let Composition::Normalized { tolerance } = splats.composition
            && !(tolerance.is_finite() && tolerance >= 0.0)
        {
            return Err(format!(
                "its tolerance is {tolerance}; a share of the distance is expected, finite and 0 or more"
            ));
        }
        if splats.depths.len() > MAX_DEPTHS {
            let n = splats.depths.len();
            return Err(format!("it draws {n} depths; at most {MAX_DEPTHS} are drawn"));
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

    /// Adds what puts splats together by a function of the pass, where it has one.
    ///
    /// # Errors
    /// What is wrong with the function, or the first rule that what it reads breaks.
    pub(in crate::graph) fn plan_per_pixel(
        &self,
        pass: &Pass,
        splats: &Splats,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
        planned: &mut Planned,
    ) -> Result<(), String> {
        let Some(function) = &splats.per_pixel else { return Ok(()) };
        // The author's own text has been compiled: what is wrong behind it, the function does not fit.
        let mut shader_of = |form: Form| {
            let source = per_pixel_source(pass, splats.targets.len(), function, form)?;
            let defines = [defines_of(pass), compose_defines(splats, form)].concat();
            pipelines.shader_with(&source, &pass.modules, &defines)
        };
        let shader = match Form::of(gpu) {
            Form::Tiles => shader_of(Form::Tiles),
            // Functions stand there several times, and a long one may be too long.
            Form::Runs => shader_of(Form::Runs).or_else(|_| shader_of(Form::Tiles)),
        };
        let shader = shader.map_err(|message| match is_behind(pass, &message) {
            true => format!(
                "`{function}` does not fit; expected `fn {function}(p: splat::Pixel) -> splat::Fragment`"
            ),
            false => message,
        })?;
        let stage = naga::ShaderStage::Compute;
        let point =
            reflect(&shader.composed, stage, COMPOSE_PER_PIXEL).map_err(|error| error.message)?;
        self.check_bound(&point.bindings, &gpu.device.limits())?;
        for binding in point.bindings.iter().filter(|binding| !is_of_composing(&binding.name)) {
            if binding.kind.writes() && binding.name != SPENT {
                return Err(format!(
                    "`{}` is stored into by `{function}`, which is called for pixels in no order; it only reads",
                    binding.name
                ));
            }
            self.check_binding(pass, binding, splats.surface, gpu, planned)?;
        }
        let flags = planned.settings.flags();
        let members = members_read(&shader.composed, stage, COMPOSE_PER_PIXEL, &flags);
        planned.members = planned.members.or(members);
        planned.per_pixel = Some(shader);
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
