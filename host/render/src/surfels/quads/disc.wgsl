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
    // One surfel of so many is drawn.
    stride: u32,
    // Which of the scene's clouds it belongs to.
    object: u32,
    // The albedo of all surfels where there is no `color` column, linear Rec. 709.
    albedo: vec3<f32>,
    // The radius of all surfels where they have one, negative where they are round splats.
    radius: f32,
    // The largest radius in perspective of round splats, in shares of their distance from the eye, and how many of the
    // chunk's surfels it bounds: those that are not merged ones, or none.
    round_reach: f32,
    n_bounded: u32,
}

var<uniform> chunk: Chunk;
var<storage, read> position: array<f32>;
var<storage, read> normal: array<f32>;
#ifndef TANGENTS
#ifndef EQUAL_RADII
var<storage, read> radius: array<f32>;
#endif
#endif
#ifdef TANGENTS
var<storage, read> tangent_u: array<f32>;
var<storage, read> tangent_v: array<f32>;
#endif
#ifdef FIELD
// Linear normal fields, as the column `normal_field` is defined.
var<storage, read> normal_field: array<f32>;
#endif
#ifdef CLIP
// Lines that cut surfels, as the column `clip` is defined.
var<storage, read> clip: array<f32>;
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
#ifdef LIT
// What each surfel that is drawn radiates, where surfels are shaded one by one.
var<storage, read> lit: array<vec4<f32>>;
#endif
#ifdef MATERIAL
var<storage, read> material: array<u32>;
#endif

#ifdef RUNS
// The surfels that are drawn: for each 256 invocations the first of theirs, and the one behind the last.
var<storage, read> runs: array<vec2<u32>>;
#endif

// Invocations, or instances, of which each draws a surfel at most.
fn n_drawn() -> u32 {
#ifdef RUNS
    return arrayLength(&runs) << 8u;
#else
    return (chunk.count + chunk.stride - 1u) / chunk.stride;
#endif
}

// The surfel that one of them draws; none where it is not below `chunk.count`.
fn surfel_drawn_by(drawn: u32) -> u32 {
#ifdef RUNS
    if drawn >= n_drawn() {
        return chunk.count;
    }
    let run = runs[drawn >> 8u];
    let i = run.x + (drawn & 255u);
    return select(chunk.count, i, i < run.y);
#else
    return drawn * chunk.stride;
#endif
}

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
#ifdef LOCAL
    // Where points of the disc lie in the surfel as its columns have it, in units of its own half
    // axes: the disc's centre, and what a step along each of the disc's half axes adds.
    own_center: vec2<f32>,
    own_u: vec2<f32>,
    own_v: vec2<f32>,
    // What the low-pass left of the two half axes, as shares.
    kept: vec2<f32>,
#endif
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
#ifdef LIT
    return lit[i / chunk.stride].rgb;
#else
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
#endif
}

#ifdef TINTED_BACKS
// Of surfels that are seen from behind, linear Rec. 709.
const BACK_RED = 0.8;
const BACK_GREEN = 0.03;
const BACK_BLUE = 0.45;
#endif

// The albedo of a surfel as it is seen: that of backs where these are tinted. What was shaded was so already.
fn seen_albedo(i: u32, back: u32) -> vec3<f32> {
#ifdef TINTED_BACKS
#ifndef LIT
    if back == 1u {
        return vec3(BACK_RED, BACK_GREEN, BACK_BLUE);
    }
#endif
#endif
    return load_albedo(i);
}

fn load_ao(i: u32) -> f32 {
#ifdef AO
    return ao[i];
#else
    return 1.0;
#endif
}

// The longer half axis of the ellipse of all x u + y v with x^2 + y^2 = 1, for u and v at any angle:
// the matrix's larger singular value.
fn longer_half_axis(u: vec3<f32>, v: vec3<f32>) -> f32 {
    let uu = dot(u, u);
    let vv = dot(v, v);
    return sqrt(0.5 * (uu + vv) + length(vec2(0.5 * (uu - vv), dot(u, v))));
}

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
    let reach = longer_half_axis(axis_u, axis_v);
    let is_round = false;
#else
#ifdef EQUAL_RADII
    let size = chunk.radius;
#else
    let size = radius[i];
#endif
    // Radii of round splats are negative: they face the eye, whatever their normal.
    let is_round = size < 0.0;
    var reach = abs(size) * chunk.radius_scale;
    if is_round && i < chunk.n_bounded && view::view.orthographic == 0u {
        reach = min(reach, length(center) * chunk.round_reach);
    }
    let axis = select(n_view, towards / max(length(towards), 1e-30), is_round);
    // Orthonormal frame around the normal without branches.
    // Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    let s = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (s + axis.z);
    let b = axis.x * axis.y * a;
    let axis_u = vec3(1.0 + s * axis.x * axis.x * a, s * b, -s * axis.x) * reach;
    let axis_v = vec3(b, s + axis.y * axis.y * a, -axis.y) * reach;
