// How surfels lie in the shadow maps of virtual point lights.
#define_import_path gi::maps

#import surfelshop::surfels
#import gi::hemisphere
#import gi::vpl::Vpl

struct Sizes {
    // Maps, and texels on a side of each.
    n_maps: u32,
    side: u32,
    // Surfels that go over them: of those given one in every `stride`.
    n_surfels: u32,
    stride: u32,
    // Moves which surfel goes to which map.
    turn: u32,
    // Factor on the radius of a surfel, which stands for that squared of the scene's in its map, times
    // one over the extent.
    radius_scale: f32,
    // One over the scene's extent.
    per_extent: f32,
}

// The surfel of an invocation, in groups of 64; none beyond the last.
fn number_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * 64u;
}

// The map that a surfel goes to: neighbours go to different ones, so that each gets all of the scene.
fn map_of(i: u32, sizes: Sizes) -> u32 {
    return (i + sizes.turn) % sizes.n_maps;
}

// Share of its distance that a disc's radius has at most.
const NEAREST: f32 = 0.8;

// A disc in the axes of a light.
struct Disc {
    center: vec3<f32>,
    normal: vec3<f32>,
    radius: f32,
    // From the light to its centre, and to its plane.
    distance: f32,
    height: f32,
    is_visible: bool,
}

fn disc_from(record: surfels::Record, v: Vpl, sizes: Sizes) -> Disc {
    let surfel = surfels::surfel_of(record);
    let axes = hemisphere::axes_around(v.normal);
    let center = hemisphere::to_local(axes, surfel.position * sizes.per_extent - v.position);
    let normal = hemisphere::to_local(axes, surfel.normal);
    let radius = surfel.radius * sizes.radius_scale;
    let distance = length(center);
    // Below the horizon, or the surface that the light lies on: its plane passes the light within the
    // disc, or nearly so.
    let height = dot(center, normal);
    let is_own = distance < 1.5 * radius && abs(height) < 0.5 * radius;
    let is_visible = radius > 0.0 && center.z > -radius && distance > 1e-9 && !is_own;
    // What is so near is known too coarsely to stand before all of the map.
    return Disc(center, normal, min(radius, NEAREST * distance), distance, height, is_visible);
}

// Part of the map that a disc may cover: a circle.
struct Circle {
    center: vec2<f32>,
    radius: f32,
}

// The map is conformal, so the outline of the ball around a disc is a circle there: from tan((t - a) / 2)
// to tan((t + a) / 2) on the way out, where t is the angle to the middle and a the ball's own.
fn circle_of(disc: Disc) -> Circle {
    let across = length(disc.center.xy);
    let angle = atan2(across, disc.center.z);
    let own = asin(min(disc.radius / disc.distance, 1.0));
    let near = tan(0.5 * (angle - own));
    // Beyond the horizon there is no map.
    let far = tan(min(0.5 * (angle + own), 1.2));
    let out = disc.center.xy / max(across, 1e-20);
    return Circle(out * (0.5 * (near + far)), 0.5 * (far - near));
}

// The first and the last texel of a row, or column, that a circle may cover.
fn texels_of(center: f32, half_width: f32, side: u32) -> vec2<i32> {
    let ends = vec2(center - half_width, center + half_width) * 0.5 + 0.5;
    return clamp(vec2<i32>(floor(ends * f32(side))), vec2(0), vec2(i32(side) - 1));
}

// How far away a disc is where the middle of a texel looks; 0 where it is not there. Discs smaller than
// texels are in some and not in others, as much as they cover: one that always were in the texel of its
// centre would make every occluder half a texel wider on each side.
fn depth_at(disc: Disc, texel: vec2<i32>, sizes: Sizes) -> f32 {
    let place = hemisphere::center_of(texel, sizes.side);
    let square = dot(place, place);
    // 1 + square times as long as the direction, which saves a division.
    let towards = vec3(2.0 * place, 1.0 - square);
    let falls = dot(towards, disc.normal);
    let along = disc.height / select(falls, 1e-9, abs(falls) < 1e-9);
    let offset = towards * along - disc.center;
    let is_hit = square <= 1.0 && along > 0.0 && dot(offset, offset) <= disc.radius * disc.radius;
    return select(0.0, along * (1.0 + square), is_hit);
}
