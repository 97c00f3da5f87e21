// Imperfect shadow maps: all surfels go over all maps, each into one, as discs so much larger that they
// still cover the surface.
//
// A map has for each direction of the hemisphere over its light one over the distance of what is seen
// there, 0 where nothing is; the bits of positive floats are ordered as the floats are.
//
// Source: Ritschel et al. 2008, "Imperfect Shadow Maps"; Preiner 2010, section 4.3, with erratum P2.
#import surfelshop::surfels
#import gi::maps
#import gi::hemisphere
#import gi::vpl::Vpl

var<uniform> sizes: maps::Sizes;
var<storage, read> scene: array<surfels::Record>;
var<storage, read> vpls: array<Vpl>;
var<storage, read_write> depths: array<atomic<u32>>;

@compute @workgroup_size(64)
fn splat(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = maps::number_of(id, groups);
    if i >= sizes.n_surfels {
        return;
    }
    let map = maps::map_of(i, sizes);
    let v = vpls[map];
    if v.valid == 0u || v.surfel == i + 1u {
        return;
    }
    let disc = maps::disc_from(scene[i * sizes.stride], v, sizes);
    if !disc.is_visible {
        return;
    }
    let first = map * sizes.side * sizes.side;
    let circle = maps::circle_of(disc);
    // Half a texel more: texels are looked at in their middles.
    let reach = circle.radius + 1.0 / f32(sizes.side);
    let rows = maps::texels_of(circle.center.y, reach, sizes.side);
    for (var y = rows.x; y <= rows.y; y++) {
        let away = hemisphere::center_of(vec2(0, y), sizes.side).y - circle.center.y;
        let half_width = sqrt(max(reach * reach - away * away, 0.0)) + 1.0 / f32(sizes.side);
        let columns = maps::texels_of(circle.center.x, half_width, sizes.side);
        for (var x = columns.x; x <= columns.y; x++) {
            let depth = maps::depth_at(disc, vec2(x, y), sizes);
            if depth > 0.0 {
                atomicMax(&depths[first + u32(y) * sizes.side + u32(x)], bitcast<u32>(1.0 / depth));
            }
        }
    }
}
