#import surfelshop::surface::Surface
#import surfelshop::light

struct Settings {
    ambient: f32,
    ink: f32,
    width: u32,
}

var<uniform> settings: Settings;

// Linear radiance of a covered pixel, before exposure and tone mapping.
fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance_at(s.position, s.normal);
    return vec4(s.albedo * (arriving + settings.ambient), 1.0);
}
