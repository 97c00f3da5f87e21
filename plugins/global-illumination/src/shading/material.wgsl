// What surfaces do with light: diffuse, and a highlight around the half vector, as `ewa-phong` has them
// and `reference` with the model `phong`.
#define_import_path gi::material

#import surfelshop::phong

// Whether surfaces have highlights: a feature of the pass.
override SHINES: bool = true;

fn shines() -> bool {
    return SHINES;
}

struct Material {
    // Factor on the albedo.
    diffuse: f32,
    // Radiance of the highlight's peak under a white light.
    specular: f32,
    // Exponent of the highlight.
    shininess: f32,
    // Index of refraction by which highlights grow towards grazing angles; 1 is none of it.
    ior: f32,
}

// Factor of Schlick's approximation, relative to 1 at grazing angles; 1 where there is no index.
fn fresnel(m: Material, cosine: f32) -> f32 {
    if m.ior <= 1.0 {
        return 1.0;
    }
    let root = (m.ior - 1.0) / (m.ior + 1.0);
    let straight = root * root;
    let c = 1.0 - clamp(cosine, 0.0, 1.0);
    let square = c * c;
    return straight + (1.0 - straight) * square * square * c;
}

// The highlight that a light of some extent leaves: `variance` is that of the directions to it, radians
// squared. A lobe cos^m has the variance 1 / m around its axis, half vectors turn half as far as what
// they are halves of, and variances add; what the lobe gets wider it gets lower.
//
// It is what bounds the sparkle of lights that stand for a neighbourhood.
fn highlight(
    m: Material,
    normal: vec3<f32>,
    one: vec3<f32>,
    other: vec3<f32>,
    variance: f32,
) -> f32 {
    let widened = 1.0 / (1.0 / m.shininess + 0.25 * variance);
    let lobe = phong::half_vector_highlight(normal, one, other, widened);
    let half_vector = one + other;
    let cosine = dot(one, half_vector) * inverseSqrt(max(dot(half_vector, half_vector), 1e-12));
    return m.specular * lobe * widened / m.shininess * fresnel(m, cosine);
}
