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

// Three channels of order 4 alone, coefficients by m from -4 to 4.
fn order_4_alone(n: vec3<f32>, c: array<vec4<f32>, 9>) -> vec3<f32> {
    let s = n * n;
    let seven = 7.0 * s.z;
    let across = s.x - s.y;
    return c[0].xyz * (2.5033429 * n.x * n.y * across)
        + c[1].xyz * (1.7701308 * n.y * n.z * (3.0 * s.x - s.y))
        + c[2].xyz * (0.9461747 * n.x * n.y * (seven - 1.0))
        + c[3].xyz * (0.6690465 * n.y * n.z * (seven - 3.0))
        + c[4].xyz * (0.1057855 * (35.0 * s.z * s.z - 30.0 * s.z + 3.0))
        + c[5].xyz * (0.6690465 * n.x * n.z * (seven - 3.0))
        + c[6].xyz * (0.4730873 * across * (seven - 1.0))
        + c[7].xyz * (1.7701308 * n.x * n.z * (s.x - 3.0 * s.y))
        + c[8].xyz * (0.6258357 * (across * across - 4.0 * s.x * s.y));
}
