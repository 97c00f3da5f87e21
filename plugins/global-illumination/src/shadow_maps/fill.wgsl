// Fills holes of imperfect shadow maps: a texel that is empty, or shows what is far behind, and lies
// between two of one surface, on either side of it, gets what lies there. What is at one side only is an
// edge of the occluder, and stays where it is: a pyramid of averages (pull and push) widens it
// by up to half its coarsest cell.
//
// Source: Preiner 2010, section 4.3, with erratum P8; Marroquim et al. 2007, "Efficient Point-Based
// Rendering Using Image Reconstruction", for the rule that only depths within a share of the nearest are
// merged; Serra 1982, "Image Analysis and Mathematical Morphology" (closing by segments).
#import gi::maps
#import gi::hemisphere

struct Place {
    // Maps before those of this bounce.
    first: u32,
}

var<uniform> sizes: maps::Sizes;
var<uniform> place: Place;
var<storage, read> depths: array<u32>;
var<storage, read_write> filled: array<u32>;

// Holes are filled to twice this power of two in width, texels; 0 are none.
override LEVELS: u32 = 2u;

// Depths differ by less than this share of the nearer where they are one surface.
const SAME_SURFACE = 0.4;

// Texels that are looked past where a hole shows what lies behind: holes between discs are about so wide.
// More of them let less through a closed surface and close more of what is open; measured, this is where
// pictures are nearest to those of traced paths.
const THROUGH = 4u;

// The first texel from a hole in a direction that has something nearer than `own`, both as one over the
// depth: that, else 0.
fn first_from(map: u32, at: vec2<u32>, step: vec2<i32>, own: f32) -> f32 {
    let side = i32(sizes.side);
    var texel = vec2<i32>(at);
    let reach = select(min(THROUGH, 1u << LEVELS), 1u << LEVELS, own == 0.0);
    for (var i = 0u; i < reach; i++) {
        texel += step;
        if any(texel < vec2(0)) || any(texel >= vec2(side)) {
            return 0.0;
        }
        let found = bitcast<f32>(depths[map + u32(texel.y * side + texel.x)]);
        if found > 0.0 && found * (1.0 - SAME_SURFACE) > own {
            return found;
        }
    }
    return 0.0;
}

// What lies on either side of a hole, the farther of the two; 0 where that is not one surface.
fn across(map: u32, at: vec2<u32>, step: vec2<i32>, own: f32) -> f32 {
    let one = first_from(map, at, step, own);
    if one == 0.0 {
        return 0.0;
    }
    let other = first_from(map, at, -step, own);
    let farther = min(one, other);
    return select(0.0, farther, farther >= max(one, other) * (1.0 - SAME_SURFACE));
}

@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= vec2(sizes.side)) {
        return;
    }
    let map = id.z * sizes.side * sizes.side;
    let here = map + id.y * sizes.side + id.x;
    var found = bitcast<f32>(depths[here]);
    let center = hemisphere::center_of(vec2<i32>(id.xy), sizes.side);
    if LEVELS > 0u && dot(center, center) <= 1.0 {
        var around = vec4(
            across(map, id.xy, vec2(1, 0), found),
            across(map, id.xy, vec2(0, 1), found),
            0.0,
            0.0,
        );
        // Most texels show a surface that nothing stands before: their diagonals are not gone through.
        if found == 0.0 || any(around.xy > vec2(0.0)) {
            around.z = across(map, id.xy, vec2(1, 1), found);
            around.w = across(map, id.xy, vec2(1, -1), found);
        }
        let n = dot(vec4<f32>(around > vec4(0.0)), vec4(1.0));
        // What is behind shows through a hole only where two ways across it, a straight one among them, end
        // at the surface.
        if n >= select(1.0, 2.0, found > 0.0) {
            found = dot(around, vec4(1.0)) / n;
        }
    }
    filled[place.first * sizes.side * sizes.side + here] = bitcast<u32>(found);
}
