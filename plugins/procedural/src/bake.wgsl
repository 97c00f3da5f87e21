// A pattern's colour at the surfels.
#import surfelshop::noise::Place
#import procedural::pattern::warped
#import procedural::chosen

// A surfel's place from the anchor and its colour; half the axes of what it stands for.
struct Surfel {
    offset: vec3<f32>,
    across: vec3<f32>,
    along: vec3<f32>,
    albedo: vec3<f32>,
}

struct Anchor {
    anchor_high: vec3<f32>,
    anchor_middle: vec3<f32>,
    anchor_low: vec3<f32>,
    count: u32,
}

var<uniform> anchor: Anchor;
var<storage, read> surfels: array<Surfel>;
var<storage, read_write> colors: array<vec4<f32>>;

@compute @workgroup_size(64)
fn bake(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = id.x + id.y * groups.x * 64u;
    if i >= anchor.count {
        return;
    }
    let s = surfels[i];
    let at = Place(anchor.anchor_high, anchor.anchor_middle, anchor.anchor_low, s.offset, s.across, s.along);
    colors[i] = vec4(chosen::look(warped(at), s.albedo).albedo, 1.0);
}
