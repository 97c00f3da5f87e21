// The lighting of the thesis's baseline, and its highlights, stable up to any exponent and at every
// angle.
#define_import_path surfelshop::phong

#import surfelshop::surface::Surface
#import surfelshop::light
#import surfelshop::occlusion

// Whether surfaces have highlights: a feature of the pass. Where they have none, `Material::specular` is 0.
override HIGHLIGHTS: bool = true;

fn has_highlights() -> bool {
    return HIGHLIGHTS;
}

// cos(angle)^exponent for the angle between the normal and the half vector of two unit vectors;
// 0 where the light is behind the surface.
//
// The power is exp2(m log2 c) with c > 0, and the cosine is taken through the sine of the angle,
// which the cross product keeps precise near 1, where an exponent of 1024 needs it.
//
// Source: Liu 2006, appendix (Phong lighting shader); extreme cases "exponent 1024",
// "H with L = -E" and "pow(0,0)".
fn half_vector_highlight(
    normal: vec3<f32>,
    to_light: vec3<f32>,
    to_eye: vec3<f32>,
    exponent: f32,
) -> f32 {
    let sum = to_light + to_eye;
    let length_squared = dot(sum, sum);
    let half_vector = sum * inverseSqrt(max(length_squared, 1e-12));
    let sine = cross(normal, half_vector);
    let cosine_squared = 1.0 - dot(sine, sine);
    let is_lit = length_squared >= 1e-12
        && dot(normal, to_light) > 0.0
        && dot(normal, half_vector) > 0.0;
    return select(0.0, power_of_cosine(cosine_squared, exponent), is_lit);
}

// The power of a cosine whose square is given; 0 where that is not above 0. Without branches: drivers of processors
// take both sides of them anyway.
fn power_of_cosine(cosine_squared: f32, exponent: f32) -> f32 {
    // A cosine's square from a sine's is a multiple of 2^-24.
    let power = exp2(0.5 * exponent * log2(max(cosine_squared, 1e-30)));
    return select(0.0, power, cosine_squared > 0.0);
}

// cos(angle)^exponent for the angle between the light and the eye's mirror image, of unit vectors; 0
// where the light is behind the surface.
//
// Source: Liu 2006, section 5.1 (`reflect(-viewVec, normal)`).
fn mirrored_highlight(
    normal: vec3<f32>,
    to_light: vec3<f32>,
    to_eye: vec3<f32>,
    exponent: f32,
) -> f32 {
    let mirrored = reflect(-to_eye, normal);
    let sine = cross(mirrored, to_light);
    let is_lit = dot(normal, to_light) > 0.0 && dot(mirrored, to_light) > 0.0;
    return select(0.0, power_of_cosine(1.0 - dot(sine, sine), exponent), is_lit);
}

// What a surface is made of.
struct Material {
    // Linear Rec. 709.
    albedo: vec3<f32>,
    // Factor on the diffuse term.
    diffuse: f32,
    // Radiance of the highlight's peak under a white light.
    specular: vec3<f32>,
    // Exponent of the highlight.
    shininess: f32,
    // Radiance of an unlit white surface.
    ambient: f32,
    // How much of the ambient occlusion counts, and the last part of the light that it darkens.
    ao_strength: f32,
    ao_affects: u32,
}

// The parameters of Phong lighting and of ambient occlusion as a uniform.
//
// Twins: `Phong` and `Occlusion` of the plugin interface.
struct Settings {
    diffuse: f32,
    specular: f32,
    shininess: f32,
    ambient: f32,
    ao_strength: f32,
    ao_affects: u32,
}

// The material of a surface under these settings.
fn material(s: Surface, p: Settings) -> Material {
    return Material(
        s.albedo, p.diffuse, vec3(p.specular), p.shininess, p.ambient, p.ao_strength, p.ao_affects,
    );
}

// Diffuse light and half-vector highlights of all lights, and the same light from everywhere.
fn lit(s: Surface, m: Material) -> vec3<f32> {
    var radiance = m.albedo * m.ambient * left(s, m, occlusion::AMBIENT);
    let matte = m.albedo * m.diffuse * left(s, m, occlusion::DIFFUSE);
    var shine = vec3(0.0);
    if HIGHLIGHTS {
        shine = m.specular * left(s, m, occlusion::HIGHLIGHTS);
    }
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::arriving(i, s.position);
        let cosine = max(dot(s.normal, source.towards), 0.0);
        var reflected = matte * cosine;
        if HIGHLIGHTS {
            let to_light = source.towards;
            reflected += shine * half_vector_highlight(s.normal, to_light, s.to_eye, m.shininess);
        }
        radiance += source.radiance * reflected;
        if light::is_alone() {
            break;
        }
    }
    return radiance;
}

fn left(s: Surface, m: Material, part: u32) -> f32 {
    if occlusion::counts() {
        return occlusion::share(s.ao, m.ao_strength, part, m.ao_affects);
    }
    return 1.0;
}
