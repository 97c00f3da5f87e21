// Brushed metal: scratches around the upright axis, as from a lathe.
#import surfelshop::noise::Place
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm_from, octave, frequency}

const STEEL = vec3(0.56, 0.57, 0.58);

fn look(at: Place, albedo: vec3<f32>) -> Look {
    let scratches = octave(at, frequency() * vec3(0.7, 90.0, 0.7), 1u);
    let deep = filtered::ramp(octave(at, frequency() * vec3(1.3, 37.0, 1.3), 2u), 0.15, 0.6);
    let smudges = fbm_from(at, frequency());
    let color = STEEL * (1.0 + 0.5 * scratches.mean) * (1.0 - 0.35 * deep);
    // Scratches finer than the pixel widen its highlight instead.
    let roughness = clamp(
        0.28 + 0.25 * scratches.mean + 0.4 * scratches.deviation + 0.12 * smudges.mean, 0.05, 1.0,
    );
    return Look(min(albedo, vec3(1.0)) * max(color, vec3(0.0)), 0.9, roughness, 1.0);
}
