// Light views: the scene's lights as cameras. Their depths are shadow maps, and a part of what they see
// is the light surface buffer.
#define_import_path gi::light_views

// One face of a light view: all of what a spot or a directional light sees, or a sixth of a point light's.
struct Face {
    // World axes of its picture.
    right: vec3<f32>,
    // Which of the scene's lights it belongs to.
    light_index: u32,
    up: vec3<f32>,
    // Half its width: a tangent, or units of the extent where it is parallel.
    half_extent: f32,
    backward: vec3<f32>,
    // 1 where its rays are parallel.
    is_parallel: u32,
    // Where it stands as seen from the eye, world-oriented, units of the extent.
    from_eye: vec3<f32>,
    // Share of the picture's half width that belongs to it alone; what lies beyond is another face's.
    own: f32,
}

const MOST_FACES = 48;

struct Faces {
    items: array<Face, MOST_FACES>,
    count: u32,
    // Texels on a side of a face.
    side: u32,
    // One over the scene's extent: what positions in scene units are multiplied with.
    per_extent: f32,
    // Texels on a side of a face of the light surface buffer.
    lit_side: u32,
    // Which texel one of these is: the chosen one of its block, another one in the next frame.
    chosen: vec2<u32>,
    // Texels on a side of a block.
    block: u32,
}

// What a texel of a face sees, for the block around it.
struct Texel {
    // From the scene's origin, world-oriented, units of the extent.
    position: vec3<f32>,
    // Flux that would arrive over the light's colour if the block saw this; 0 where nothing is seen.
    flux: f32,
    normal: u32,
    albedo_rg: u32,
    albedo_b: u32,
    pad: u32,
}

// Cells on a side of a face's importance, and all levels above them.
const CELLS = 64u;
const PYRAMID = 5461u;

// First cell of a level in a face's pyramid; level 0 has 64 x 64.
fn first_of_level(level: u32) -> u32 {
    // 4096 (1 - 1/4^level) 4/3.
    return (16384u - (16384u >> (2u * level))) / 3u;
}
