// Distances of the surface, by pixel, in units of drawing: what splats are hidden by.
#import surfelshop::surface
#import surfelshop::view

var<storage, read_write> depths: array<f32>;

@compute @workgroup_size(8, 8)
fn surface_depths(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(surface::surface_packed);
    if any(id.xy >= size) {
        return;
    }
    let s = surface::surface_at(id.xy);
    depths[id.y * size.x + id.x] = select(0.0, s.depth / view::view.unit, s.covered);
}
