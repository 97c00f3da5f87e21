// Cubes of two greys in turns: the pattern whose answer is known.
#import surfelshop::noise::Place
#import surfelshop::noise as lattices
#import procedural::pattern::{Look, frequency, square}

fn look(at: Place, albedo: vec3<f32>) -> Look {
    // Two cubes are one wave.
    let waves = 0.5 * frequency();
    let l = lattices::lattice(at, waves);
    let f = lattices::counted(waves);
    let wide = (abs(at.across) + abs(at.along)) * f;
    let turn = square(l.rest.x, wide.x) * square(l.rest.y, wide.y) * square(l.rest.z, wide.z);
    return Look(albedo * mix(0.05, 0.8, 0.5 + 0.5 * turn), 0.0, 0.5, 0.0);
}
