// Spherical harmonics as polynomials of a unit direction.
//
// Real, ordered l (l + 1) + m, without the Condon-Shortley sign: the same as
// `surfelshop_geometry::harmonics`.
//
// Source: Ramamoorthi & Hanrahan 2001, equation 3; the grouping of Liu 2006, table 1, with errata
// T3 to T6.
#define_import_path surfelshop::sh

// Three channels up to order 2: the factors of (x, y, z, 1), of (xy, yz, zz, zx) and of xx - yy.
struct Order2 {
    linear_r: vec4<f32>,
    linear_g: vec4<f32>,
    linear_b: vec4<f32>,
    quadratic_r: vec4<f32>,
    quadratic_g: vec4<f32>,
    quadratic_b: vec4<f32>,
    difference: vec4<f32>,
}

fn order_2(n: vec3<f32>, c: Order2) -> vec3<f32> {
    let n1 = vec4(n, 1.0);
    let n2 = n.xyzz * n.yzzx;
    return vec3(dot(c.linear_r, n1), dot(c.linear_g, n1), dot(c.linear_b, n1))
        + vec3(dot(c.quadratic_r, n2), dot(c.quadratic_g, n2), dot(c.quadratic_b, n2))
        + c.difference.xyz * (n.x * n.x - n.y * n.y);
}

// The nine functions of order 4, m from -4 to 4.
fn band_4(n: vec3<f32>) -> array<f32, 9> {
    let s = n * n;
    return array<f32, 9>(
        2.5033429 * n.x * n.y * (s.x - s.y),
        1.7701308 * n.y * n.z * (3.0 * s.x - s.y),
        0.9461747 * n.x * n.y * (7.0 * s.z - 1.0),
        0.6690465 * n.y * n.z * (7.0 * s.z - 3.0),
        0.1057855 * (35.0 * s.z * s.z - 30.0 * s.z + 3.0),
        0.6690465 * n.x * n.z * (7.0 * s.z - 3.0),
        0.4730873 * (s.x - s.y) * (7.0 * s.z - 1.0),
        1.7701308 * n.x * n.z * (s.x - 3.0 * s.y),
        0.6258357 * (s.x * s.x - 6.0 * s.x * s.y + s.y * s.y),
    );
}
