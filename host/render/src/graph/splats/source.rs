//! The entry points around an author's splat function, and around what puts splats together.

use crate::gpu::Gpu;
use crate::graph::shading::check_function;
use surfelshop_api::graph::{Composition, Footprint, MAX_PAYLOADS, Pass, SplatDepth, Splats};

/// Side of a tile, `TILE` of the shaders.
pub(super) const TILE: u32 = 16;

/// The entry point that goes over splats, and what it reads and writes.
pub(crate) const SPLAT_ENTRY: &str = "surfelshop_make_splats";
pub(crate) const SPLAT_FOOTPRINTS: &str = "surfelshop_footprints";
pub(crate) const SPLAT_PAYLOADS: &str = "surfelshop_payloads";
pub(crate) const SPLAT_RANGE: &str = "surfelshop_range";

/// Invocations of a workgroup.
pub(crate) const GROUP: u32 = 64;

/// The author's text with an entry point that calls their function for each splat of a range and stores its footprint
/// and so many vectors.
///
/// # Errors
/// Where the text has no such function, or vectors are too few or too many.
pub(crate) fn splat_source(pass: &Pass, n_payloads: usize) -> Result<String, String> {
    if !(1..=MAX_PAYLOADS).contains(&n_payloads) {
        return Err(format!("it draws into {n_payloads} targets; 1 to {MAX_PAYLOADS} are drawn"));
    }
    check_function(pass, &pass.entry)?;
    let function = &pass.entry;
    let payloads: String = (0..n_payloads)
        .map(|k| format!("{SPLAT_PAYLOADS}[k * {n_payloads}u + {k}u] = s.payload[{k}];\n"))
        .collect();
    Ok(format!(
        "{}\n\
         #import surfelshop::splat as surfelshop_splat\n\
         struct SurfelshopFootprint {{\n\
             shape: vec4<f32>, distance: vec3<f32>, opacity: f32, center: vec4<f32>\n\
         }}\n\
         var<storage, read_write> {SPLAT_FOOTPRINTS}: array<SurfelshopFootprint>;\n\
         var<storage, read_write> {SPLAT_PAYLOADS}: array<vec4<f32>>;\n\
         var<uniform> {SPLAT_RANGE}: vec4<u32>;\n\
         @compute @workgroup_size({GROUP})\n\
         fn {SPLAT_ENTRY}(\n\
             @builtin(global_invocation_id) id: vec3<u32>,\n\
             @builtin(num_workgroups) groups: vec3<u32>,\n\
         ) {{\n\
             let k = id.x + id.y * groups.x * {GROUP}u;\n\
             if k >= {SPLAT_RANGE}.y {{ return; }}\n\
             let s = {function}({SPLAT_RANGE}.x + k);\n\
             {SPLAT_FOOTPRINTS}[k] = SurfelshopFootprint(\n\
                 s.shape, s.distance, s.opacity, vec4(s.center_px, 0.0, 0.0)\n\
             );\n\
             {payloads}\
         }}\n",
        pass.wgsl
    ))
}

pub(super) const FOOTPRINT: &str = include_str!("footprint.wgsl");
pub(super) const EXTENT: &str = include_str!("extent.wgsl");
pub(super) const MET: &str = include_str!("met.wgsl");
pub(super) const MOMENTS: &str = include_str!("moments.wgsl");
pub(super) const CHANCE: &str = include_str!("chance.wgsl");
pub(super) const SHOWN: &str = include_str!("shown.wgsl");
/// What puts splats together where a device computes.
const COMPOSING: [&str; 5] = [FOOTPRINT, MET, MOMENTS, CHANCE, include_str!("compose_splats.wgsl")];
/// The last of them where the processor does.
const COMPOSING_RUNS: &str = include_str!("compose_runs.wgsl");

/// How invocations share the work of putting splats together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// A workgroup fetches a tile's splats for all of its pixels, of which each invocation has one.
    Tiles,
    /// An invocation has a run of pixels, and shares nothing.
    Runs,
}

