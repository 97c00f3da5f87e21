// How much light the cells of the light surface buffer reflect, and the sums of fours above them.
//
// Source: Clarberg et al. 2005, "Wavelet Importance Sampling" (hierarchical warping).
#import gi::light_views
#import gi::material::Material

var<uniform> faces: light_views::Faces;
var<uniform> body: Material;
var<storage, read> texels: array<light_views::Texel>;
var<storage, read_write> importance: array<f32>;

// Of a cell: the flux that arrives in it, weighted by what its surface reflects.
@compute @workgroup_size(8, 8)
fn weigh(@builtin(global_invocation_id) id: vec3<u32>) {
    let face = id.z;
    let across = faces.lit_side / light_views::CELLS;
    // The share of light that a highlight sends on: half vectors take in 2 pi / (n + 1), directions four times
    // as much, over pi.
    let specular = body.specular * min(8.0 / (body.shininess + 1.0), 1.0);
    var sum = 0.0;
    for (var y = 0u; y < across; y++) {
        for (var x = 0u; x < across; x++) {
            let at = id.xy * across + vec2(x, y);
            let texel = texels[(face * faces.lit_side + at.y) * faces.lit_side + at.x];
            let red_green = unpack2x16float(texel.albedo_rg);
            let blue = unpack2x16float(texel.albedo_b).x;
            let albedo = max(red_green.x, max(red_green.y, blue));
            sum += texel.flux * (body.diffuse * albedo + specular);
        }
    }
    importance[face * light_views::PYRAMID + id.y * light_views::CELLS + id.x] = sum;
}

// A group for each face goes up its levels.
@compute @workgroup_size(256)
fn add_up(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    let first = group.x * light_views::PYRAMID;
    for (var level = 1u; level <= 6u; level++) {
        storageBarrier();
        let side = light_views::CELLS >> level;
        let here = first + light_views::first_of_level(level);
        let below = first + light_views::first_of_level(level - 1u);
        for (var i = own; i < side * side; i += 256u) {
            let at = vec2(i % side, i / side) * 2u;
            let corner = below + at.y * side * 2u + at.x;
            let pair = importance[corner] + importance[corner + 1u];
            importance[here + i] = pair + importance[corner + 2u * side] + importance[corner + 2u * side + 1u];
        }
    }
}
