#import params::settings

var lit: texture_2d<f32>;
var edges: texture_2d<f32>;
var color: texture_storage_2d<rgba32float, write>;

// The light, darkened where edges are. Coverage stays what it was.
@compute @workgroup_size(8, 8)
fn blend(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(color)) {
        return;
    }
    let light = textureLoad(lit, id.xy, 0);
    let left = 1.0 - settings.ink * textureLoad(edges, id.xy, 0).x;
    textureStore(color, id.xy, vec4(light.rgb * left, light.a));
}
