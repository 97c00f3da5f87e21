//! The entry points around an author's shading function.

use naga::ShaderStage;
use surfelshop_api::graph::{Format, Pass, Work};

/// The entry point that covers the picture.
pub(crate) const SHADING_ENTRY: &str = "surfelshop_shade";
/// The texture that it stores into where it is a compute one.
pub(crate) const SHADING_TARGET: &str = "surfelshop_target";
/// The entry point that goes over the surfels of a chunk, and what it reads and writes.
pub(crate) const SURFEL_ENTRY: &str = "surfelshop_shade_surfels";
pub(crate) const SURFEL_RECORDS: &str = "surfelshop_records";
pub(crate) const SURFEL_RADIANCE: &str = "surfelshop_radiance";

/// The words that follow `fn` in a shader, comments included; enough to find a misspelt name.
fn functions_of(wgsl: &str) -> impl Iterator<Item = &str> {
    let mut words = wgsl.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    std::iter::from_fn(move || {
        words.find(|word| *word == "fn")?;
        words.find(|word| !word.is_empty())
    })
}

/// Names behind one another.
pub(super) fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

pub(super) fn check_function(pass: &Pass, function: &str) -> Result<(), String> {
    let plain = function.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if function.is_empty() || !plain {
        return Err(format!("`{function}` is no name of a WGSL function"));
    }
    let functions: Vec<&str> = functions_of(&pass.wgsl).collect();
    if functions.contains(&function) {
        return Ok(());
    }
    let list = list(&functions);
    Err(format!("the shader has no function `{function}`; it has: {list}"))
}

/// What is wrong with an author's function where a message is of what the host put behind their text, which calls it.
pub(super) fn unfit(pass: &Pass, message: &str) -> Option<String> {
    if !is_behind(pass, message) {
        return None;
    }
    let function = &pass.entry;
    let expected = match &pass.work {
        Work::Splats(_) => format!("`fn {function}(i: u32) -> splat::Splat`"),
        Work::Shading { elsewhere: Some(elsewhere), .. } => format!(
            "`fn {function}(s: Surface) -> vec4<f32>`, and `fn {elsewhere}(pixel: vec2<u32>) -> vec4<f32>`"
        ),
        Work::Shading { .. } => format!("`fn {function}(s: Surface) -> vec4<f32>`"),
        _ => return None,
    };
    Some(format!("`{function}` does not fit; expected {expected}"))
}

/// Whether a message is of what stands behind an author's text.
pub(super) fn is_behind(pass: &Pass, message: &str) -> bool {
    let line = message.strip_prefix("line ").and_then(|rest| rest.split(':').next());
    let line = line.and_then(|line| line.parse::<usize>().ok());
    line.is_some_and(|line| line > pass.wgsl.lines().count())
        || message.contains("'surfelshop_")
        || message.contains("Entry point surfelshop_")
}

