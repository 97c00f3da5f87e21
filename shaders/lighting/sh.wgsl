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

// The only function of order 0.
const ORDER_0: f32 = 0.28209479;

// Three channels of order 1 alone: red, green and blue of each coefficient, by m from -1 to 1.
fn rgb_of_order_1(n: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    return 0.48860251 * (a * n.y + b * n.z + c * n.x);
}

// Three channels of order 2 alone, in the same way by m from -2 to 2.
fn rgb_of_order_2(
    n: vec3<f32>,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    d: vec3<f32>,
    e: vec3<f32>,
) -> vec3<f32> {
    return a * (1.0925484 * n.x * n.y)
        + b * (1.0925484 * n.y * n.z)
        + c * (0.31539157 * (3.0 * n.z * n.z - 1.0))
        + d * (1.0925484 * n.x * n.z)
        + e * (0.54627422 * (n.x * n.x - n.y * n.y));
}

// Three channels of order 3 alone, in the same way by m from -3 to 3.
fn rgb_of_order_3(
    n: vec3<f32>,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    d: vec3<f32>,
    e: vec3<f32>,
    f: vec3<f32>,
    g: vec3<f32>,
) -> vec3<f32> {
    let s = n * n;
    let five = 5.0 * s.z - 1.0;
    return a * (0.59004359 * n.y * (3.0 * s.x - s.y))
        + b * (2.8906114 * n.x * n.y * n.z)
        + c * (0.45704580 * n.y * five)
        + d * (0.37317633 * n.z * (five - 2.0))
        + e * (0.45704580 * n.x * five)
        + f * (1.4453057 * n.z * (s.x - s.y))
        + g * (0.59004359 * n.x * (s.x - 3.0 * s.y));
}
