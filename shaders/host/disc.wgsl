// One chunk of surfels and how a surfel is read from its columns; put in front of every shader that
// draws surfels.

#import surfelshop::view
#import surfelshop::packing

struct Chunk {
    // Rigid motion from the chunk's positions to view space, scaled to units of drawing.
    view_from_chunk: mat4x4<f32>,
    // Number of the chunk's first surfel, plus one; 0 means "no surfel" in the index texture.
    first: u32,
    count: u32,
    // Units of drawing per unit of the radius column.
    radius_scale: f32,
    // Depth tolerance in radii.
    tolerance: f32,
    // 1 where surfels seen from behind are drawn.
    two_sided: u32,
    // Radius of the screen-space low-pass in pixels; 0 is none.
    low_pass: f32,
    // Scene units per unit of drawing.
    unit: f32,
    // The factor the scene puts on every radius.
    tangent_scale: f32,
    // The albedo of all surfels where there is no `color` column, linear Rec. 709.
    albedo: vec3<f32>,
}

var<uniform> chunk: Chunk;
var<storage, read> position: array<f32>;
var<storage, read> normal: array<f32>;
#ifndef TANGENTS
var<storage, read> radius: array<f32>;
#endif
#ifdef TANGENTS
var<storage, read> tangent_u: array<f32>;
var<storage, read> tangent_v: array<f32>;
#endif
#ifdef COLOR8
// sRGB codes of red, green and blue in the lower three bytes.
var<storage, read> color: array<u32>;
// The linear values of all 256 codes, in order: decoded by the host, exactly and alike everywhere.
var<uniform> linear_of_srgb: array<vec4<f32>, 64>;
#endif
#ifdef COLOR16
// Four half-precision floats: linear red, green, blue and one.
var<storage, read> color: array<vec2<u32>>;
#endif
#ifdef AO
var<storage, read> ao: array<f32>;
#endif
#ifdef MATERIAL
var<storage, read> material: array<u32>;
#endif

// A surfel in view space: centre, half axes and normal turned to the eye.
struct Disc {
    center: vec3<f32>,
    axis_u: vec3<f32>,
    axis_v: vec3<f32>,
    // World-oriented, turned to the eye where both sides are drawn.
    normal: vec3<f32>,
    // Length of the longer half axis, scene units.
    reach: f32,
    visible: bool,
    // 1 where the eye is on the side the cloud's normal points away from, else 0.
    back: u32,
    // Factor on the surfel's weight: the share of its area in what the low-pass made of it.
    share: f32,
}

fn load_normal(i: u32) -> vec3<f32> {
    return vec3(normal[3u * i], normal[3u * i + 1u], normal[3u * i + 2u]);
}

#ifdef COLOR8
fn linear_channel(code: u32) -> f32 {
    return linear_of_srgb[code >> 2u][code & 3u];
}
#endif

fn load_albedo(i: u32) -> vec3<f32> {
#ifdef COLOR8
    let codes = color[i];
    let red = linear_channel(codes & 255u);
    let green = linear_channel((codes >> 8u) & 255u);
    let blue = linear_channel((codes >> 16u) & 255u);
    return vec3(red, green, blue);
#else
#ifdef COLOR16
    let bits = color[i];
    return vec3(unpack2x16float(bits.x), unpack2x16float(bits.y).x);
#else
    return chunk.albedo;
#endif
#endif
}

fn load_ao(i: u32) -> f32 {
#ifdef AO
    return ao[i];
#else
    return 1.0;
#endif
}

// Below this cosine between normal and view ray a disc is a line without area: at 1e-4 a disc of
// a hundred pixels is a hundredth of a pixel thin.
const EDGE_ON = 1e-4;

fn load_disc(i: u32) -> Disc {
    let local = vec3(position[3u * i], position[3u * i + 1u], position[3u * i + 2u]);
    let center = (chunk.view_from_chunk * vec4(local, 1.0)).xyz;
    var n = load_normal(i);
    let n_view = (chunk.view_from_chunk * vec4(n, 0.0)).xyz * chunk.unit;
    var towards = -center;
    if view::view.orthographic == 1u {
        towards = vec3(0.0, 0.0, 1.0);
    }
    let facing = dot(n_view, towards);
    let front = facing >= 0.0;
    if !front {
        n = -n;
    }
#ifdef TANGENTS
    let u = vec3(tangent_u[3u * i], tangent_u[3u * i + 1u], tangent_u[3u * i + 2u]);
    let v = vec3(tangent_v[3u * i], tangent_v[3u * i + 1u], tangent_v[3u * i + 2u]);
    let axis_u = (chunk.view_from_chunk * vec4(u, 0.0)).xyz * chunk.tangent_scale;
    let axis_v = (chunk.view_from_chunk * vec4(v, 0.0)).xyz * chunk.tangent_scale;
    let reach = max(length(axis_u), length(axis_v));
#else
    let reach = radius[i] * chunk.radius_scale;
    // Orthonormal frame around the normal without branches.
    // Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    let s = select(-1.0, 1.0, n_view.z >= 0.0);
    let a = -1.0 / (s + n_view.z);
    let b = n_view.x * n_view.y * a;
    let axis_u = vec3(1.0 + s * n_view.x * n_view.x * a, s * b, -s * n_view.x) * reach;
    let axis_v = vec3(b, s + n_view.y * n_view.y * a, -n_view.y) * reach;
#endif
    let edge_on = abs(facing) < EDGE_ON * length(towards) && length(towards) > reach;
    let seen = chunk.low_pass > 0.0 || !edge_on;
    let visible = reach > 0.0 && seen && (front || chunk.two_sided == 1u);
    return filtered(Disc(center, axis_u, axis_v, n, reach, visible, select(1u, 0u, front), 1.0));
}

