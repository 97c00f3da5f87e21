// The scene's lights, and what of them arrives where.
#define_import_path surfelshop::light

#import surfelshop::view

const MAX_LIGHTS = 8;

// What the scene has, which the host says of every pass. More lights than one; without, software drivers need
// not gather lights by a number that may differ from pixel to pixel.
override SEVERAL: bool = true;
// Lights that have a place.
override PLACED: bool = true;

// Whether loops over the lights end after the first: `if light::is_alone() { break; }` at their end lets compilers
// take such a loop for none.
fn is_alone() -> bool {
    return !SEVERAL;
}

struct Light {
    // Unit vector towards the light, world-oriented; of a light that has a place, as seen from the
    // middle of the scene. `arriving` knows it for every point.
    towards: vec3<f32>,
    // Linear Rec. 709: what a white diffuse surface facing the light radiates, in the middle of the
    // scene where the light has a place.
    radiance: vec3<f32>,
}

// Where a light is and how it shines; of a directional light all is 0.
struct Lamp {
    // From the eye, world-oriented, in units of the surface buffer's depth (`View::unit`), so that
    // squares neither overflow nor vanish whatever the size of the scene.
    position: vec3<f32>,
    // Square of the light's own radius: nearer than that it is no brighter. Above 0 for every light
    // that has a place.
    nearest_squared: f32,
    // What a white diffuse surface facing the light radiates, times the squared distance, in those
    // units; linear Rec. 709.
    intensity: vec3<f32>,
    // Twice one minus the cosine of the angle between a spot's axis and its edge, which is the squared
    // distance of the ends of unit vectors along them; beyond 4 where there is no edge.
    edge: f32,
    // Unit vector against the direction that a spot shines in, world-oriented.
    backwards: vec3<f32>,
    // One over how much of that lies between the edge and full light.
    sharpness: f32,
}

struct Lights {
    items: array<Light, MAX_LIGHTS>,
    count: u32,
    lamps: array<Lamp, MAX_LIGHTS>,
}

@group(0) @binding(1) var<uniform> lights: Lights;

// What of a light arrives at a point, unshadowed.
struct Arriving {
    // Unit vector towards the light, world-oriented; 0 at the light's own place.
    towards: vec3<f32>,
    // What a white diffuse surface facing the light radiates there, linear Rec. 709.
    radiance: vec3<f32>,
}

// What of light number `i` arrives at a position from the eye, world-oriented, in scene units, as
// `Surface::position` is. A light that has a place shines with its intensity over the squared
// distance, a spot only within its cone, from whose edge it rises as a smooth step of the cosine.
//
// Both kinds are computed and one is chosen: Mesa 22.3's lavapipe crashes over a branch in a loop
// over the lights. Twin: `Lamp::arriving` of surfelshop-api.
fn arriving(i: u32, position: vec3<f32>) -> Arriving {
    let number = select(0u, i, SEVERAL);
    let source = lights.items[number];
    if !PLACED {
        return Arriving(source.towards, source.radiance);
    }
    let lamp = lights.lamps[number];
    let offset = lamp.position - position / view::view.unit;
    let squared = dot(offset, offset);
    let towards = offset * inverseSqrt(max(squared, 1e-36));
    let from_axis = towards - lamp.backwards;
    let t = clamp((lamp.edge - dot(from_axis, from_axis)) * lamp.sharpness, 0.0, 1.0);
    let share = t * t * (3.0 - 2.0 * t) / max(squared, max(lamp.nearest_squared, 1e-36));
    let has_place = lamp.nearest_squared > 0.0;
    return Arriving(
        select(source.towards, towards, has_place),
        select(source.radiance, lamp.intensity * share, has_place),
    );
}

// What a white diffuse surface at a position (as for `arriving`) radiates under all lights,
// unshadowed.
fn diffuse_irradiance_at(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var sum = vec3(0.0);
    for (var i = 0u; i < lights.count; i++) {
        let source = arriving(i, position);
        sum += source.radiance * max(dot(normal, source.towards), 0.0);
        if is_alone() {
            break;
        }
    }
    return sum;
}

// The same in the middle of the scene: right everywhere for directional lights alone.
fn diffuse_irradiance(normal: vec3<f32>) -> vec3<f32> {
    var sum = vec3(0.0);
    for (var i = 0u; i < lights.count; i++) {
        let source = lights.items[select(0u, i, SEVERAL)];
        sum += source.radiance * max(dot(normal, source.towards), 0.0);
        if is_alone() {
            break;
        }
    }
    return sum;
}
