// The next virtual point lights: each light sends its flux on in one direction, chosen in proportion to
// what it reflects there, and the surfel that its shadow map shows in that direction is the new light.
//
// Choosing by the reflection, with its probability known, replaces the paper's depth test, whose winner
// has none (erratum P6); direct light is in the first set alone (erratum P4).
//
// Source: Keller 1997, "Instant Radiosity" (random walks); Preiner 2010, section 4.5.
#import surfelshop::surfels
#import gi::maps
#import gi::hemisphere
#import gi::random
#import gi::material
#import gi::material::Material
#import gi::vpl::Vpl
#import gi::vpl

struct Step {
    // Which bounce is left, from 0.
    bounce: u32,
    // Frames since something changed.
    frame: u32,
}

// Where a light sends its flux.
struct Ray {
    // World-oriented unit vector.
    direction: vec3<f32>,
    // The texel of its map that it goes through; none where there is nothing.
    texel: u32,
    // Flux that it takes.
    flux: vec3<f32>,
    // One over the depth there.
    inverse_depth: f32,
}

const NOWHERE = 0xffffffffu;

var<uniform> step: Step;
var<uniform> sizes: maps::Sizes;
var<uniform> body: Material;
var<storage, read> scene: array<surfels::Record>;
var<storage, read> vpls: array<Vpl>;
var<storage, read> depths: array<u32>;
var<storage, read> filled: array<u32>;
var<storage, read_write> rays: array<Ray>;
var<storage, read> sent: array<Ray>;
var<storage, read_write> hits: array<atomic<u32>>;
var<storage, read> found: array<u32>;
var<storage, read_write> next: array<Vpl>;

fn number(i: u32, dimension: u32) -> f32 {
    return random::fraction(random::mixed(i + 8192u * random::mixed(step.frame * 64u + step.bounce * 8u + dimension)));
}

@compute @workgroup_size(64)
fn send(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= sizes.n_maps {
        return;
    }
    let v = vpls[i];
    rays[i] = Ray(vec3(0.0), NOWHERE, vec3(0.0), 0.0);
    if v.valid == 0u {
        return;
    }
    let axes = hemisphere::axes_around(v.normal);
    let incoming = hemisphere::to_local(axes, v.incoming);
    let at = vec2(number(i, 0u), number(i, 1u));
    let turn = 6.2831853 * at.y;
    var direction = vec3(vec2(cos(turn), sin(turn)) * sqrt(at.x), sqrt(1.0 - at.x));
    if material::shines() && number(i, 2u) < 0.5 {
        let squared = pow(1.0 - at.x, 2.0 / (body.shininess + 1.0));
        let r = sqrt(max(1.0 - squared, 0.0));
        let half_vector = vec3(vec2(cos(turn), sin(turn)) * r, sqrt(squared));
        direction = reflect(-incoming, half_vector);
    }
    if direction.z <= 1e-4 {
        return;
    }
    // Reflected over what the direction was chosen by.
    var density = direction.z * 0.31830989;
    var reflected = v.albedo * (body.diffuse * 0.31830989 * direction.z);
    if material::shines() {
        let half_vector = normalize(incoming + direction);
        let c = max(half_vector.z, 0.0);
        let of_half = (body.shininess + 1.0) * 0.15915494 * pow(c, body.shininess);
        density = 0.5 * density + 0.125 * of_half / max(dot(incoming, half_vector), 1e-4);
        let lobe = material::highlight(body, vec3(0.0, 0.0, 1.0), incoming, direction, 0.0);
        reflected += vec3(lobe * 0.31830989 * direction.z / v.cosine);
    }
    let place = hemisphere::place_of(direction);
    let texel = hemisphere::texel_of(place, sizes.side);
    let first = i * sizes.side * sizes.side;
    let before = step.bounce * sizes.n_maps * sizes.side * sizes.side;
    let there = filled[before + first + u32(texel.y) * sizes.side + u32(texel.x)];
    if there == 0u || density <= 0.0 {
        return;
    }
    let hit = nearest_known(first, texel, bitcast<f32>(there));
    let inverse_depth = select(0.0, bitcast<f32>(depths[first + hit]), hit != NOWHERE);
    rays[i] = Ray(hemisphere::from_local(axes, direction), hit, v.flux * reflected / density, inverse_depth);
}

// The texel nearest to one whose surfel is known and about as far away as a filled one says.
fn nearest_known(first: u32, texel: vec2<i32>, inverse_depth: f32) -> u32 {
    var best = NOWHERE;
    var least = 1e9;
    let last = i32(sizes.side) - 1;
    for (var y = max(texel.y - 8, 0); y <= min(texel.y + 8, last); y++) {
        for (var x = max(texel.x - 8, 0); x <= min(texel.x + 8, last); x++) {
            let here = u32(y) * sizes.side + u32(x);
            let depth = bitcast<f32>(depths[first + here]);
            let away = vec2<f32>(vec2(x, y) - texel);
            let square = dot(away, away);
            let is_near = depth > 0.7 * inverse_depth && depth < 1.4 * inverse_depth;
            if is_near && square < least {
                best = here;
                least = square;
            }
        }
    }
    return best;
}

// Every surfel that is what its map shows in the direction of the ray offers itself.
@compute @workgroup_size(64)
fn offer(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let i = maps::number_of(id, groups);
    if i >= sizes.n_surfels {
        return;
    }
    let map = maps::map_of(i, sizes);
    let ray = sent[map];
    let v = vpls[map];
    if ray.texel == NOWHERE || v.surfel == i + 1u {
        return;
    }
    let texel = vec2(i32(ray.texel % sizes.side), i32(ray.texel / sizes.side));
    let disc = maps::disc_from(scene[i * sizes.stride], v, sizes);
    if !disc.is_visible {
        return;
    }
    let depth = maps::depth_at(disc, texel, sizes);
    // Drivers may round otherwise here than where the map was drawn.
    if depth > 0.0 && abs(1.0 / depth - ray.inverse_depth) <= 1e-4 * ray.inverse_depth {
        atomicMax(&hits[map], i + 1u);
    }
}

@compute @workgroup_size(64)
fn arrive(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= sizes.n_maps {
        return;
    }
    next[i] = vpl::none();
    let ray = sent[i];
    let surfel = found[i];
    if surfel == 0u || ray.texel == NOWHERE {
        return;
    }
    let s = surfels::surfel_of(scene[(surfel - 1u) * sizes.stride]);
    var v = vpl::none();
    v.position = s.position * sizes.per_extent;
    v.surfel = surfel;
    v.normal = select(s.normal, -s.normal, dot(s.normal, ray.direction) > 0.0);
    v.flux = ray.flux;
    v.albedo = s.albedo;
    v.incoming = -ray.direction;
    v.cosine = max(dot(v.normal, v.incoming), vpl::LEAST_COSINE);
    v.valid = 1u;
    next[i] = v;
}
