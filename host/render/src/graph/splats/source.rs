//! The entry point around an author's splat function.

use crate::graph::shading::check_function;
use surfelshop_api::graph::{MAX_PAYLOADS, Pass};

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
