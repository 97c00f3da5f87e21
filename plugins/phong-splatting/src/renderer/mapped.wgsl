// The scene's lights, looked up by the normal.
#import surfelshop::surface::Surface
#import surfelshop::occlusion
#import surfelshop::packing
#import surfelshop::phong
#import phong_splats::settings

// See map.wgsl.
var diffuse_map: texture_2d<f32>;
var highlight_map: texture_2d<f32>;
var map_sampler: sampler;

fn left(s: Surface, part: u32) -> f32 {
    if occlusion::counts() {
        return occlusion::share(s.ao, settings.ao_strength, part, settings.ao_affects);
    }
    return 1.0;
}

fn shade(s: Surface) -> vec4<f32> {
    let side = f32(textureDimensions(diffuse_map).x);
    let at = ((0.5 * packing::octahedral_encode(s.normal) + 0.5) * (side - 1.0) + 0.5) / side;
    let diffuse = textureSampleLevel(diffuse_map, map_sampler, at, 0.0).rgb;
    var radiance = s.albedo * settings.ambient * left(s, occlusion::AMBIENT)
        + s.albedo * diffuse * (settings.diffuse * left(s, occlusion::DIFFUSE));
    if phong::has_highlights() {
        let highlight = textureSampleLevel(highlight_map, map_sampler, at, 0.0).rgb;
        radiance += highlight * (settings.specular * left(s, occlusion::HIGHLIGHTS));
    }
    return vec4(radiance, 1.0);
}
