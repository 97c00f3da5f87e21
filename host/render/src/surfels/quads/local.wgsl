// What varies over a surfel: the normals of a field, and the lines that cut it; put behind disc.wgsl.

#ifdef LOCAL
// A vector over its length, and one over that; zeros where it has none.
fn direction_and_inverse_length(v: vec3<f32>) -> vec4<f32> {
    // Largest component first: squares of small ones vanish.
    let size = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if !(size > 0.0) {
        return vec4(0.0);
    }
    let inverse = inverseSqrt(dot(v / size, v / size));
    return vec4(v / size * inverse, inverse / size);
}

// A disc that the low-pass widened, with where its points lie in the surfel: below them, at right
// angles to the surfel's plane, as a disc seen edge-on is widened out of that plane.
//
// Source: Botsch et al. 2004, "Phong Splatting", section 3, for points beside a splat's plane.
fn located(disc: Disc, own: Disc) -> Disc {
    let u = direction_and_inverse_length(own.axis_u);
    let v = direction_and_inverse_length(own.axis_v);
    // For half axes at any angle: each one's share of a vector, without the other's.
    let skew = dot(u.xyz, v.xyz);
    let upright = chunk.tangent_scale / max(1.0 - skew * skew, 1e-6);
    let along_u = (u.xyz - skew * v.xyz) * (u.w * upright);
    let along_v = (v.xyz - skew * u.xyz) * (v.w * upright);
    let moved = disc.center - own.center;
    var out = disc;
    out.own_center = vec2(dot(moved, along_u), dot(moved, along_v));
    out.own_u = vec2(dot(disc.axis_u, along_u), dot(disc.axis_u, along_v));
    out.own_v = vec2(dot(disc.axis_v, along_u), dot(disc.axis_v, along_v));
    return out;
}
#endif

#ifdef CLIP
// What cuts a disc, for points in units of the disc's half axes.
struct Cut {
    // A point p stays where the product with (p, 1) is not negative.
    first: vec3<f32>,
    second: vec3<f32>,
    // 0: nothing is cut off; 1: both lines cut; 2: only what both lines cut off is.
    kind: f32,
}

fn line_on_disc(line: vec3<f32>, disc: Disc) -> vec3<f32> {
    let z = dot(line.xy, disc.own_center) + line.z;
    return vec3(dot(line.xy, disc.own_u), dot(line.xy, disc.own_v), z);
}

fn load_cut(i: u32, disc: Disc) -> Cut {
    let at = 7u * i;
    let first = vec3(clip[at], clip[at + 1u], clip[at + 2u]);
    let second = vec3(clip[at + 3u], clip[at + 4u], clip[at + 5u]);
    return Cut(line_on_disc(first, disc), line_on_disc(second, disc), clip[at + 6u]);
}

// How far a point is from both lines, on the side that stays, and which of them count.
fn sides_of(cut: Cut, at: vec2<f32>) -> vec3<f32> {
    return vec3(dot(cut.first, vec3(at, 1.0)), dot(cut.second, vec3(at, 1.0)), cut.kind);
}

fn is_cut_off(sides: vec3<f32>) -> bool {
    let either = max(sides.x, sides.y);
    let both = min(sides.x, sides.y);
    return sides.z > 0.5 && select(both, either, sides.z > 1.5) < 0.0;
}
#endif

#ifdef FIELD
// The normals of a disc, not of unit length: linear in units of the disc's half axes. World-oriented,
// turned to the side that is seen.
struct NormalField {
    center: vec3<f32>,
    along_u: vec3<f32>,
    along_v: vec3<f32>,
}

// What a pixel sees of a field is its mean under the pixel's filter: for Gaussians the field's slope
// shrinks by the share of the variance that is the surfel's own.
fn load_field(i: u32, disc: Disc) -> NormalField {
    let u = direction_and_inverse_length(vec3(tangent_u[3u * i], tangent_u[3u * i + 1u], tangent_u[3u * i + 2u])).xyz;
    let v = direction_and_inverse_length(vec3(tangent_v[3u * i], tangent_v[3u * i + 1u], tangent_v[3u * i + 2u])).xyz;
    let given = load_normal(i);
    var plane = direction_and_inverse_length(cross(u, v)).xyz;
    if all(plane == vec3(0.0)) {
        plane = given;
    }
    let f = vec4(normal_field[4u * i], normal_field[4u * i + 1u], normal_field[4u * i + 2u], normal_field[4u * i + 3u]);
    let side = select(1.0, -1.0, (disc.back == 1u) != (dot(plane, given) < 0.0));
    let kept = side * disc.kept * disc.kept;
    let du = f.z * u;
    let dv = f.w * v;
    return NormalField(
        side * (plane + f.x * u + f.y * v),
        kept.x * (disc.own_u.x * du + disc.own_u.y * dv),
        kept.y * (disc.own_v.x * du + disc.own_v.y * dv),
    );
}

// Not of unit length, and never zero: its part along the plane's normal is 1.
fn normal_on(field: NormalField, at: vec2<f32>) -> vec3<f32> {
    return field.center + at.x * field.along_u + at.y * field.along_v;
}
#endif
