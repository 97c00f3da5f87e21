// A pattern under the scene's lights.
#import surfelshop::surface::Surface
#import surfelshop::light
#import surfelshop::occlusion
#import surfelshop::phong
#import procedural::shown::{look_of, shown}

// The Phong exponent of a highlight as wide as the microfacets' lobe of a roughness.
//
// Source: Walter et al. 2007, with alpha the square of the roughness.
fn exponent_of(roughness: f32) -> f32 {
    let alpha = max(roughness * roughness, 0.03);
    return max(2.0 / (alpha * alpha) - 2.0, 1.0);
}

fn left(s: Surface, part: u32) -> f32 {
    if occlusion::counts() {
        return occlusion::share(s.ao, shown.ao_strength, part, shown.ao_affects);
    }
    return 1.0;
}

// The thesis's own: light reaches round to the far side.
//
// Source: Liu 2006, section 5.1; the light vector points to the light (erratum T27).
fn shade_thesis(s: Surface) -> vec4<f32> {
    let m = look_of(s);
    let diffuse = m.albedo * left(s, occlusion::DIFFUSE);
    var highlight = vec3(0.0);
    if phong::has_highlights() {
        highlight = mix(vec3(1.0), m.albedo, m.metallic)
            * (0.5 * shown.specular * m.specular * left(s, occlusion::HIGHLIGHTS));
    }
    let exponent = exponent_of(m.roughness);
    var radiance = vec3(0.0);
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::arriving(i, s.position);
        let wrapped = 0.5 * dot(s.normal, source.towards) + 0.5;
        var reflected = diffuse * wrapped;
        if phong::has_highlights() {
            let to_light = source.towards;
            reflected += highlight * phong::mirrored_highlight(s.normal, to_light, s.to_eye, exponent);
        }
        radiance += source.radiance * reflected;
        if light::is_alone() {
            break;
        }
    }
    return vec4(radiance, 1.0);
}

// As `ewa-phong` lights.
fn shade_phong(s: Surface) -> vec4<f32> {
    let m = look_of(s);
    let highlight = mix(vec3(1.0), m.albedo, m.metallic) * (0.5 * shown.specular * m.specular);
    let material = phong::Material(
        m.albedo, 1.0, highlight, exponent_of(m.roughness), shown.ambient, shown.ao_strength, shown.ao_affects,
    );
    return vec4(phong::lit(s, material), 1.0);
}

// The pattern itself.
fn shade_look(s: Surface) -> vec4<f32> {
    return vec4(look_of(s).albedo, 1.0);
}
