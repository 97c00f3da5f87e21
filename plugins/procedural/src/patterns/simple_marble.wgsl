// The thesis's simple marble: dark where noise is near its mean.
//
// Source: Liu 2006, section 5.1 (`SimpleMarble`), with erratum T25: the three channels' sum is one
// channel of mean 1/2.
#import surfelshop::noise::Place
#import surfelshop::filtered
#import procedural::pattern::{Look, fbm}

fn look(at: Place, albedo: vec3<f32>) -> Look {
    let base = vec3(1.0, 0.843, 0.624) * albedo;
    // 0.5 + fbm / 2 is the noise; its distance from 0.5 counts five times.
    let marble = filtered::scaled(filtered::magnitude(filtered::scaled(fbm(at), 0.5, 0.0)), 5.0, 0.2);
    // Dark parts reflect more: 1.1 - 1.3 marble, between 0 and 1.
    let specular = filtered::ramp(filtered::scaled(marble, -1.3, 1.1), 0.0, 1.0);
    // 0.41727 has the exponent 64 of the thesis.
    return Look(marble.mean * base, specular, 0.41727, 0.0);
}
