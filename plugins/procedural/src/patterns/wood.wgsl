// Wood: rings around an upright axis through the middle, with fibres along it.
#import surfelshop::noise::Place
#import surfelshop::noise as lattices
#import surfelshop::filtered::Filtered
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm_from, octave, frequency}

const EARLY = vec3(0.58, 0.34, 0.16);
const LATE = vec3(0.27, 0.11, 0.04);

fn look(at: Place, albedo: vec3<f32>) -> Look {
    // The trunk is not quite round, and its rings waver along it.
    let grain = frequency() * vec3(0.5, 0.12, 0.5);
    let wavering = fbm_from(at, grain);
    let from_axis = lattices::position(at).xz - 0.5;
    let away = max(length(from_axis), 1e-6);
    // The pixel's outline in units of rings.
    let rings = 3.0 * frequency().x;
    let out = from_axis / away;
    let reach = vec2(dot(at.across.xz, out), dot(at.along.xz, out)) * rings;
    let ring = filtered::sum(
        Filtered(away * rings, sqrt(dot(reach, reach) / 12.0)),
        filtered::scaled(wavering, 2.0, 0.0),
    );
    // Wood of spring turns to that of late summer slowly, and ends at once: half a wave and the
    // first overtone.
    let year = 0.5 + 0.5 * filtered::wave(ring) + 0.2 * filtered::wave(filtered::scaled(ring, 2.0, 0.1));
    let pores = filtered::ramp(octave(at, frequency() * vec3(48.0, 2.0, 48.0), 5u), 0.1, 0.6);
    let fibre = octave(at, frequency() * vec3(20.0, 0.8, 20.0), 7u).mean;
    var color = mix(EARLY, LATE, clamp(year, 0.0, 1.0));
    color = color * (1.0 + 0.35 * fibre) * (1.0 - 0.45 * pores);
    return Look(albedo * color, 0.25, 0.45, 0.0);
}
