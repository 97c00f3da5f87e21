// Natural light on a surface of one material everywhere.
#import surfelshop::surface::Surface
#import surfelshop::environment
#import surfelshop::view
#import shading::natural::Material
#import shading::natural

struct Settings {
    kd: f32,
    ks: f32,
    // Index of refraction, and what it reflects at a right angle.
    ior: f32,
    f0: f32,
    // Thesis model: eccentricity. GGX: roughness.
    spread: f32,
    metallic: f32,
    // Level of the environment for the background.
    background_level: f32,
}

var<uniform> settings: Settings;

override IS_BLURRED: bool = false;

fn material(s: Surface) -> Material {
    return Material(
        s.albedo, settings.kd, settings.ks, settings.ior, settings.f0, settings.spread, settings.metallic,
    );
}

fn shade_lights(s: Surface) -> vec4<f32> {
    return vec4(natural::by_lights(s, material(s)), 1.0);
}

fn shade_diffuse(s: Surface) -> vec4<f32> {
    return vec4(natural::matte(s, material(s)), 1.0);
}

fn shade_specular_thesis(s: Surface) -> vec4<f32> {
    return vec4(natural::shiny_thesis(s, material(s)), 1.0);
}

fn shade_thesis(s: Surface) -> vec4<f32> {
    return vec4(natural::thesis(s, material(s)), 1.0);
}

fn shade_specular_ggx(s: Surface) -> vec4<f32> {
    return vec4(natural::shiny_ggx(s, material(s)), 1.0);
}

fn shade_ggx(s: Surface) -> vec4<f32> {
    return vec4(natural::ggx(s, material(s)), 1.0);
}

// The environment around a direction, without the edges of its coarse texels: a mean of nine
// places a texel apart, weighted like a tent.
fn out_of_focus(direction: vec3<f32>) -> vec3<f32> {
    let level = settings.background_level;
    let side = f32(textureDimensions(environment::environment_map, 0).x) / exp2(level);
    // Four texels span a right angle's half in each direction, about.
    let step = 3.2 / side;
    let axis = select(vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0), abs(direction.y) > 0.9);
    let u = normalize(cross(axis, direction));
    let v = cross(direction, u);
    let a = step * (u + v);
    let b = step * (u - v);
    let near = environment::radiance(direction + step * u, level)
        + environment::radiance(direction - step * u, level)
        + environment::radiance(direction + step * v, level)
        + environment::radiance(direction - step * v, level);
    let corners = environment::radiance(direction + a, level)
        + environment::radiance(direction - a, level)
        + environment::radiance(direction + b, level)
        + environment::radiance(direction - b, level);
    return 0.25 * environment::radiance(direction, level) + 0.125 * near + 0.0625 * corners;
}

fn background(pixel: vec2<u32>) -> vec4<f32> {
    let away = -view::to_eye_in_view(view::position_in_view(vec2<f32>(pixel) + 0.5, 1.0));
    let direction = view::world_from_view_direction(away);
    var light_from_there = environment::radiance(direction, settings.background_level);
    if IS_BLURRED {
        light_from_there = out_of_focus(direction);
    }
    return vec4(light_from_there, 1.0);
}
