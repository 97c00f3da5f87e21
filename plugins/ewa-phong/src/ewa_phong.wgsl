#import surfelshop::surface::Surface
#import surfelshop::phong

var<uniform> settings: phong::Settings;

fn shade(s: Surface) -> vec4<f32> {
    return vec4(phong::lit(s, phong::material(s, settings)), 1.0);
}
