#import surfelshop::surface::Surface
#import surfelshop::light
#import params::settings

// Linear radiance of a covered pixel, before exposure and tone mapping.
fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance_at(s.position, s.normal);
    return vec4(s.albedo * (arriving + settings.ambient), 1.0);
}