impl Form {
    /// What is faster on a device.
    pub(crate) fn of(gpu: &Gpu) -> Self {
        if gpu.is_software() { Self::Runs } else { Self::Tiles }
    }
}

/// The entry point that puts splats together.
pub(super) const COMPOSE: &str = "compose";

/// The same of a pass with a function of its own for each pixel.
pub(crate) const COMPOSE_PER_PIXEL: &str = "surfelshop_compose";

/// What names of the host's text begin with where it stands behind an author's.
pub(super) const PREFIX: &str = "surfelshop_";

/// The text that puts splats together, but for the functions that are the host's.
fn composing(n_payloads: usize, form: Form, is_per_pixel: bool) -> String {
    let payloads = format!("const N_PAYLOADS = {n_payloads}u;\n");
    if form == Form::Tiles {
        return payloads + &COMPOSING.join("\n");
    }
    // Drivers put an author's function wherever it is called.
    let [across, down] = if is_per_pixel { [2, 1] } else { [4, 2] };
    let mut text = format!(
        "{payloads}const RUN = vec2<u32>({across}u, {down}u);\nconst IS_PER_PIXEL = {is_per_pixel};\n"
    );
    let [shared @ .., _] = COMPOSING;
    text += &shared.join("\n");
    text.push('\n');
    for line in COMPOSING_RUNS.lines() {
        let n = if line.contains("EACH") { across * down } else { 1 };
        for i in 0..n {
            text += &line.replace("EACH", &i.to_string());
            text.push('\n');
        }
    }
    let groups = [TILE / across, TILE / down].map(|side| side.to_string());
    text.replace("GROUP_ACROSS", &groups[0]).replace("GROUP_DOWN", &groups[1])
}

/// The text that puts splats of a pass together by opacities that fall off as Gaussians.
pub(super) fn compose_source(splats: &Splats, form: Form) -> String {
    composing(splats.targets.len(), form, false)
}

/// The author's text with what puts splats together behind it, which calls their function for each splat of a pixel.
///
/// # Errors
/// Where the text has no such function.
pub(crate) fn per_pixel_source(
    pass: &Pass,
    n_payloads: usize,
    function: &str,
    form: Form,
) -> Result<String, String> {
    check_function(pass, function)?;
    Ok(behind(pass, function, &composing(n_payloads, form, true)))
}

/// The author's text with text of the host behind it, which calls their function; names of the host begin with
/// [`PREFIX`] there.
pub(super) fn behind(pass: &Pass, function: &str, text: &str) -> String {
    let names = declared(text);
    let word = |word: &str| match word {
        "FUNCTION_PER_PIXEL" => function.to_owned(),
        _ if names.contains(&word) => format!("{PREFIX}{word}"),
        _ => word.to_owned(),
    };
    let text = with_words(text, word);
    format!("{}\n#import surfelshop::splat as surfelshop_splat\n{text}", pass.wgsl)
}

/// What is defined while the text that puts splats together is preprocessed.
pub(crate) fn compose_defines(splats: &Splats, form: Form) -> Vec<&'static str> {
    let is_mean = matches!(splats.composition, Composition::Normalized { .. });
    let is_wide = splats.depths.iter().any(|(which, _)| *which == SplatDepth::Distortion);
    let has_function = splats.per_pixel.is_some();
    let picks = matches!(splats.composition, Composition::Nearest | Composition::Stochastic { .. });
    // A text for this pass alone, which leaves out what it does not need.
    let is_own = has_function || form == Form::Runs;
    let is_planar = splats.footprint == Footprint::Planar;
    let all = [
        (has_function, "PER_PIXEL"),
        (is_own && !splats.tested, "NO_SURFACE"),
        (is_own && splats.depths.is_empty(), "NO_DEPTHS"),
        (is_own && picks, "NO_BLENDING"),
        (is_own && !picks, "NO_PICKING"),
        (form == Form::Runs && is_planar, "PLANAR"),
        (form == Form::Runs && !is_planar, "CONIC"),
        (is_mean, "NORMALIZED"),
        (is_wide, "DISTORTION"),
    ];
    all.into_iter().filter(|(is_set, _)| *is_set).map(|(_, name)| name).collect()
}

