// Lambert's law with the surfel's own normal.
#import surfelshop::surface::Surface
#import surfelshop::light
#import surfelshop::occlusion

struct Settings {
    ambient: f32,
    ao_strength: f32,
    ao_affects: u32,
}

var<uniform> settings: Settings;

fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance_at(s.position, s.normal) * left(s, occlusion::DIFFUSE)
        + settings.ambient * left(s, occlusion::AMBIENT);
    return vec4(s.albedo * arriving, 1.0);
}

fn left(s: Surface, part: u32) -> f32 {
    if occlusion::counts() {
        return occlusion::share(s.ao, settings.ao_strength, part, settings.ao_affects);
    }
    return 1.0;
}
