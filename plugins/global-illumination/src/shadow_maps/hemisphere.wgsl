// The hemisphere over a point as a square map: the paraboloid, s = tan(angle / 2) from the middle.
//
// It is conformal: a circle of directions stays a circle, and a texel of side `ds` takes in
// 4 ds^2 / (1 + s^2)^2 steradians.
//
// Source: Brabec et al. 2002, "Shadow Mapping for Hemispherical and Omnidirectional Light Sources";
// erratum P2.
#define_import_path gi::hemisphere

// Two directions at right angles to a third, unit length.
struct Axes {
    across: vec3<f32>,
    along: vec3<f32>,
    up: vec3<f32>,
}

// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
fn axes_around(n: vec3<f32>) -> Axes {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let across = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
    return Axes(across, vec3(b, s + n.y * n.y * a, -n.y), n);
}

fn to_local(axes: Axes, v: vec3<f32>) -> vec3<f32> {
    return vec3(dot(v, axes.across), dot(v, axes.along), dot(v, axes.up));
}

fn from_local(axes: Axes, v: vec3<f32>) -> vec3<f32> {
    return axes.across * v.x + axes.along * v.y + axes.up * v.z;
}

// Where a unit direction lies in the map, -1 to 1; within the unit circle where it points up.
fn place_of(direction: vec3<f32>) -> vec2<f32> {
    return direction.xy / max(1.0 + direction.z, 1e-4);
}

// The texel of a place in a map of `side` texels, the outermost one beyond it.
fn texel_of(place: vec2<f32>, side: u32) -> vec2<i32> {
    let texel = floor((place * 0.5 + 0.5) * f32(side));
    return vec2<i32>(clamp(texel, vec2(0.0), vec2(f32(side) - 1.0)));
}

// The place of a texel's centre.
fn center_of(texel: vec2<i32>, side: u32) -> vec2<f32> {
    return (vec2<f32>(texel) + 0.5) / f32(side) * 2.0 - 1.0;
}

// The angle, radians, that a texel at a place is wide in a map of `side` texels.
fn width_at(place: vec2<f32>, side: u32) -> f32 {
    return 4.0 / (f32(side) * (1.0 + dot(place, place)));
}
