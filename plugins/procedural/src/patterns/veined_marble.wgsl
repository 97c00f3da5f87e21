// White marble: grey veins along folded layers, in clouds of grey, and ochre threads across.
#import surfelshop::noise::Place
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm, octave, frequency, phase}

const WHITE = vec3(0.84, 0.82, 0.78);
const GREY = vec3(0.16, 0.17, 0.20);
const OCHRE = vec3(0.55, 0.38, 0.18);

fn look(at: Place, albedo: vec3<f32>) -> Look {
    // Tilted layers that noise folds; veins between them.
    let folds = fbm(at);
    let layers = phase(at, frequency() * vec3(0.44, 0.60, 0.24));
    let folded = filtered::sum(layers, filtered::scaled(folds, 1.8, 0.0));
    // Veins are strong in some places and missing in others.
    let strength = filtered::ramp(octave(at, 0.6 * frequency(), 19u), -0.25, 0.30);
    let vein = strength * filtered::lines(folded, 0.022);
    let shade = (0.3 + 0.7 * strength) * filtered::lines(folded, 0.14);
    let thread = (1.0 - strength) * filtered::line(octave(at, 1.1 * frequency(), 17u), 0.012);
    var color = mix(WHITE, GREY, 0.30 * shade);
    color = mix(color, OCHRE, 0.5 * thread);
    color = mix(color, GREY, 0.85 * vein);
    return Look(albedo * color * (1.0 + 0.15 * folds.mean), 0.5, 0.3, 0.0);
}
