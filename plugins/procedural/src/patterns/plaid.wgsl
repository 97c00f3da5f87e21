// A woven tartan: coloured threads in three directions, over and under in a twill.
#import surfelshop::noise::Place
#import surfelshop::filtered::Filtered
#import surfelshop::filtered
#import procedural::pattern::{Look, octave, frequency, phase}

const RED = vec3(0.42, 0.02, 0.03);
const GREEN = vec3(0.02, 0.10, 0.04);
const NAVY = vec3(0.015, 0.025, 0.12);
const YELLOW = vec3(0.75, 0.55, 0.06);

// The colour of the threads that lie side by side along a direction.
fn threads(x: Filtered) -> vec3<f32> {
    let green = filtered::pulse(x, 0.36);
    let navy = filtered::pulse(filtered::scaled(x, 1.0, -0.10), 0.16);
    let yellow = filtered::pulse(filtered::scaled(x, 1.0, -0.66), 0.045);
    return mix(mix(mix(RED, GREEN, green), NAVY, navy), YELLOW, yellow);
}

fn look(at: Place, albedo: vec3<f32>) -> Look {
    let sets = frequency();
    let x = threads(phase(at, sets * vec3(1.0, 0.0, 0.0)));
    let y = threads(phase(at, sets * vec3(0.0, 1.0, 0.0)));
    let z = threads(phase(at, sets * vec3(0.0, 0.0, 1.0)));
    // On a surface that faces an axis the threads along it do not change: the twill shows the other
    // two in turns.
    let twill = filtered::wave(phase(at, 16.0 * sets * vec3(1.0, 1.0, 1.0)));
    let weave = filtered::wave(phase(at, 16.0 * sets * vec3(1.0, -1.0, 0.5)));
    let over = 1.0 / 3.0 + 0.2 * vec3(twill, -twill, 0.0);
    let cloth = over.x * x + over.y * y + over.z * z;
    // Between threads it is darker, and no two threads are quite the same.
    let fibre = 1.0 + 0.12 * weave + 0.5 * octave(at, 24.0 * sets, 3u).mean;
    return Look(albedo * cloth * max(fibre, 0.0), 0.08, 0.75, 0.0);
}
