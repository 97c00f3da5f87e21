// What a face of a light view sees, from where the pass looks: how far away it is, for every texel, and all of it
// for one texel of each block.
#import surfelshop::view
#import surfelshop::surface
#import surfelshop::light
#import surfelshop::packing
#import gi::light_views

struct FaceIndex {
    face: u32,
}

var<uniform> which: FaceIndex;
var<uniform> faces: light_views::Faces;
var<storage, read_write> depths: array<f32>;
var<storage, read_write> texels: array<light_views::Texel>;

@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) id: vec3<u32>) {
    if all(id.xy < vec2(faces.side)) {
        let place = (which.face * faces.side + id.y) * faces.side + id.x;
        depths[place] = surface::surface_at(id.xy).depth * faces.per_extent;
    }
}

@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(faces.lit_side)) {
        return;
    }
    let face = faces.items[which.face];
    let texel = id.xy * faces.block + faces.chosen;
    let s = surface::surface_at(texel);
    let place = (which.face * faces.lit_side + id.y) * faces.lit_side + id.x;
    if !s.covered {
        texels[place] = light_views::Texel(vec3(0.0), 0.0, 0u, 0u, 0u, 0u);
        return;
    }
    let across = (vec2<f32>(texel) + 0.5) / f32(faces.side) * 2.0 - 1.0;
    // What arrives on a block's part of the surface is what goes through the block.
    let width = 2.0 * face.half_extent / f32(faces.lit_side);
    var through = width * width;
    if face.is_parallel == 0u {
        // a cos^3 steradians, at the depth / cos squared.
        let depth = s.depth * faces.per_extent;
        through *= depth * depth * inverseSqrt(1.0 + dot(across, across) * face.half_extent * face.half_extent);
    }
    let incident = light::arriving(face.light_index, s.position);
    let brightest = max(incident.radiance.r, max(incident.radiance.g, incident.radiance.b));
    let is_own = max(abs(across.x), abs(across.y)) <= face.own;
    let flux = select(0.0, brightest * through, is_own);
    let eye = view::view.world_from_view[3].xyz;
    texels[place] = light_views::Texel(
        (s.position + eye) * faces.per_extent,
        flux,
        packing::pack_direction(s.normal),
        pack2x16float(s.albedo.rg),
        pack2x16float(vec2(s.albedo.b, 0.0)),
        0u,
    );
}
