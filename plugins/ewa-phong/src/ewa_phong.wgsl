// The lighting of the thesis's appendix over the blended surface.
#import surfelshop::surface::Surface
#import surfelshop::light
#import surfelshop::phong

struct Settings {
    diffuse: f32,
    specular: f32,
    shininess: f32,
    ambient: f32,
}

var<uniform> settings: Settings;

fn shade(s: Surface) -> vec4<f32> {
    var radiance = s.albedo * settings.ambient * s.ao;
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::lights.items[i];
        let cosine = max(dot(s.normal, source.towards), 0.0);
        let highlight =
            phong::half_vector_highlight(s.normal, source.towards, s.to_eye, settings.shininess);
        radiance += source.radiance
            * (s.albedo * settings.diffuse * cosine + settings.specular * highlight);
    }
    return vec4(radiance, 1.0);
}