/// The author's text with an entry point that calls their function for each covered pixel, or, where
/// surfels are shaded one by one, shows what was blended of them.
///
/// # Errors
/// Where the text has no such function.
pub(crate) fn pixel_source(
    pass: &Pass,
    format: Format,
    stage: ShaderStage,
) -> Result<String, String> {
    check_function(pass, &pass.entry)?;
    let (elsewhere, per_surfel) = match &pass.work {
        Work::Shading { elsewhere, per_surfel, .. } => (elsewhere.as_deref(), *per_surfel),
        _ => (None, false),
    };
    let elsewhere = match elsewhere {
        Some(function) => {
            check_function(pass, function)?;
            format!("{function}(vec2<u32>(s.pixel))")
        }
        None => "vec4(0.0)".to_owned(),
    };
    let covered = match per_surfel {
        true => "vec4(s.albedo, 1.0)".to_owned(),
        false => format!("{}(s)", pass.entry),
    };
    // Two more loads are for those who want them.
    let texts = pass.modules.iter().map(|module| &module.wgsl).chain([&pass.wgsl]);
    let wants_variance = texts.into_iter().any(|text| text.contains("normal_variance"));
    let variance = match wants_variance && !per_surfel {
        true => "s.normal_variance = surfelshop_surface::normal_variance_at(s);",
        false => "",
    };
    let entry = match stage {
        ShaderStage::Compute => {
            let texel = storage_texel(format)?;
            format!(
                "var {SHADING_TARGET}: texture_storage_2d<{texel}, write>;\n\
                 @compute @workgroup_size(8, 8)\n\
                 fn {SHADING_ENTRY}(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
                     if any(id.xy >= textureDimensions({SHADING_TARGET})) {{ return; }}\n\
                     var s = surfelshop_surface::surface_at(id.xy);\n\
                     {variance}\n\
                     var color = vec4(0.0);\n\
                     if s.covered {{ color = {covered}; }} else {{ color = {elsewhere}; }}\n\
                     textureStore({SHADING_TARGET}, id.xy, color);\n\
                 }}\n"
            )
        }
        _ => format!(
            "@fragment\n\
             fn {SHADING_ENTRY}(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {{\n\
                 var s = surfelshop_surface::surface_at(vec2<u32>(p.xy));\n\
                 {variance}\n\
                 if !s.covered {{ return {elsewhere}; }}\n\
                 return {covered};\n\
             }}\n"
        ),
    };
    Ok(format!("{}\n#import surfelshop::surface as surfelshop_surface\n{entry}", pass.wgsl))
}

fn storage_texel(format: Format) -> Result<&'static str, String> {
    Ok(match format {
        Format::Rgba8Unorm => "rgba8unorm",
        Format::Rgba16Float => "rgba16float",
        Format::R32Float => "r32float",
        Format::Rg32Float => "rg32float",
        Format::Rgba32Float => "rgba32float",
        Format::R32Uint | Format::Rgba32Uint | Format::Depth32Float => {
            return Err(format!("a shading pass cannot write {format:?}"));
        }
    })
}

/// The author's text with an entry point that calls their function for each surfel of a chunk.
pub(crate) fn surfel_source(pass: &Pass) -> String {
    let function = &pass.entry;
    format!(
        "{}\n\
         #import surfelshop::surface as surfelshop_surface\n\
         #import surfelshop::packing as surfelshop_packing\n\
         #import surfelshop::view as surfelshop_view\n\
         struct SurfelshopRecord {{ surface: vec4<u32>, position: vec3<f32>, to_eye: u32 }}\n\
         var<storage, read> {SURFEL_RECORDS}: array<SurfelshopRecord>;\n\
         var<storage, read_write> {SURFEL_RADIANCE}: array<vec4<f32>>;\n\
         @compute @workgroup_size(64)\n\
         fn {SURFEL_ENTRY}(\n\
             @builtin(global_invocation_id) id: vec3<u32>,\n\
             @builtin(num_workgroups) groups: vec3<u32>,\n\
         ) {{\n\
             let i = id.x + id.y * groups.x * 64u;\n\
             if i >= arrayLength(&{SURFEL_RADIANCE}) {{ return; }}\n\
             let record = {SURFEL_RECORDS}[i];\n\
             let u = surfelshop_packing::unpack_surface(record.surface);\n\
             let s = surfelshop_surface::Surface(\n\
                 u.depth * surfelshop_view::view.unit,\n\
                 record.position * surfelshop_view::view.unit,\n\
                 u.normal,\n\
                 surfelshop_packing::unpack_direction(record.to_eye),\n\
                 u.albedo,\n\
                 u.ao,\n\
                 vec2(0u),\n\
                 u.depth > 0.0,\n\
                 0.0,\n\
             );\n\
             var color = vec4(0.0);\n\
             if s.covered {{ color = {function}(s); }}\n\
             {SURFEL_RADIANCE}[i] = color;\n\
         }}\n",
        pass.wgsl
    )
}
