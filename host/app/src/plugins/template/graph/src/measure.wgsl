#import surfelshop::surface

var measured: texture_storage_2d<rgba32float, write>;

// Normal and depth of each pixel: what an effect over the picture needs of the surface, once.
@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= textureDimensions(measured)) {
        return;
    }
    let s = surface::surface_at(id.xy);
    textureStore(measured, id.xy, vec4(s.normal, s.depth));
}
