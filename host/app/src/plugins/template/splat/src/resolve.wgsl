#import surfelshop::surface

var sums: texture_2d<f32>;
var color: texture_storage_2d<rgba32float, write>;

// Linear radiance with coverage. Alpha is straight: sums are divided by it.
@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) at: vec3<u32>) {
    let pixel = at.xy;
    if any(pixel >= textureDimensions(color)) {
        return;
    }
    let sum = textureLoad(sums, pixel, 0);
    var shown = vec4(0.0);
    // Gaussians reach beyond their discs: what is shown ends where the discs do. Leave that out for clouds
    // that are no surfaces.
    if sum.w > 0.0 && surface::surface_at(pixel).covered {
        shown = vec4(sum.rgb / sum.w, min(sum.w, 1.0));
    }
    textureStore(color, pixel, shown);
}
