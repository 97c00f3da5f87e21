// Leaves of a packed surface what belongs to some clouds.

var packed: texture_2d<u32>;
var objects: texture_2d<u32>;
// For each cloud, 1 where it is one of them; those behind the last are not.
var<storage, read> own: array<u32>;
var masked: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn own_surface(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(masked)) {
        return;
    }
    // One pixel stands for all where there is one cloud.
    let last = textureDimensions(objects) - 1u;
    let object = textureLoad(objects, min(id.xy, last), 0).x;
    var bits = vec4(0u);
    if object < arrayLength(&own) && own[object] == 1u {
        bits = textureLoad(packed, id.xy, 0);
    }
    textureStore(masked, id.xy, bits);
}
