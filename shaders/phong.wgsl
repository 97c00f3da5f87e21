// The half-vector highlight, stable up to any exponent and at every angle.
#define_import_path surfelshop::phong

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
    if length_squared < 1e-12 || dot(normal, to_light) <= 0.0 {
        return 0.0;
    }
    let half_vector = sum * inverseSqrt(length_squared);
    if dot(normal, half_vector) <= 0.0 {
        return 0.0;
    }
    let sine = cross(normal, half_vector);
    let cosine_squared = max(1.0 - dot(sine, sine), 0.0);
    if cosine_squared <= 0.0 {
        return 0.0;
    }
    return exp2(0.5 * exponent * log2(cosine_squared));
}
