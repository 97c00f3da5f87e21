// Surfels beside the splats: Lambert's law.
#import surfelshop::surface::Surface
#import surfelshop::light

fn shade(s: Surface) -> vec4<f32> {
    let arriving = light::diffuse_irradiance_at(s.position, s.normal) + 0.08;
    return vec4(s.albedo * arriving, 1.0);
}
