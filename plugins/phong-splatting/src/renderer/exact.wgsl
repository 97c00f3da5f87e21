// The scene's lights, computed for each pixel as by `ewa-phong`.
#import surfelshop::surface::Surface
#import surfelshop::phong

struct Settings {
    diffuse: f32,
    specular: f32,
    shininess: f32,
    ambient: f32,
    ao_strength: f32,
    ao_affects: u32,
}

var<uniform> settings: Settings;

fn shade(s: Surface) -> vec4<f32> {
    let p = settings;
    let material = phong::Material(
        s.albedo, p.diffuse, vec3(p.specular), p.shininess, p.ambient, p.ao_strength, p.ao_affects,
    );
    return vec4(phong::lit(s, material), 1.0);
}
