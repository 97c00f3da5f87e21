// Which pixels a disc covers and where rays through them meet it, for stages that go through a
// disc's pixels themselves; put behind disc.wgsl.

// What compute stages do with a disc.
const NOTHING = 0u;
// One invocation goes through the pixels of its box.
const SMALL = 1u;
// It is drawn as a quad: it covers many pixels, or reaches behind the near plane.
const LARGE = 2u;

// Pixels of the box around a disc's outline up to which one invocation goes through them.
//
// Measured with Mesa's software driver on two cores, a scan of 134 thousand surfels: the CPU's
// time of a whole frame is 0.2, 0.35, 0.7, 0.95 and 1.05 of what quads alone take in pictures of 256,
// 512, 1024, 1448 and 2048 pixels, where most boxes have about 4, 17, 70, 140 and 280. Limits of 64 and
// 250 were slower than this one, or no faster, in all of them.
const MAX_SMALL_PX = 144;

// A disc on the screen; the map from pixels to the disc is as good as f32 holds positions in pixels,
// since all of it is relative to the disc's centre.
struct Footprint {
    // Box of the pixels whose centres the outline may hold; none where it holds none.
    first: vec2<i32>,
    extent: vec2<i32>,
    center_px: vec2<f32>,
    // Disc coordinates of a step of one pixel right and down, as seen from the disc's centre.
    right: vec2<f32>,
    down: vec2<f32>,
    // How fast the distance shrinks along the disc's axes: relative to `distance` in central
    // projection, in units of drawing in parallel projection.
    tilt: vec2<f32>,
    distance: f32,
    // Whether the disc lies wholly before the near plane; else nothing but this is set.
    whole: bool,
}

// Where the ray through a pixel's centre meets a disc's plane.
struct Crossing {
    // Squared distance from the centre in units of the radius.
    r2: f32,
    // Along the viewing axis.
    distance: f32,
    // In units of the disc's half axes.
    at: vec2<f32>,
}

// The footprint of a disc.
//
// A point w of the disc lies, relative to the disc's centre on the screen, at J w / (1 + t w), where
// J holds the disc's axes at the centre's distance in pixels, and 1 + t w is the distance relative
// to the centre's. The outline's extent along x is where the line of constant x is tangent to the
// unit circle: s^2 (1 - t t) + 2 s (J_x t) - J_x J_x = 0.
fn footprint_of(disc: Disc) -> Footprint {
    let perspective = view::view.orthographic == 0u;
    let distance = -disc.center.z;
    let depth_range = vec2(-disc.axis_u.z, -disc.axis_v.z);
    let none = Footprint(vec2(0), vec2(0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), 0.0, true);
    if distance + length(depth_range) < view::view.near {
        return none;
    }
    let t = select(vec2(0.0), depth_range / distance, perspective);
    let kappa = 1.0 - dot(t, t);
    if !(distance - length(depth_range) > view::view.near) || !(kappa >= MIN_KAPPA) {
        var near = none;
        near.whole = false;
        return near;
    }
    let per_unit = 0.5 * view::view.size_px / view::view.half_extent * vec2(1.0, -1.0);
    let px = per_unit / select(1.0, distance, perspective);
    let ray = select(vec2(0.0), disc.center.xy / distance, perspective);
    let center_px = 0.5 * view::view.size_px - view::shift_px() + px * disc.center.xy;
    let ju = px * (disc.axis_u.xy + ray * disc.axis_u.z);
    let jv = px * (disc.axis_v.xy + ray * disc.axis_v.z);

    let skew = vec2(ju.x * t.x + jv.x * t.y, ju.y * t.x + jv.y * t.y);
    let half_box = sqrt(skew * skew + kappa * (ju * ju + jv * jv)) / kappa;
    let low = center_px - skew / kappa - half_box;
    let high = center_px - skew / kappa + half_box;
    let size = view::view.size_px;
    let first = ceil(clamp(low - 0.5, vec2(0.0), size));
    let behind = floor(clamp(high + 0.5, vec2(0.0), size));
    let determinant = ju.x * jv.y - ju.y * jv.x;
    // Comparisons that fail where something is not a number.
    if !all(behind > first) || !(abs(determinant) > 0.0) {
        return none;
    }
    return Footprint(
        vec2<i32>(first),
        vec2<i32>(behind - first),
        center_px,
        vec2(jv.y, -ju.y) / determinant,
        vec2(-jv.x, ju.x) / determinant,
        select(-depth_range, -t, perspective),
        distance,
        true,
    );
}

// Where the ray through a pixel's centre meets a disc that lies wholly before the near plane.
//
// With g = J^-1 of the pixel's offset, w = g m and the distance is that of the centre over m, where
// m = 1 - t g: no difference of large numbers is taken.
fn crossing_at(footprint: Footprint, pixel: vec2<i32>) -> Crossing {
    let offset = vec2<f32>(pixel) + 0.5 - footprint.center_px;
    let g = footprint.right * offset.x + footprint.down * offset.y;
    let rise = dot(footprint.tilt, g);
    if view::view.orthographic == 1u {
        return Crossing(dot(g, g), footprint.distance - rise, g);
    }
    let nearer = 1.0 / (1.0 + rise);
    return Crossing(dot(g, g) * nearer * nearer, footprint.distance * nearer, g * nearer);
}

// What is done with a disc of this footprint.
fn kind_of(disc: Disc, footprint: Footprint) -> u32 {
    if !disc.visible {
        return NOTHING;
    }
    if !footprint.whole {
        return LARGE;
    }
    let extent = footprint.extent;
    if extent.x <= 0 {
        return NOTHING;
    }
    // Before the product, which could overflow.
    let is_small = max(extent.x, extent.y) <= MAX_SMALL_PX && extent.x * extent.y <= MAX_SMALL_PX;
    return select(LARGE, SMALL, is_small);
}
