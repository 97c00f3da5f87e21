// The lighting of the thesis's appendix over the blended surface.
#import surfelshop::surface::Surface
#import surfelshop::light
#import surfelshop::occlusion
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
    var radiance = s.albedo * settings.ambient * left(s, occlusion::AMBIENT);
    let diffuse = s.albedo * settings.diffuse * left(s, occlusion::DIFFUSE);
    let specular = settings.specular * left(s, occlusion::HIGHLIGHTS);
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::lights.items[i];
        let cosine = max(dot(s.normal, source.towards), 0.0);
        let highlight =
            phong::half_vector_highlight(s.normal, source.towards, s.to_eye, settings.shininess);
        radiance += source.radiance * (diffuse * cosine + specular * highlight);
    }
    return vec4(radiance, 1.0);
}

fn left(s: Surface, part: u32) -> f32 {
    return occlusion::share(s.ao, settings.ao_strength, part, settings.ao_affects);
}