#endif
    let visible = reach > 0.0 && (front || is_round || chunk.two_sided == 1u);
    let back = select(1u, 0u, front);
#ifdef LOCAL
    let s = chunk.tangent_scale;
    let own = Disc(
        center, axis_u, axis_v, n, reach, visible, back, 1.0, vec2(0.0), vec2(s, 0.0), vec2(0.0, s), vec2(1.0),
    );
    let disc = filtered(own);
    if all(disc.kept == vec2(1.0)) {
        return disc;
    }
    return located(disc, own);
#else
    return filtered(Disc(center, axis_u, axis_v, n, reach, visible, back, 1.0));
#endif
}

// An ellipse on the screen: the outline of a disc.
struct Outline {
    // From the pixel of the disc's centre to that of the ellipse, pixels.
    center_px: vec2<f32>,
    // Unit vector along the longer half axis.
    along: vec2<f32>,
    // Longer and shorter half axis, pixels.
    half_axes: vec2<f32>,
    // How much farther the disc is at the ends of the two half axes than at the ellipse's centre: in
    // parallel projection in units of depth, in perspective minus the change of inverse depth,
    // relative to that at the centre.
    depth_range: vec2<f32>,
    // 1 - (half the disc's depth range / its distance)^2; 1 in parallel projection.
    kappa: f32,
}

// Smallest `kappa` of a disc that is widened. Nearer to the eye the outline grows so large, and its
// centre so far away, that floats do not hold it.
const MIN_KAPPA = 0.05;

// The outline of a disc that lies wholly before the eye; without extent where the disc has none or
// is too near. `px` is the number of pixels per unit at the disc's centre, `ray` the direction of
// the view ray there.
//
// This is the outline of the perspective projection, not of its linear part at the disc's centre,
// which is wrong by whole pixels for a disc as large as its distance.
fn outline_of(disc: Disc, px: vec2<f32>, ray: vec2<f32>, perspective: bool) -> Outline {
    let distance = select(1.0, -disc.center.z, perspective);
    let tilt = vec2(-disc.axis_u.z, -disc.axis_v.z) / distance;
    let zeta = select(vec2(0.0), tilt, perspective);
    let kappa = 1.0 - dot(zeta, zeta);
    // J: what a unit of the disc's coordinates is at its centre, in units of `size` pixels.
    var ju = px * (disc.axis_u.xy + ray * disc.axis_u.z);
    var jv = px * (disc.axis_v.xy + ray * disc.axis_v.z);
    let size = max(max(abs(ju.x), abs(ju.y)), max(abs(jv.x), abs(jv.y)));
    if kappa < MIN_KAPPA || !(size > 0.0) {
        return Outline(vec2(0.0), vec2(1.0, 0.0), vec2(0.0), vec2(0.0), 0.0);
    }
    ju /= size;
    jv /= size;
    // The point w of the unit disc projects to J w / (1 + zeta w), so the outline is an ellipse
    // around -J zeta / kappa with the matrix J (1 + zeta zeta' / kappa) J' / kappa.
    let shift = (ju * zeta.x + jv * zeta.y) / kappa;
    let xx = (ju.x * ju.x + jv.x * jv.x) / kappa + shift.x * shift.x;
    let xy = (ju.x * ju.y + jv.x * jv.y) / kappa + shift.x * shift.y;
    let yy = (ju.y * ju.y + jv.y * jv.y) / kappa + shift.y * shift.y;
    let determinant = ju.x * jv.y - ju.y * jv.x;
    let half_difference = 0.5 * (xx - yy);
    let root = length(vec2(half_difference, xy));
    let major = sqrt(0.5 * (xx + yy) + root);
    // The ellipse's area over its longer half axis; a difference would not keep a short one.
    let minor = abs(determinant) / (kappa * sqrt(kappa) * major);
    var along = vec2(root + abs(half_difference), abs(xy));
    if half_difference < 0.0 {
        along = along.yx;
    }
    along.y *= select(1.0, -1.0, xy < 0.0);
    // A circle has no direction.
    along = normalize(select(vec2(1.0, 0.0), along, root > 1e-6 * major * major));
    // The map from (1, w) to (1 + zeta w) (1, s, t), positions in units of the half axes, keeps the
    // cone |w| = 1. So its third row follows from the other two, and no division by a short half
    // axis is needed; and its first column is, up to signs, its first row in another frame.
    let p = vec2(dot(along, ju), dot(along, jv)) / major;
    let turned = select(1.0, -1.0, determinant > 0.0) * (tilt.x * p.y - tilt.y * p.x);
    let depth_range = vec2(dot(p, tilt) / kappa, turned / sqrt(kappa));
    return Outline(-shift * size, along, vec2(major, minor) * size, depth_range, kappa);
}

