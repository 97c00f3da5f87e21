// Temporal accumulation: adds frames up while nothing changes.
#import surfelshop::view

struct Settings {
    // Frames since something changed.
    frame: u32,
}

var<uniform> settings: Settings;
var latest: texture_2d<f32>;
var<storage, read_write> sums: array<vec4<f32>>;
var mean: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<u32>(view::view.size_px);
    if any(id.xy >= size) {
        return;
    }
    let i = id.y * size.x + id.x;
    // What was added, and how often: also where the sums of earlier frames are gone.
    var sum = vec4(textureLoad(latest, id.xy, 0).rgb, 1.0);
    if settings.frame > 0u {
        sum += sums[i];
    }
    sums[i] = sum;
    textureStore(mean, id.xy, vec4(sum.rgb / sum.w, sum.w));
}
