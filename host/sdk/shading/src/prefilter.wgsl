// One level of the prefiltered map: the environment as a lobe around each direction gathers it.
//
// Samples follow the lobe; each reads the mip level whose texels are as large as the share of the
// sphere that the sample stands for, which leaves neither noise nor sparkle of small lights.
//
// Source: Krivanek & Colbert 2008, "Real-time Shading with Filtered Importance Sampling"; Karis
// 2013 for the lobe seen along the normal.
#import surfelshop::environment

struct Lobe {
    // Side of this level, texels.
    side: f32,
    // Width of the GGX lobe (the square of the roughness); 0 for the Gaussian.
    alpha: f32,
    // Concentration of the spherical Gaussian, 1 / sigma^2; 0 for GGX. Both 0 make a mirror.
    kappa: f32,
    n_samples: u32,
}

var<uniform> lobe: Lobe;

const PI = 3.14159265;

// The points i / n and the bits of i mirrored at the binary point: evenly over the unit square.
fn hammersley(i: u32) -> vec2<f32> {
    return vec2(
        (f32(i) + 0.5) / f32(lobe.n_samples),
        (f32(reverseBits(i) >> 8u) + 0.5) * 5.9604645e-8,
    );
}

@fragment
fn prefilter(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
    let center = environment::direction_of(vec2<u32>(p.xy), lobe.side);
    if lobe.alpha <= 0.0 && lobe.kappa <= 0.0 {
        // A mirror: a texel of this level as it is.
        let level = environment::level_of_solid_angle(4.0 * PI / (lobe.side * lobe.side));
        return vec4(environment::stored(center, level), 1.0);
    }
    let up = select(vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0), abs(center.z) > 0.9);
    let u = normalize(cross(up, center));
    let v = cross(center, u);
    var sum = vec3(0.0);
    var weights = 0.0;
    for (var i = 0u; i < lobe.n_samples; i++) {
        let at = hammersley(i);
        let phi = 2.0 * PI * at.y;
        var cosine = 1.0;
        var density = 1.0;
        var weight = 1.0;
        if lobe.alpha > 0.0 {
            // The half vector follows the distribution, the light is mirrored about it.
            let a2 = lobe.alpha * lobe.alpha;
            let half2 = (1.0 - at.x) / (1.0 + (a2 - 1.0) * at.x);
            let base = half2 * (a2 - 1.0) + 1.0;
            density = a2 / (PI * base * base) * 0.25;
            cosine = 2.0 * half2 - 1.0;
            // What remains of the reflectance times the cosine, seen along the normal: masking by
            // Heitz 2014, equation 99. (Karis weights with the cosine, which is near it.)
            weight = 2.0 * cosine / (cosine + sqrt(a2 + (1.0 - a2) * cosine * cosine));
        } else {
            let low = exp(-2.0 * lobe.kappa);
            cosine = 1.0 + log(low + (1.0 - low) * (1.0 - at.x)) / lobe.kappa;
            density = lobe.kappa / (2.0 * PI * (1.0 - low)) * exp(lobe.kappa * (cosine - 1.0));
        }
        if weight <= 0.0 {
            continue;
        }
        let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
        let direction = sine * (cos(phi) * u + sin(phi) * v) + cosine * center;
        let level = environment::level_of_solid_angle(1.0 / (f32(lobe.n_samples) * density));
        sum += weight * environment::stored(direction, level);
        weights += weight;
    }
    return vec4(sum / max(weights, 1e-6), 1.0);
}
