// Granite: grains of quartz, feldspar and mica.
#import surfelshop::noise::Place
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm_from, octave, frequency}

const QUARTZ = vec3(0.52, 0.51, 0.50);
const FELDSPAR = vec3(0.62, 0.42, 0.34);
const MICA = vec3(0.035, 0.033, 0.03);

fn look(at: Place, albedo: vec3<f32>) -> Look {
    let grains = 5.0 * frequency();
    let feldspar = filtered::ramp(octave(at, grains, 1u), 0.02, 0.10);
    let mica = filtered::ramp(octave(at, 1.7 * grains, 2u), 0.24, 0.30);
    let dust = fbm_from(at, 2.0 * grains).mean;
    var color = mix(QUARTZ, FELDSPAR, feldspar) * (1.0 + 0.5 * dust);
    color = mix(color, MICA, mica);
    return Look(albedo * max(color, vec3(0.0)), 0.3 + 0.5 * mica, mix(0.35, 0.2, mica), 0.0);
}
