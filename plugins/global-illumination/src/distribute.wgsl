// Places the first virtual point lights on what the lamps light, in proportion to what is reflected
// there: points of Halton's sequence, warped down the levels of the importance.
//
// Source: Preiner 2010, section 4.2, with erratum P5: flux over N times the probability.
#import surfelshop::light
#import surfelshop::packing
#import gi::lamps
#import gi::chance
#import gi::vpl::Vpl
#import gi::vpl

struct Wanted {
    // Lights to be placed.
    count: u32,
    // Points of the sequence that other frames have had.
    first: u32,
}

var<uniform> wanted: Wanted;
var<uniform> faces: lamps::Faces;
var<storage, read> texels: array<lamps::Texel>;
var<storage, read> importance: array<f32>;
var<storage, read_write> vpls: array<Vpl>;

// A part of a whole, and where a number lies in it: all from 0 to 1.
struct Chosen {
    second: bool,
    probability: f32,
    rest: f32,
}

// One of two in proportion to their weights, of which one is above 0.
fn choose(one: f32, other: f32, number: f32) -> Chosen {
    let share = one / (one + other);
    if number < share {
        return Chosen(false, share, min(number / share, 0.99999994));
    }
    return Chosen(true, 1.0 - share, min((number - share) / max(1.0 - share, 1e-30), 0.99999994));
}

fn total_of(face: u32) -> f32 {
    return importance[face * lamps::PYRAMID + lamps::first_of_level(6u)];
}

@compute @workgroup_size(64)
fn distribute(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= wanted.count {
        return;
    }
    vpls[id.x] = vpl::none();
    // The sequence's first point is a corner.
    var point = chance::halton(wanted.first + id.x + 1u);
    var total = 0.0;
    for (var i = 0u; i < faces.count; i++) {
        total += total_of(i);
    }
    if !(total > 0.0) {
        return;
    }
    // A face by the sequence's first number, what is left of which goes on.
    var face = 0u;
    var probability = 0.0;
    var before = 0.0;
    for (var i = 0u; i < faces.count; i++) {
        let share = total_of(i) / total;
        if share > 0.0 && point.x >= before {
            face = i;
            probability = share;
        }
        if share > 0.0 && point.x < before + share {
            break;
        }
        before += share;
    }
    point.x = clamp((point.x - before) / max(probability, 1e-30), 0.0, 0.99999994);
    // Down to a cell: rows first, then columns.
    var cell = vec2(0u);
    for (var step = 0u; step < 6u; step++) {
        let level = 5u - step;
        let side = lamps::CELLS >> level;
        let corner = face * lamps::PYRAMID + lamps::first_of_level(level) + cell.y * 2u * side + cell.x * 2u;
        let upper = vec2(importance[corner], importance[corner + 1u]);
        let lower = vec2(importance[corner + side], importance[corner + side + 1u]);
        let row = choose(upper.x + upper.y, lower.x + lower.y, point.y);
        let pair = select(upper, lower, row.second);
        let column = choose(pair.x, pair.y, point.x);
        cell = cell * 2u + vec2(select(0u, 1u, column.second), select(0u, 1u, row.second));
        point = vec2(column.rest, row.rest);
        probability *= row.probability * column.probability;
    }
    // Any texel of the cell.
    let across = faces.lit_side / lamps::CELLS;
    let at = cell * across + vec2<u32>(point * f32(across));
    let texel = texels[(face * faces.lit_side + at.y) * faces.lit_side + at.x];
    let f = faces.items[face];
    if texel.flux <= 0.0 || probability <= 0.0 {
        return;
    }
    let lamp = light::lights.lamps[f.lamp];
    let has_place = lamp.nearest_squared > 0.0;
    let color = select(light::lights.items[f.lamp].radiance, lamp.intensity, has_place);
    let brightest = max(color.r, max(color.g, color.b));
    let per_texel = f32(across * across) / (probability * f32(wanted.count));
    var v = vpl::none();
    v.position = texel.position;
    v.normal = packing::unpack_direction(texel.normal);
    v.flux = color / brightest * (texel.flux * per_texel);
    v.albedo = vec3(unpack2x16float(texel.albedo_rg), unpack2x16float(texel.albedo_b).x);
    // In a face's picture y goes down.
    let seen = vec2<f32>(at * faces.block + faces.chosen) + 0.5;
    let place = (seen / f32(faces.side) * 2.0 - 1.0) * vec2(1.0, -1.0) * f.half_extent;
    var towards = f.backward;
    if f.is_parallel == 0u {
        towards = normalize(f.backward - f.right * place.x - f.up * place.y);
    }
    v.incoming = towards;
    v.cosine = max(dot(v.normal, towards), vpl::LEAST_COSINE);
    v.alive = 1u;
    vpls[id.x] = v;
}
