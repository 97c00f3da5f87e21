// The view: camera, picture size and the way between pixels, view space and world directions.
//
// View space: origin at the eye, x right, y up, z backwards; what is seen has negative z.
// "World-oriented" vectors have the world's axes and start at the eye unless said otherwise.
#define_import_path surfelshop::view

struct View {
    // Reverse-Z projection used for drawing.
    clip_from_view: mat4x4<f32>,
    // Rotation to world axes; the fourth column is the eye relative to the scene's origin.
    world_from_view: mat4x4<f32>,
    // Half the picture's width and height: tangents, or scene units where orthographic.
    half_extent: vec2<f32>,
    // Width and height in pixels.
    size_px: vec2<f32>,
    // Nearest distance along the viewing axis that is drawn, scene units.
    near: f32,
    // Distance at which depth ends, scene units; orthographic only.
    far: f32,
    // 1 where orthographic, else 0.
    orthographic: u32,
    // Frames since something in this view changed.
    frame_index: u32,
    // Scene units per unit of the surface buffer's depth, a power of two.
    unit: f32,
}

// Host modules carry numbers because the composer wants them; the host gives its own.
@group(0) @binding(0) var<uniform> view: View;

// Where the picture is seen in each pixel, from its centre, pixels, y downwards: 0, and less than half a pixel either way
// in further frames of an antialiased picture, whose `clip_from_view` has it in it. Everything here that speaks of pixels
// follows it.
fn shift_px() -> vec2<f32> {
    let moved = select(view.clip_from_view[2].xy, -view.clip_from_view[3].xy, view.orthographic == 1u);
    return vec2(0.5, -0.5) * view.size_px * moved;
}

// The point of view space at `depth` along the viewing axis that is seen at a position in
// pixels (pixel centres at .5, y downwards).
fn position_in_view(position_px: vec2<f32>, depth: f32) -> vec3<f32> {
    let ndc = 2.0 * (position_px + shift_px()) / view.size_px - 1.0;
    let across = vec2(ndc.x, -ndc.y) * view.half_extent;
    if view.orthographic == 1u {
        return vec3(across, -depth);
    }
    return vec3(across * depth, -depth);
}

// Unit vector towards the eye from a point of view space, in view space.
fn to_eye_in_view(position: vec3<f32>) -> vec3<f32> {
    if view.orthographic == 1u {
        return vec3(0.0, 0.0, 1.0);
    }
    return -normalize(position);
}

// Turns a direction of view space to world axes.
fn world_from_view_direction(direction: vec3<f32>) -> vec3<f32> {
    let axes = view.world_from_view;
    return axes[0].xyz * direction.x + axes[1].xyz * direction.y + axes[2].xyz * direction.z;
}

// A point that is seen, world-oriented.
struct WorldPoint {
    // From the eye, scene units.
    position: vec3<f32>,
    // Unit vector to the eye.
    to_eye: vec3<f32>,
}

// The point at `depth` along the viewing axis, scene units, that is seen at a position in pixels. It is what
// `position_in_view` and `to_eye_in_view` say, turned to world axes once for both.
fn world_point_at(position_px: vec2<f32>, depth: f32) -> WorldPoint {
    // At distance 1 no scene's size can overflow its square.
    let at_one = position_in_view(position_px, 1.0);
    if view.orthographic == 1u {
        let position = world_from_view_direction(vec3(at_one.xy, -depth));
        return WorldPoint(position, view.world_from_view[2].xyz);
    }
    let ray = world_from_view_direction(at_one);
    return WorldPoint(ray * depth, -normalize(ray));
}

// Turns a world direction to view axes.
fn view_from_world_direction(direction: vec3<f32>) -> vec3<f32> {
    return (vec4(direction, 0.0) * view.world_from_view).xyz;
}

// Distance along the viewing axis of a reverse-Z depth written with `clip_from_view`.
fn distance_from_depth(depth: f32) -> f32 {
    let z = view.clip_from_view[2].z;
    let offset = view.clip_from_view[3].z;
    if view.orthographic == 1u {
        return (offset - depth) / z;
    }
    return offset / depth;
}
