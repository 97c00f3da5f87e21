// Rust that eats into painted iron from its weak spots.
#import surfelshop::noise::Place
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm, fbm_from, octave, frequency}

const PAINT = vec3(0.10, 0.22, 0.25);
const IRON = vec3(0.30, 0.29, 0.28);
const FRESH = vec3(0.42, 0.13, 0.03);
const OLD = vec3(0.09, 0.03, 0.018);

fn look(at: Place, albedo: vec3<f32>) -> Look {
    let decay = fbm(at);
    let rusty = filtered::ramp(decay, 0.02, 0.10);
    // The paint flakes off just before the rust.
    let bare = filtered::ramp(decay, -0.03, 0.0);
    let crust = fbm_from(at, 4.0 * frequency());
    let age = filtered::ramp(crust, -0.3, 0.3);
    let pits = filtered::ramp(octave(at, 9.0 * frequency(), 11u), 0.2, 0.5);
    let rust = mix(FRESH, OLD, age) * (1.0 - 0.5 * pits);
    let color = mix(mix(PAINT, IRON, bare), rust, rusty);
    let roughness = mix(mix(0.3, 0.45, bare), 0.9, rusty);
    return Look(albedo * color, mix(0.5, 0.04, rusty), roughness, 0.6 * bare * (1.0 - rusty));
}
