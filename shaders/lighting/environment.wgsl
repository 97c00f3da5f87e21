// The light around the scene, by direction.
//
// Its pixels are an octahedral map whose outermost texel centres lie on the map's border, where
// each meets the mirrored texel of the same direction with the same value: a sampler that stays
// inside interpolates without a seam. Every mip level is such a map of its own size.
#define_import_path surfelshop::environment

#import surfelshop::packing

struct Environment {
    probe_from_world: mat3x3<f32>,
    // Radiance, linear Rec. 709, of a stored 1; 0 where the scene has no environment.
    radiance_per_unit: f32,
    // Number of the smallest mip level.
    last_level: f32,
}

@group(0) @binding(4) var<uniform> environment: Environment;
@group(0) @binding(5) var environment_map: texture_2d<f32>;
@group(0) @binding(6) var environment_sampler: sampler;

// Turns a world direction to the axes of the probe.
fn probe_from_world(direction: vec3<f32>) -> vec3<f32> {
    return environment.probe_from_world * direction;
}

// Where a direction of probe space, of any length but 0, lies in a level of `side` texels: texture
// coordinates.
fn place(direction: vec3<f32>, side: f32) -> vec2<f32> {
    let p = packing::octahedral_encode(direction);
    return ((p * 0.5 + 0.5) * (side - 1.0) + 0.5) / side;
}

// The direction, probe space, unit length, of a texel of a level of `side` texels.
fn direction_of(texel: vec2<u32>, side: f32) -> vec3<f32> {
    return packing::octahedral_decode(vec2<f32>(texel) / (side - 1.0) * 2.0 - 1.0);
}

// Stored light in a direction of probe space, between mip levels.
fn stored(direction: vec3<f32>, level: f32) -> vec3<f32> {
    let l = clamp(level, 0.0, environment.last_level);
    let low = floor(l);
    let low_side = f32(textureDimensions(environment_map, u32(low)).x);
    let fine = textureSampleLevel(environment_map, environment_sampler, place(direction, low_side), low).rgb;
    // Both levels always, also where one would do: Mesa 22.3's lavapipe crashes over some branches
    // around a sample.
    let high = min(low + 1.0, environment.last_level);
    let high_side = f32(textureDimensions(environment_map, u32(high)).x);
    let coarse = textureSampleLevel(
        environment_map, environment_sampler, place(direction, high_side), high,
    ).rgb;
    return mix(fine, coarse, l - low);
}

// The level whose texels are as large as this solid angle, steradians.
fn level_of_solid_angle(solid_angle: f32) -> f32 {
    let side = f32(textureDimensions(environment_map, 0).x);
    // A level has 4 pi / side^2 per texel, on average, four times as much as the one before.
    return 0.5 * log2(solid_angle * side * side * 0.0795774715);
}

// Radiance, linear Rec. 709, that arrives from a world direction; 0 without an environment.
fn radiance(direction: vec3<f32>, level: f32) -> vec3<f32> {
    return stored(probe_from_world(direction), level) * environment.radiance_per_unit;
}
