// A pattern on the surface.
//
// The pattern's own file comes along as `procedural::chosen`.
#import surfelshop::surface::Surface
#import surfelshop::surface
#import surfelshop::noise::Place
#import procedural::pattern::{Look, warped}
#import procedural::chosen

// A cloud's anchor in the pattern, and the way there from world-oriented vectors.
struct Object {
    anchor_high: vec3<f32>,
    anchor_middle: vec3<f32>,
    anchor_low: vec3<f32>,
    pattern_from_world: mat3x3<f32>,
    // Factor on the albedo, which makes clouds without colours white.
    whiten: f32,
}

struct Settings {
    // How much the cloud's own colour counts.
    own_color: f32,
    // 1 where the pattern is filtered over the pixel, else 0.
    filtered: f32,
    specular: f32,
    ambient: f32,
    ao_strength: f32,
    ao_affects: u32,
}

var<uniform> shown: Settings;

// Whether the cloud's own colour counts: a feature of the pass.
override OWN_COLOR: bool = true;
var<storage, read> objects: array<Object>;

fn place_of(s: Surface) -> Place {
    let o = objects[surface::object_at(s.pixel)];
    let outline = surface::footprint(s);
    let to_pattern = o.pattern_from_world;
    return Place(
        o.anchor_high,
        o.anchor_middle,
        o.anchor_low,
        to_pattern * s.position,
        to_pattern * outline.across * shown.filtered,
        to_pattern * outline.along * shown.filtered,
    );
}

fn look_of(s: Surface) -> Look {
    var own = vec3(1.0);
    if OWN_COLOR {
        let factor = objects[surface::object_at(s.pixel)].whiten;
        own = mix(own, s.albedo * factor, shown.own_color);
    }
    return chosen::look(warped(place_of(s)), own);
}
