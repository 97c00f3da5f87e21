// Natural light, as by `environment`.
#import surfelshop::surface::Surface
#import shading::natural::Material
#import shading::natural
#import phong_splats::settings

// A dielectric, which reflects 4 % at a right angle.
const IOR = 1.5;
const F0 = 0.04;

fn material(s: Surface) -> Material {
    return Material(s.albedo, settings.diffuse, 1.0, IOR, F0, settings.roughness, settings.metallic);
}

fn shade_natural(s: Surface) -> vec4<f32> {
    return vec4(natural::ggx(s, material(s)), 1.0);
}

// Without an environment the scene's lights shine.
fn shade_lights(s: Surface) -> vec4<f32> {
    return vec4(natural::by_lights(s, material(s)), 1.0);
}
