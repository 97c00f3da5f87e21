#import surfelshop::surface

var sums: texture_2d<f32>;

// Linear radiance with coverage. Alpha is straight: sums are divided by it.
@fragment
fn resolve(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(at.xy);
    let sum = textureLoad(sums, pixel, 0);
    // Gaussians reach beyond their discs: what is shown ends where the discs do. Leave that out for clouds
    // that are no surfaces.
    if !(sum.w > 0.0) || !surface::surface_at(pixel).covered {
        return vec4(0.0);
    }
    return vec4(sum.rgb / sum.w, min(sum.w, 1.0));
}