// A projected half axis shorter than this, squared, takes a quad that faces the screen in that
// direction: a quad in the disc's plane would reach far into depth to be a pixel wider.
const HULL_SQUARED = 4.0;
// Half axes below a pixel, squared, have no direction worth keeping.
const SUBPIXEL_SQUARED = 1.0;
// Smallest weight that the low-pass leaves a surfel.
const MIN_SHARE = 0.01;

// The disc widened by the screen-space low-pass: its axes become those of the ellipse whose
// covariance on the screen is the sum of the disc's and the filter's, and `share` the ratio of the
// two areas.
//
// With J the pixels per unit of the disc's coordinates at its centre, the Gaussian's covariance on
// the screen is J J' / 8 and the filter's low_pass^2 / 8, so the widened ellipse has the half axes
// sqrt(l + low_pass^2) for eigenvalues l of J J'. No point of it is further than `low_pass` pixels
// from the disc's own ellipse.
//
// Source: Zwicker et al. 2001, "Surface Splatting", eq. 9-11; Ren et al. 2002, "Object Space EWA
// Surface Splatting", section 4, for doing it in the disc's plane.
fn filtered(disc: Disc) -> Disc {
    let perspective = view::view.orthographic == 0u;
    let distance = select(1.0, -disc.center.z, perspective);
    // A disc around the eye covers the screen; there is nothing to filter.
    if chunk.low_pass <= 0.0 || (perspective && distance <= disc.reach) {
        return disc;
    }
    let px = 0.5 * view::view.size_px / (view::view.half_extent * distance);
    let slope = select(vec2(0.0), disc.center.xy / distance, perspective);
    let ju = px * (disc.axis_u.xy + slope * disc.axis_u.z);
    let jv = px * (disc.axis_v.xy + slope * disc.axis_v.z);
    let xx = ju.x * ju.x + jv.x * jv.x;
    let xy = ju.x * ju.y + jv.x * jv.y;
    let yy = ju.y * ju.y + jv.y * jv.y;
    let area = abs(ju.x * jv.y - ju.y * jv.x);
    let half_difference = 0.5 * (xx - yy);
    let root = sqrt(half_difference * half_difference + xy * xy);
    let major = 0.5 * (xx + yy) + root;
    // The product of the eigenvalues is area^2; dividing keeps a small one precise.
    let minor = select(0.0, area * area / major, major > 0.0);
    var direction = vec2(root + abs(half_difference), abs(xy));
    if half_difference < 0.0 {
        direction = direction.yx;
    }
    direction.y *= select(1.0, -1.0, xy < 0.0);
    direction = select(vec2(1.0, 0.0), direction, root > 1e-6 * major);
    direction = normalize(direction);
    let across = vec2(-direction.y, direction.x);

    let filter_squared = chunk.low_pass * chunk.low_pass;
    let widened = sqrt(vec2(major, minor) + filter_squared);
    var out = disc;
    out.axis_u = vec3(direction / px, 0.0) * widened.x;
    out.axis_v = vec3(across / px, 0.0) * widened.y;
    if major >= SUBPIXEL_SQUARED {
        let along = disc.axis_u * dot(ju, direction) + disc.axis_v * dot(jv, direction);
        out.axis_u = along * (widened.x / major);
    }
    if minor >= HULL_SQUARED {
        let along = disc.axis_u * dot(ju, across) + disc.axis_v * dot(jv, across);
        out.axis_v = along * (widened.y / minor);
    }
    out.reach = max(length(out.axis_u), length(out.axis_v));
    out.share = max(area / (widened.x * widened.y), MIN_SHARE);
    return out;
}

// The texture of the nearest surfels holds, for each pixel, the surfel's number and the bits of its
// distance along the viewing axis; both are 0 where nothing is. The number's highest bit says that
// the surfel is seen from behind.
const BACK_BIT = 31u;
const INDEX_MASK = 0x7fffffffu;

// Weight of a surfel at squared distance `r2` from its centre, in units of the radius: a Gaussian
// that has fallen to 0.018 at the edge, so that the cut there is not seen and the sum of weights
// stays far from zero.
fn splat_weight(r2: f32) -> f32 {
    return exp(-4.0 * r2);
}

// Largest factor by which the second stage brings a surfel nearer; the projection's near plane
// lies this much before `near`.
const MAX_PULL = 2.0;

// The factor by which the stage that adds up brings a surfel nearer in central projection: the
// depth tolerance along the view ray, as a fraction of the distance.
fn pull_of(disc: Disc) -> f32 {
    let slack = chunk.tolerance * disc.reach;
    let distance = max(length(disc.center), slack);
    return min(distance / max(distance - slack, distance / MAX_PULL), MAX_PULL);
}

// Clip-space z of a surfel brought nearer by the depth tolerance, along its view rays: its pixels
// stay the same, only their depth moves.
//
// For central projection depth is z / distance, so a factor on z is a factor on the distance.
fn clip_z_brought_nearer(z: f32, disc: Disc) -> f32 {
    if view::view.orthographic == 1u {
        return z + chunk.tolerance * disc.reach * view::view.clip_from_view[2].z;
    }
    return z * pull_of(disc);
}

// The same for a distance along the viewing axis.
fn distance_brought_nearer(distance: f32, disc: Disc) -> f32 {
    if view::view.orthographic == 1u {
        return distance - chunk.tolerance * disc.reach;
    }
    return distance / pull_of(disc);
}
