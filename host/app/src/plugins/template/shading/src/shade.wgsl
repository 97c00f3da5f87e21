#import surfelshop::surface::Surface
#import surfelshop::light
#import params::settings

// Linear radiance of a covered pixel, before exposure and tone mapping.
fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance_at(s.position, s.normal);
    let turned_away = 1.0 - clamp(dot(s.normal, s.to_eye), 0.0, 1.0);
    return vec4(s.albedo * arriving + settings.rim * pow(turned_away, settings.sharpness), 1.0);
}
