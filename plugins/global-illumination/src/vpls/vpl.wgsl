// Virtual point lights: places that reflect light which has arrived there.
//
// Lengths are in units of the scene's extent, so that squares stay in the range of f32; positions
// are from the scene's origin, world-oriented.
#define_import_path gi::vpl

#import gi::material::Material

struct Vpl {
    position: vec3<f32>,
    // The surfel that it lies on, plus one; 0 where that is not known.
    surfel: u32,
    // Unit, on the side that is lit.
    normal: vec3<f32>,
    // Cosine of the angle between the normal and where its light comes from.
    cosine: f32,
    // Flux that arrives over pi: the radiance of a white surface there, times its squared extents.
    flux: vec3<f32>,
    // 1 where there is one.
    valid: u32,
    // Linear Rec. 709.
    albedo: vec3<f32>,
    pad: u32,
    // Unit vector to where its light comes from.
    incoming: vec3<f32>,
    more: u32,
}

// The diffuse part of a light, which all pixels need: a few words, since every pixel reads them for many lights.
struct DiffuseVpl {
    // As of the light.
    position: vec3<f32>,
    valid: u32,
    normal: vec3<f32>,
    // Cosine to where its light comes from.
    cosine: f32,
    // What a diffuse surface sends on.
    diffuse: vec3<f32>,
    pad: u32,
}

// The specular part of a light, which pixels need besides where surfaces have highlights.
struct SpecularVpl {
    flux: vec3<f32>,
    pad: u32,
    incoming: vec3<f32>,
    more: u32,
}

// Nearest to grazing that arriving light counts for highlights, which divide by the cosine.
const LEAST_COSINE: f32 = 0.05;

fn none() -> Vpl {
    return Vpl(
        vec3(0.0), 0u, vec3(0.0, 0.0, 1.0), 1.0, vec3(0.0), 0u, vec3(0.0), 0u, vec3(0.0, 0.0, 1.0), 0u,
    );
}

// What is left of 1 / d^2 near a light, `square` being d^2: a light that is a disc of the radius r,
// 1 / (d^2 + r^2), or one that is bounded, 1 / max(d^2, r^2).
//
// Source: erratum P7.
fn bounded_falloff(square: f32, radius_squared: f32, bounded: u32) -> f32 {
    if bounded == 1u {
        return 1.0 / max(square, radius_squared);
    }
    return 1.0 / (square + radius_squared);
}
