// Lambert's law with the surfel's own normal.
#import surfelshop::surface::Surface
#import surfelshop::light

struct Settings {
    ambient: f32,
}

var<uniform> settings: Settings;

fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance(s.normal) + settings.ambient * s.ao;
    return vec4(s.albedo * arriving, 1.0);
}
