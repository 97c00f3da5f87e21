// Places the first virtual point lights on what the lights reach, in proportion to what is reflected
// there: points of Halton's sequence, warped down the levels of the importance.
//
// Source: Preiner 2010, section 4.2, with erratum P5: flux over N times the probability.
#import surfelshop::light
#import surfelshop::packing
#import gi::light_views
#import gi::random
#import gi::vpl::Vpl
#import gi::vpl

struct Request {
    // Lights to be placed.
    count: u32,
    // Points of the sequence that other frames have had.
    first: u32,
}

var<uniform> request: Request;
var<uniform> faces: light_views::Faces;
var<storage, read> texels: array<light_views::Texel>;
var<storage, read> importance: array<f32>;
var<storage, read_write> vpls: array<Vpl>;

// A part of a whole, and where a number lies in it: all from 0 to 1.
struct Choice {
    second: bool,
    probability: f32,
    rest: f32,
}

// One of two in proportion to their weights, of which one is above 0.
fn choose(one: f32, other: f32, number: f32) -> Choice {
    let share = one / (one + other);
    if number < share {
        return Choice(false, share, min(number / share, 0.99999994));
    }
    return Choice(true, 1.0 - share, min((number - share) / max(1.0 - share, 1e-30), 0.99999994));
}

fn total_of(face: u32) -> f32 {
    return importance[face * light_views::PYRAMID + light_views::first_of_level(6u)];
}

@compute @workgroup_size(64)
fn distribute(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= request.count {
        return;
    }
    vpls[id.x] = vpl::none();
    // The sequence's first point is a corner.
    var point = random::halton(request.first + id.x + 1u);
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
        let side = light_views::CELLS >> level;
        let corner = face * light_views::PYRAMID + light_views::first_of_level(level) + cell.y * 2u * side + cell.x * 2u;
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
    let across = faces.lit_side / light_views::CELLS;
    let at = cell * across + vec2<u32>(point * f32(across));
    let texel = texels[(face * faces.lit_side + at.y) * faces.lit_side + at.x];
    let f = faces.items[face];
    if texel.flux <= 0.0 || probability <= 0.0 {
        return;
    }
    let source = light::lights.lamps[f.light_index];
    let has_place = source.nearest_squared > 0.0;
    let color = select(light::lights.items[f.light_index].radiance, source.intensity, has_place);
    let brightest = max(color.r, max(color.g, color.b));
    let per_texel = f32(across * across) / (probability * f32(request.count));
    var v = vpl::none();
    v.position = texel.position;
    v.normal = packing::unpack_direction(texel.normal);
    v.flux = color / brightest * (texel.flux * per_texel);
    v.albedo = vec3(unpack2x16float(texel.albedo_rg), unpack2x16float(texel.albedo_b).x);
    // In a face's picture y goes down.
    let pixel = vec2<f32>(at * faces.block + faces.chosen) + 0.5;
    let place = (pixel / f32(faces.side) * 2.0 - 1.0) * vec2(1.0, -1.0) * f.half_extent;
    var towards = f.backward;
    if f.is_parallel == 0u {
        towards = normalize(f.backward - f.right * place.x - f.up * place.y);
    }
    v.incoming = towards;
    v.cosine = max(dot(v.normal, towards), vpl::LEAST_COSINE);
    v.valid = 1u;
    vpls[id.x] = v;
}
