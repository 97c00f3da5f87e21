// The same in natural light; a text of its own, so that nothing of it is bound where there is none.
#import surfelshop::surface::Surface
#import procedural::shown::{look_of, shown}
#import procedural::pattern::Look
#import shading::natural::Material
#import shading::natural

// A dielectric like stone, varnish or paint, which reflects 4 % at a right angle.
const IOR = 1.5;
const F0 = 0.04;

fn material(m: Look) -> Material {
    let ks = mix(min(shown.specular * m.specular, 1.0), 1.0, m.metallic);
    return Material(min(m.albedo, vec3(1.0)), 1.0, ks, IOR, F0, m.roughness, m.metallic);
}

fn shade_natural(s: Surface) -> vec4<f32> {
    return vec4(natural::ggx(s, material(look_of(s))), 1.0);
}

// Without an environment the scene's lights shine.
fn shade_lights(s: Surface) -> vec4<f32> {
    return vec4(natural::by_lights(s, material(look_of(s))), 1.0);
}
