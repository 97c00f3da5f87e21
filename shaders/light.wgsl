// The scene's lights.
#define_import_path surfelshop::light

const MAX_LIGHTS = 8;

struct Light {
    // Unit vector towards the light, world-oriented.
    towards: vec3<f32>,
    // Linear Rec. 709: what a white diffuse surface facing the light radiates.
    radiance: vec3<f32>,
}

struct Lights {
    items: array<Light, MAX_LIGHTS>,
    count: u32,
}

@group(0) @binding(1) var<uniform> lights: Lights;

// What a white diffuse surface radiates under all lights, unshadowed.
fn diffuse_irradiance(normal: vec3<f32>) -> vec3<f32> {
    var sum = vec3(0.0);
    for (var i = 0u; i < lights.count; i++) {
        sum += lights.items[i].radiance * max(dot(normal, lights.items[i].towards), 0.0);
    }
    return sum;
}