/// Whether a variable is the host's in such a text.
pub(crate) fn is_of_composing(name: &str) -> bool {
    let own = name.strip_prefix(PREFIX).unwrap_or_default();
    COMPOSING.into_iter().flat_map(declared).any(|declared| declared == own)
}

/// Names that lines of a text declare at its top level.
fn declared(text: &str) -> Vec<&str> {
    let declares =
        |line: &&str| ["fn ", "struct ", "const ", "var"].iter().any(|word| line.starts_with(word));
    text.lines()
        .filter(declares)
        .filter_map(|line| {
            let rest = match line.split_once("> ") {
                Some((before, rest)) if before.starts_with("var") => rest,
                _ => line.split_once(' ')?.1,
            };
            rest.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).next()
        })
        .collect()
}

/// A text whose words are replaced.
fn with_words(text: &str, replaced: impl Fn(&str) -> String) -> String {
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut result = String::with_capacity(2 * text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = match is_of_word(first) {
            true => rest.find(|c| !is_of_word(c)),
            false => rest.find(is_of_word),
        };
        let (part, behind) = rest.split_at(end.unwrap_or(rest.len()));
        match is_of_word(first) {
            true => result.push_str(&replaced(part)),
            false => result.push_str(part),
        }
        rest = behind;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Gpu;
    use crate::graph::pipelines::Pipelines;
    use crate::graph::variants::Settings;
    use surfelshop_api::graph::{Footprint, Format, Graph, Texture, Work};

    fn pass(with: impl Fn(Pass) -> Pass) -> (Pass, Splats) {
        let wgsl = "fn round(i: u32) -> u32 { return i; }";
        let mut graph = Graph::new();
        let target = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
        let pass = with(Pass::splats("splats", wgsl, "round", Footprint::Conic, 3).target(target));
        let Work::Splats(splats) = pass.work.clone() else { panic!("{:?}", pass.work) };
        (pass, splats)
    }

    /// What it was before there were functions of pixels.
    const PLAIN: &str = "fn round(i: u32) -> u32 { return i; }
#import surfelshop::splat as surfelshop_splat
struct SurfelshopFootprint {
shape: vec4<f32>, distance: vec3<f32>, opacity: f32, center: vec4<f32>
}
var<storage, read_write> surfelshop_footprints: array<SurfelshopFootprint>;
var<storage, read_write> surfelshop_payloads: array<vec4<f32>>;
var<uniform> surfelshop_range: vec4<u32>;
@compute @workgroup_size(64)
fn surfelshop_make_splats(
@builtin(global_invocation_id) id: vec3<u32>,
@builtin(num_workgroups) groups: vec3<u32>,
) {
let k = id.x + id.y * groups.x * 64u;
if k >= surfelshop_range.y { return; }
let s = round(surfelshop_range.x + k);
surfelshop_footprints[k] = SurfelshopFootprint(
s.shape, s.distance, s.opacity, vec4(s.center_px, 0.0, 0.0)
);
surfelshop_payloads[k * 1u + 0u] = s.payload[0];
}
";

    #[test]
    fn a_pass_without_a_function_of_pixels_has_the_text_it_had() {
        let (plain, splats) = pass(|pass| pass);
        assert_eq!(splat_source(&plain, 1).unwrap(), PLAIN);
        assert!(compose_defines(&splats, Form::Tiles).is_empty());
        // And the function that makes footprints is the same beside one of pixels.
        let (changed, splats) = pass(|pass| pass.per_pixel("round"));
        assert_eq!(splat_source(&changed, 1).unwrap(), PLAIN);
        assert_eq!(
            compose_defines(&splats, Form::Tiles),
            ["PER_PIXEL", "NO_SURFACE", "NO_DEPTHS", "NO_PICKING"]
        );
    }

    /// Of each number of vectors and each kind of composition, with three buffers of the author's: eight of storage, as
    /// many as WebGPU promises, where neither a surface nor depths are asked for.
    #[test]
    fn what_puts_splats_together_compiles_for_any_device() {
        let gpu = Gpu::noop().unwrap();
        let mut pipelines = Pipelines::new(gpu.device.clone()).unwrap();
        let wgsl = "#import surfelshop::splat
            var<storage, read> hash: array<f32>;
            var<storage, read> sums: array<f32>;
            var<storage, read> params: array<f32>;
            fn chance(i: u32) -> splat::Splat { return splat::nothing(); }
            fn met(p: splat::Pixel) -> splat::Fragment {
                let more = hash[0] + sums[1] + params[p.index] + splat::position_at(p).x;
                var f = splat::Fragment(p.opacity + more, p.payload);
                switch u32(p.pixel.x) {
                    case 0u: { f.payload[0] = vec4(more); }
                    case 1u: { f.payload[1] = p.payload[2] * more; }
                    default: { f.opacity = exp(p.exponent); }
                }
                return f;
            }";
        let compositions = [
            Composition::Over,
            Composition::Stochastic { samples: 4 },
            Composition::Normalized { tolerance: 0.1 },
        ];
        for (composition, form) in
            compositions.into_iter().flat_map(|one| [(one, Form::Tiles), (one, Form::Runs)])
        {
            for changed in [None, Some("met")] {
                for depth in [None, Some(SplatDepth::Distortion)] {
                    let (plain, mut splats) = pass(|pass| pass.composed(composition));
                    let plain = Pass { wgsl: wgsl.to_owned(), ..plain };
                    splats.per_pixel = changed.map(str::to_owned);
                    splats.depths =
                        depth.map(|which| (which, splats.targets[0])).into_iter().collect();
                    let (source, entry) = match changed {
                        Some(function) => {
                            let text = per_pixel_source(&plain, 4, function, form);
                            (text.unwrap(), COMPOSE_PER_PIXEL)
                        }
                        None => (compose_source(&splats, form), COMPOSE),
                    };
                    let defines = compose_defines(&splats, form);
                    let shader = pipelines.shader(&source, &defines).unwrap();
                    let made = pipelines.compute(entry, &shader, entry, &Settings::default());
                    // With depths there is one more.
                    let fits = changed.is_none() || depth.is_none();
                    assert_eq!(made.is_ok(), fits, "{form:?}, {defines:?}: {:?}", made.err());
                }
            }
        }
    }

    #[test]
    fn every_name_of_the_host_is_told_apart_from_those_of_authors() {
        let of_tiles = ["batch", "shaded"].as_slice();
        for (form, own) in [(Form::Tiles, of_tiles), (Form::Runs, &["see", "RUN", "Open"])] {
            let text = composing(2, form, true);
            let names = declared(&text);
            for name in ["N_PAYLOADS", "Footprint", "params", "compose", "chance"].iter().chain(own)
            {
                assert!(names.contains(name), "{name} is missing in {names:?}");
            }
            let (changed, _) = pass(|pass| pass);
            let source = per_pixel_source(&changed, 2, "round", form).unwrap();
            let behind = &source[changed.wgsl.len()..];
            assert_eq!(declared(behind).len(), names.len());
            assert!(declared(behind).iter().all(|name| name.starts_with(PREFIX)), "{behind}");
            assert!(behind.contains("= round(p);") && !behind.contains("FUNCTION_PER_PIXEL"));
        }
        let (changed, _) = pass(|pass| pass);
        let line = per_pixel_source(&changed, 2, "square", Form::Tiles).unwrap_err();
        assert_eq!(line, "the shader has no function `square`; it has: round");
    }
}
