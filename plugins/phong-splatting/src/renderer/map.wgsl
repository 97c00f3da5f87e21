// What arrives on surfaces of every direction in the middle of the scene.
//
// Source: Botsch et al. 2004, section 4.1: light that does not depend on the surface's colour.
#import surfelshop::light
#import surfelshop::phong
#import surfelshop::packing

struct Settings {
    // The middle of the scene from the eye, world-oriented, scene units.
    middle: vec3<f32>,
    shininess: f32,
    // Unit vector from there to the eye.
    to_eye: vec3<f32>,
    // Texels along the map.
    side: f32,
}

var<uniform> settings: Settings;

struct Light {
    // What a white diffuse surface radiates.
    @location(0) diffuse: vec4<f32>,
    // What a highlight of peak 1 radiates.
    @location(1) highlight: vec4<f32>,
}

// Largest finite number of the maps.
const MOST = 65504.0;

// Texels' outermost centres lie on the border of the octahedron's square, so that what is looked up
// between texels never lies across its fold.
@fragment
fn fill(@builtin(position) p: vec4<f32>) -> Light {
    let last = settings.side - 1.0;
    let normal = packing::octahedral_decode(2.0 * (p.xy - 0.5) / last - 1.0);
    var diffuse = vec3(0.0);
    var highlight = vec3(0.0);
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::arriving(i, settings.middle);
        diffuse += source.radiance * max(dot(normal, source.towards), 0.0);
        if phong::has_highlights() {
            let to_light = source.towards;
            highlight += source.radiance
                * phong::half_vector_highlight(normal, to_light, settings.to_eye, settings.shininess);
        }
    }
    return Light(vec4(min(diffuse, vec3(MOST)), 1.0), vec4(min(highlight, vec3(MOST)), 1.0));
}
