//! Extensions that a file says nobody can do without.

use gltf::json::mesh::Primitive;
use gltf::json::{Root, Value};
use surfelshop_api::prelude::{Error, Result};

/// The extension of Gaussian splats, whose name their attributes begin with.
pub(crate) const SPLATS: &str = "KHR_gaussian_splatting";

/// How names of extensions begin that pack splats.
const COMPRESSION: &str = "KHR_gaussian_splatting_compression_";

/// What to do about packed splats.
pub(crate) const PACKED_SPLATS: &str =
    "save the splats without compression, or as an .spz file of their own";

/// Those that change how meshes are stored or shown, and are not read.
const REFUSED: [(&str, &str); 4] = [
    ("KHR_draco_mesh_compression", "save the file without compression"),
    ("EXT_meshopt_compression", "save the file without compression"),
    ("KHR_meshopt_compression", "save the file without compression"),
    ("EXT_mesh_gpu_instancing", "save the file without instances"),
];

/// Those that change nothing of points and triangles, by how they begin.
const HARMLESS: [&str; 12] = [
    "KHR_materials_",
    "KHR_gaussian_splatting",
    "KHR_texture_",
    "KHR_lights_",
    "KHR_mesh_quantization",
    "KHR_animation_",
    "KHR_xmp",
    "KHR_audio",
    "EXT_texture_",
    "EXT_lights_",
    "EXT_materials_",
    "MSFT_texture_",
];

/// What a primitive says of its splats; `None` where it has none.
pub(crate) fn splats(primitive: &Primitive) -> Option<&Value> {
    primitive.extensions.as_ref()?.others.get(SPLATS)
}

/// Those that pack splats as SPZ: a draft, and what it was called before.
const SPZ: [&str; 2] =
    ["KHR_gaussian_splatting_compression_spz_2", "KHR_gaussian_splatting_compression_spz"];

/// The buffer view in which a primitive's splats are packed as SPZ.
pub(crate) fn packed_view(primitive: &Primitive) -> Option<u64> {
    let inside = splats(primitive)?.get("extensions")?;
    SPZ.into_iter().find_map(|name| inside.get(name)?.get("bufferView")?.as_u64())
}

/// The name of the extension that packs a primitive's splats.
pub(crate) fn compression(primitive: &Primitive) -> Option<&str> {
    let inside = splats(primitive)?.get("extensions")?.as_object()?;
    inside.keys().find(|name| name.starts_with(COMPRESSION)).map(String::as_str)
}

/// Looks through what a file requires; returns what is doubtful.
///
/// # Errors
/// Where meshes cannot be read without an extension.
pub(crate) fn check(root: &Root) -> Result<Option<String>> {
    for (name, advice) in REFUSED {
        if root.extensions_required.iter().any(|required| required == name) {
            return Err(Error::new(format!(
                "the extension {name} is required and not read; {advice}"
            )));
        }
    }
    let is_known = |name: &&String| HARMLESS.iter().any(|known| name.starts_with(known));
    let mut unknown = root.extensions_required.iter().filter(|name| !is_known(name));
    Ok(unknown.next().map(|name| {
        let name: String = name.chars().take(60).collect();
        let others = unknown.count();
        let more = if others > 0 { format!(" and {others} others are") } else { " is".to_owned() };
        format!(
            "the extension {}{more} required and not known: what it changes is missing",
            name.escape_debug()
        )
    }))
}