// Discs whose shorter half axis on the screen is at least this many times the low-pass stay as they
// are: widening would add a sixteenth of the low-pass and change the weight by 1.5 percent.
const WIDENED_BELOW = 8.0;
// Widened, a disc stays in its plane up to this slope: sideways steps of a pixel's width take it
// this many such widths nearer or farther. Beyond it what the low-pass adds turns towards the
// screen, since the plane of a disc seen edge-on leads far in front of other surfaces.
const MAX_SLOPE = 2.0;
// Smallest factor the low-pass puts on a weight, so that no sum of weights is zero.
const MIN_SHARE = 1e-6;

// The disc widened by the screen-space low-pass: its outline on the screen gets the half axes
// sqrt(a^2 + low_pass^2) and sqrt(b^2 + low_pass^2), and its weight the factor `share`, the ratio
// of the two areas.
//
// For Gaussians cut at the outline, covariances on the screen add: the disc's has the eigenvalues
// a^2 / 8 and b^2 / 8, the filter's is low_pass^2 / 8. The widened ellipse holds the disc's own, and
// none of its points is further than `low_pass` from that, for its extent in any direction is
// sqrt(h^2 + low_pass^2) <= h + low_pass.
//
// What is returned is again a disc, drawn as any other: the one with the widened outline, in the
// same plane as far as MAX_SLOPE allows, so that the splats of a surface agree in depth.
//
// Source: Zwicker et al. 2001, "Surface Splatting", eq. 9-11, for the sum of covariances; Ren et
// al. 2002, "Object Space EWA Surface Splatting", section 4, for doing it with a polygon in space.
fn filtered(disc: Disc) -> Disc {
    let perspective = view::view.orthographic == 0u;
    let distance = -disc.center.z;
    // A disc that reaches the near plane would be cut elsewhere than rays are.
    let before_near = distance - length(vec2(disc.axis_u.z, disc.axis_v.z)) > view::view.near;
    if chunk.low_pass <= 0.0 || !before_near {
        return disc;
    }
    let per_unit = 0.5 * view::view.size_px / view::view.half_extent;
    let px = per_unit / select(1.0, distance, perspective);
    let ray = select(vec2(0.0), disc.center.xy / distance, perspective);
    let own = outline_of(disc, px, ray, perspective);
    if own.kappa == 0.0 || own.half_axes.y >= WIDENED_BELOW * chunk.low_pass {
        return disc;
    }
    let widened = sqrt(own.half_axes * own.half_axes + chunk.low_pass * chunk.low_pass);
    let kept = own.half_axes / widened;

    let slope = abs(own.depth_range) * per_unit.y / max(own.half_axes, vec2(1e-6));
    let steep = MAX_SLOPE / max(slope, vec2(MAX_SLOPE));
    let followed = slope * steep * steep * widened / per_unit.y;
    var range = sign(own.depth_range) * max(abs(own.depth_range) * kept, followed);
    let nearest = select(
        distance - length(range),
        distance * own.kappa / (1.0 + length(range)),
        perspective,
    );
    let bent = perspective && 1.0 - dot(range, range) < 0.5 * own.kappa;
    if bent || nearest <= view::view.near {
        // Too far out of its own depths: it keeps inside them, which lie before the eye.
        range = own.depth_range * kept;
    }
    // Seen from behind, the widened disc stands back by what was added: the discs just behind a
    // silhouette would else come before those of the side that is seen.
    var behind = 0.0;
    if disc.back == 1u {
        behind = dot(abs(own.depth_range) + abs(range), 1.0 - kept);
    }

    // The disc with this outline and depth range, up to a rotation in its plane: the symmetric map
    // of (1, w) whose first row is (1, zeta).
    let zeta = select(vec2(0.0), range, perspective);
    let kappa = 1.0 - dot(zeta, zeta);
    let in_perspective = distance * own.kappa / kappa * (1.0 + behind);
    let center_depth = select(distance + behind, in_perspective, perspective);
    let axis_depths = range * select(1.0, in_perspective, perspective);
    let root_kappa = sqrt(kappa);
    let s_px = own.along * widened.x;
    let t_px = vec2(-own.along.y, own.along.x) * widened.y;
    let to_center_px = s_px * zeta.x + t_px * zeta.y;
    let stretched_px = to_center_px / (1.0 + root_kappa);
    let u_px = own.center_px * zeta.x + s_px * root_kappa + stretched_px * zeta.x;
    let v_px = own.center_px * zeta.y + t_px * root_kappa + stretched_px * zeta.y;
    let units = select(1.0, in_perspective, perspective) / per_unit;
    let center = disc.center.xy + ray * (center_depth - distance);

    var out = disc;
    out.center = vec3(center + (own.center_px + to_center_px) * units, -center_depth);
    out.axis_u = vec3(ray * axis_depths.x + u_px * units, -axis_depths.x);
    out.axis_v = vec3(ray * axis_depths.y + v_px * units, -axis_depths.y);
    out.reach = longer_half_axis(out.axis_u, out.axis_v);
    out.share = max(kept.x * kept.y, MIN_SHARE);
#ifdef LOCAL
    out.kept = kept;
#endif
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
