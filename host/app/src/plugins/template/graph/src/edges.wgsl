#import params::settings

var measured: texture_2d<f32>;
var found: texture_storage_2d<rgba32float, write>;

// How much of an edge there is at each pixel, 0 to 1: where depth jumps, or normals turn.
@compute @workgroup_size(8, 8)
fn find(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(found);
    if any(id.xy >= size) {
        return;
    }
    let at = vec2<i32>(id.xy);
    let here = textureLoad(measured, at, 0);
    var edge = 0.0;
    if here.w > 0.0 {
        let step = i32(settings.width);
        edge = max(across(at, vec2(step, 0), here), across(at, vec2(0, step), here));
    }
    textureStore(found, id.xy, vec4(vec3(edge), select(0.0, 1.0, here.w > 0.0)));
}

// An edge between the pixels on both sides of one. Pixels that nothing covers count as very far away.
fn across(at: vec2<i32>, step: vec2<i32>, here: vec4<f32>) -> f32 {
    let last = vec2<i32>(textureDimensions(measured)) - 1;
    let before = textureLoad(measured, clamp(at - step, vec2(0), last), 0);
    let after = textureLoad(measured, clamp(at + step, vec2(0), last), 0);
    // How the ratio of depths bends: 0 over planes seen by either projection, whatever their scale.
    let bends = abs(nearness(before, here) + nearness(after, here) - 2.0);
    let turns = 1.0 - min(dot(here.xyz, before.xyz), dot(here.xyz, after.xyz));
    return max(smoothstep(0.02, 0.1, bends), smoothstep(0.2, 0.6, turns));
}

// How near a pixel is, as a share of how near this one is; 0 where nothing is.
fn nearness(other: vec4<f32>, here: vec4<f32>) -> f32 {
    if other.w <= 0.0 {
        return 0.0;
    }
    return min(here.w / other.w, 2.0);
}
