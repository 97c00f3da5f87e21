// What virtual point lights send to the pixels: of n x n neighbours each takes every n^2-th light, with
// n^2 times its flux, so that brightness does not depend on n (erratum P3).
//
// Source: Keller & Heidrich 2001, "Interleaved Sampling"; Preiner 2010, section 4.4.
#import surfelshop::view
#import surfelshop::surface::Surface
#import surfelshop::surface
#import gi::maps
#import gi::hemisphere
#import gi::material
#import gi::material::Material
#import gi::vpl::DiffuseVpl
#import gi::vpl::SpecularVpl
#import gi::vpl

struct Settings {
    // Lights of a bounce, and bounces.
    n_vpls: u32,
    n_bounces: u32,
    // Pixels on a side of a block whose pixels share the lights.
    interleaving: u32,
    // Moves which lights a pixel of a block takes.
    turn: u32,
    // Square of the radius, units of the extent, within which a light does not get stronger.
    radius_squared: f32,
    // 1 where it is bounded, 0 where it is a disc.
    bounded: u32,
    // Units of the extent that a shadow begins behind its occluder, besides what texels leave open.
    thickness: f32,
}

var<uniform> settings: Settings;
var<uniform> sizes: maps::Sizes;
var<uniform> body: Material;
var<storage, read> diffuse_vpls: array<DiffuseVpl>;
var<storage, read> specular_vpls: array<SpecularVpl>;
var<storage, read> maps_filled: array<u32>;
var diffuse_light: texture_storage_2d<rgba32float, write>;
var specular_light: texture_storage_2d<rgba32float, write>;

// Whether what lies at a distance in a direction of the light is seen from there.
fn is_visible(map: u32, normal: vec3<f32>, direction: vec3<f32>, distance: f32, receiver_cosine: f32) -> bool {
    let local = hemisphere::to_local(hemisphere::axes_around(normal), direction);
    let place = hemisphere::place_of(local);
    let texel = hemisphere::texel_of(place, sizes.side);
    let bits = maps_filled[(map * sizes.side + u32(texel.y)) * sizes.side + u32(texel.x)];
    // Within a texel a plane at this angle changes its depth by so much, and half as much beyond it:
    // filled texels have what lies beside them.
    let slope = min(sqrt(1.0 - min(receiver_cosine * receiver_cosine, 1.0)) / receiver_cosine, 8.0);
    let open = 1.5 * distance * hemisphere::width_at(place, sizes.side) * slope + settings.thickness;
    return bits == 0u || 1.0 / bitcast<f32>(bits) >= distance - open;
}

struct Light {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
}

// What one light sends to a surface at a place.
fn light_of(map: u32, s: Surface, position: vec3<f32>) -> Light {
    let none = Light(vec3(0.0), vec3(0.0));
    let offset = diffuse_vpls[map].position - position;
    let square = dot(offset, offset);
    let direction = offset * inverseSqrt(max(square, 1e-20));
    let receiver_cosine = dot(s.normal, direction);
    let normal = diffuse_vpls[map].normal;
    let vpl_cosine = -dot(normal, direction);
    // What lies on the light itself has no direction to it.
    let counts = diffuse_vpls[map].valid == 1u && square > 1e-14 && receiver_cosine > 0.0 && vpl_cosine > 0.0;
    if !counts || !is_visible(map, normal, -direction, sqrt(square), receiver_cosine) {
        return none;
    }
    let near = vpl::bounded_falloff(square, settings.radius_squared, settings.bounded) * vpl_cosine;
    var light = Light(diffuse_vpls[map].diffuse * (near * receiver_cosine), vec3(0.0));
    if material::shines() {
        // What a disc of the radius takes up of what is seen.
        let variance = settings.radius_squared / (square + settings.radius_squared);
        let specular_vpl = specular_vpls[map];
        let lobe = material::highlight(body, normal, specular_vpl.incoming, -direction, variance);
        let sent = diffuse_vpls[map].diffuse + specular_vpl.flux * (lobe / diffuse_vpls[map].cosine);
        light.diffuse = sent * (near * receiver_cosine);
        light.specular = sent * (near * material::highlight(body, s.normal, direction, s.to_eye, variance));
    }
    return light;
}

@compute @workgroup_size(8, 8)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    // Groups of pixels that take the same lights.
    let n = settings.interleaving;
    let size = vec2<u32>(view::view.size_px);
    let across = (size + n - 1u) / n;
    let pixel = (id.xy % across) * n + id.xy / across;
    if any(pixel >= size) || any(id.xy >= across * n) {
        return;
    }
    let s = surface::surface_at(pixel);
    var sum = Light(vec3(0.0), vec3(0.0));
    if s.covered {
        let position = (s.position + view::view.world_from_view[3].xyz) * sizes.per_extent;
        let share = (pixel.x % n + n * (pixel.y % n) + settings.turn) % (n * n);
        for (var bounce = 0u; bounce < settings.n_bounces; bounce++) {
            for (var i = share; i < settings.n_vpls; i += n * n) {
                let light = light_of(bounce * settings.n_vpls + i, s, position);
                sum.diffuse += light.diffuse;
                if material::shines() {
                    sum.specular += light.specular;
                }
            }
        }
    }
    // A light's flux is in units of pi, of which what it sends has one over pi; a white surface radiates
    // one over pi of what arrives.
    let weight = f32(n * n) * 0.31830989;
    textureStore(diffuse_light, pixel, vec4(sum.diffuse * weight, 1.0));
    if material::shines() {
        textureStore(specular_light, pixel, vec4(sum.specular * weight, 1.0));
    }
}
