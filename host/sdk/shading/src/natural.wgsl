// Natural light on a surface: diffuse from spherical harmonics, specular from a prefiltered map.
//
// `NaturalLight` of this crate binds all of it; a shader says of each pixel what it is made of.
#import surfelshop::surface::Surface
#import surfelshop::environment
#import surfelshop::light
#import surfelshop::occlusion
#import surfelshop::sh

// What reflects the light.
struct Material {
    // Linear Rec. 709.
    albedo: vec3<f32>,
    // Weights of the diffuse and the specular part.
    kd: f32,
    ks: f32,
    // Index of refraction, and what it reflects at a right angle.
    ior: f32,
    f_normal: f32,
    // Thesis model: eccentricity. GGX: roughness.
    spread: f32,
    metallic: f32,
}

struct Lighting {
    // Number of the prefiltered map's last level, that of spread 1.
    last_level: f32,
    // A bit for each of the scene's lights that shines.
    lights: u32,
    // 1 where highlights are widened, else 0.
    antialiasing: f32,
    // How much of the ambient occlusion counts, and the last part of the light that it darkens.
    ao_strength: f32,
    ao_affects: u32,
}

struct Diffuse {
    // What a white diffuse surface radiates, by its normal in probe space.
    low: sh::Order2,
    fourth_band: array<vec4<f32>, 9>,
    sun_towards: vec4<f32>,
    sun_radiance: vec4<f32>,
}

var<uniform> lighting: Lighting;
var<uniform> diffuse: Diffuse;
var prefiltered: texture_2d<f32>;
var prefiltered_sampler: sampler;
// Scale and bias of the reflectance at a right angle, in rows of the root of the
// cosine, row by roughness.
var<storage, read> reflectance: array<vec2<f32>>;

// What there is in this scene: features of the pass. What is not has values that change nothing.
override HAS_BAND_4: bool = true;
override HAS_SUN: bool = true;
override HAS_LIGHTS: bool = true;
// How light is reflected, decided when the pipeline is made.
override CUTS_OFF: bool = true;
override REFLECTS_AGAIN: bool = true;

const PI = 3.14159265;
// Twin: `TABLE_SIDE` of reflectance.rs.
const TABLE_SIDE = 32u;

// Radiance of a white diffuse surface under the environment, unshadowed.
fn white_diffuse(normal: vec3<f32>) -> vec3<f32> {
    let n = environment::probe_from_world(normal);
    var sum = sh::order_2(n, diffuse.low);
    if HAS_BAND_4 {
        sum += sh::order_4_alone(n, diffuse.fourth_band);
    }
    if CUTS_OFF {
        sum = max(sum, vec3(0.0));
    }
    if HAS_SUN {
        sum += diffuse.sun_radiance.xyz * max(dot(n, diffuse.sun_towards.xyz), 0.0);
    }
    return sum;
}

// 1 where a light shines, else 0. Factors and not branches: Mesa 22.3's lavapipe crashes over a
// branch in a loop over the lights.
fn share_of(i: u32) -> f32 {
    return f32((lighting.lights >> i) & 1u);
}

fn from_lights(s: Surface) -> vec3<f32> {
    var sum = vec3(0.0);
    if HAS_LIGHTS {
        for (var i = 0u; i < light::lights.count; i++) {
            let source = light::arriving(i, s.position);
            sum += source.radiance * (share_of(i) * max(dot(s.normal, source.towards), 0.0));
        }
    }
    return sum;
}

// Largest square of a width that is added; beyond it a picture would get dull.
// Source: Tokuyoshi & Kaplanyan 2019, "Improved Geometric Specular Antialiasing".
const MOST_ADDED = 0.18;

// The spread of the ggx model, wider where one pixel shows several normals.
fn spread_ggx(s: Surface, m: Material) -> f32 {
    let alpha = m.spread * m.spread;
    let added = min(2.0 * s.normal_variance, MOST_ADDED) * lighting.antialiasing;
    return sqrt(sqrt(min(alpha * alpha + added, 1.0)));
}

// The same for the thesis's model: the mirrored direction turns twice as far as the normal, and the
// Gaussian of spread 1 is 1.093 wide.
fn spread_thesis(s: Surface, m: Material) -> f32 {
    let added = min(4.0 / 1.195 * s.normal_variance, MOST_ADDED) * lighting.antialiasing;
    return sqrt(min(m.spread * m.spread + added, 1.0));
}

// Light from around a direction, as wide as a spread.
fn reflected(around: vec3<f32>, spread: f32) -> vec3<f32> {
    let mirrored = environment::probe_from_world(around);
    let level = spread * lighting.last_level;
    let low = floor(level);
    let share = level - low;
    // Both levels always: Mesa 22.3's lavapipe crashes over some branches around a sample.
    let next = min(low + 1.0, lighting.last_level);
    let gathered = mix(sample_level(mirrored, low), sample_level(mirrored, next), share);
    return gathered * environment::environment.radiance_per_unit;
}

fn sample_level(direction: vec3<f32>, level: f32) -> vec3<f32> {
    let side = f32(textureDimensions(prefiltered, u32(level)).x);
    let place = environment::place(direction, side);
    return textureSampleLevel(prefiltered, prefiltered_sampler, place, level).rgb;
}

// Share of light that a smooth surface of a dielectric reflects, unpolarised. 1 where all of it is
// (an index below 1, beyond the critical angle), 0 for an index of 1.
//
// Written with g - c = (n - 1) (n + 1) / (g + c), which keeps its digits for an index near 1.
// Source: Liu 2006, section 3.2, with the factor one half (erratum T11).
fn fresnel(cosine: f32, ior: f32) -> f32 {
    let c = clamp(cosine, 0.0, 1.0);
    let excess = (ior - 1.0) * (ior + 1.0);
    let squared = excess + c * c;
    let g = sqrt(max(squared, 0.0));
    let sum = g + c;
    let a = excess / max(sum * sum, 1e-12);
    let b = (c * sum - 1.0) / max(c * (g - c) + 1.0, 1e-6);
    let partial = clamp(0.5 * a * a * (1.0 + b * b), 0.0, 1.0);
    let total = select(1.0, 0.0, ior == 1.0);
    return select(total, partial, squared > 0.0);
}

// Trowbridge and Reitz's distribution, 1 at the peak; the square is what the thesis meant (T9).
fn ellipsoids(normal_half: f32, eccentricity: f32) -> f32 {
    let c2 = eccentricity * eccentricity;
    let d = c2 / (normal_half * normal_half * (c2 - 1.0) + 1.0);
    return select(0.0, d * d, c2 > 0.0);
}

// Scale and bias of the reflectance at a right angle for a cosine and the roughness.
fn scale_and_bias(cosine: f32, spread: f32) -> vec2<f32> {
    let last = f32(TABLE_SIDE - 1u);
    let p = vec2(sqrt(clamp(cosine, 0.0, 1.0)), spread) * last;
    let low = min(vec2<u32>(p), vec2(TABLE_SIDE - 2u));
    let share = p - vec2<f32>(low);
    let at = low.y * TABLE_SIDE + low.x;
    return mix(
        mix(reflectance[at], reflectance[at + 1u], share.x),
        mix(reflectance[at + TABLE_SIDE], reflectance[at + TABLE_SIDE + 1u], share.x),
        share.y,
    );
}

// How open the surface is in the mirrored direction, from how open it is on the whole.
//
// Source: Lagarde & de Rousiers 2014, "Moving Frostbite to Physically Based Rendering", listing 26.
fn specular_accessibility(s: Surface, roughness: f32) -> f32 {
    if occlusion::counts() {
        let cosine = clamp(dot(s.normal, s.to_eye), 0.0, 1.0);
        let open = pow(cosine + s.ao, exp2(-16.0 * roughness - 1.0)) - 1.0 + s.ao;
        return left(clamp(open, 0.0, 1.0), occlusion::REFLECTIONS);
    }
    return 1.0;
}

// What is left of a part of the light.
fn left(open: f32, part: u32) -> f32 {
    return occlusion::share(open, lighting.ao_strength, part, lighting.ao_affects);
}

fn accessibility(s: Surface, part: u32) -> f32 {
    if occlusion::counts() {
        return left(s.ao, part);
    }
    return 1.0;
}

fn specular_thesis(s: Surface, m: Material) -> vec3<f32> {
    let cosine = max(dot(s.normal, s.to_eye), 0.0);
    // With the light in the mirrored direction the half vector is the normal and the distribution
    // is 1: the blur of the map is the lobe (T12).
    let spread = spread_thesis(s, m);
    var sum = reflected(reflect(-s.to_eye, s.normal), spread) * fresnel(cosine, m.ior)
        * specular_accessibility(s, m.spread);
    if HAS_LIGHTS {
        let shown = accessibility(s, occlusion::HIGHLIGHTS);
        for (var i = 0u; i < light::lights.count; i++) {
            let source = light::arriving(i, s.position);
            let half_vector = half_between(source.towards, s.to_eye);
            let lit = shown * share_of(i) * step(0.0, dot(s.normal, source.towards));
            sum += source.radiance * lit * fresnel(dot(s.to_eye, half_vector), m.ior)
                * ellipsoids(max(dot(s.normal, half_vector), 0.0), m.spread);
        }
    }
    return sum;
}

// The unit half vector, or the eye's where the light is behind it.
fn half_between(to_light: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    let sum = to_light + to_eye;
    let squared = dot(sum, sum);
    return select(to_eye, sum * inverseSqrt(max(squared, 1e-12)), squared > 1e-12);
}

// Where most of the light comes from: the rougher a surface, the nearer to its normal.
//
// Source: Lagarde & de Rousiers 2014, listing 22.
fn dominant_direction(s: Surface, spread: f32) -> vec3<f32> {
    let alpha = spread * spread;
    let smooth_share = 1.0 - alpha;
    let mirrored = reflect(-s.to_eye, s.normal);
    return mix(s.normal, mirrored, smooth_share * (sqrt(smooth_share) + alpha));
}

struct Ggx {
    // Light reflected, and the share of all light from everywhere that is.
    radiance: vec3<f32>,
    share: vec3<f32>,
}

// Source: Karis 2013, "Real Shading in Unreal Engine 4" (split sum); light that is reflected more
// than once by Fdez-Aguera 2019, "A Multiple-Scattering Microfacet Model for Real-Time Image-based
// Lighting", equation 20 without its diffuse part.
fn specular_ggx(s: Surface, m: Material) -> Ggx {
    let f0 = mix(vec3(m.f_normal), m.albedo, m.metallic);
    let cosine = max(dot(s.normal, s.to_eye), 0.0);
    let spread = spread_ggx(s, m);
    let table = scale_and_bias(cosine, spread);
    let once = f0 * table.x + table.y;
    let all = max(table.x + table.y, 1e-3);
    var again = vec3(1.0);
    if REFLECTS_AGAIN {
        again += f0 * (1.0 / all - 1.0);
    }
    let share = min(once * again, vec3(1.0));
    var sum = reflected(dominant_direction(s, spread), spread) * share * specular_accessibility(s, spread);
    if HAS_LIGHTS {
        let shown = again * accessibility(s, occlusion::HIGHLIGHTS);
        for (var i = 0u; i < light::lights.count; i++) {
            let source = light::arriving(i, s.position);
            sum += source.radiance * shown * share_of(i) * lobe(s, source.towards, f0, cosine, spread);
        }
    }
    return Ggx(sum, share);
}

// The GGX lobe of a light whose white diffuse radiance is 1, times the cosine.
//
// Source: Walter et al. 2007; visibility by Heitz 2014, "Understanding the Masking-Shadowing
// Function", equation 99.
fn lobe(
    s: Surface,
    towards: vec3<f32>,
    f0: vec3<f32>,
    normal_eye: f32,
    spread: f32,
) -> vec3<f32> {
    let normal_light = max(dot(s.normal, towards), 0.0);
    let half_vector = half_between(towards, s.to_eye);
    // A sharper lobe than this is no light's: real ones have a size.
    let a = max(spread * spread, 0.002);
    let a2 = a * a;
    let v = max(normal_eye, 1e-4);
    let sine = cross(s.normal, half_vector);
    let sine2 = min(dot(sine, sine), 1.0);
    let d = a2 / (PI * pow(a2 + (1.0 - a2) * sine2, 2.0));
    let masking = normal_light * sqrt(a2 + (1.0 - a2) * v * v)
        + v * sqrt(a2 + (1.0 - a2) * normal_light * normal_light);
    let c = 1.0 - clamp(dot(half_vector, s.to_eye), 0.0, 1.0);
    let f = f0 + (1.0 - f0) * pow(c, 5.0);
    // A light's radiance counts as irradiance over pi.
    return PI * d * 0.5 / max(masking, 1e-6) * f * normal_light;
}

// Without an environment: the scene's lights on a diffuse surface, to the last bit what `matte` is
// under one that is black.
fn by_lights(s: Surface, m: Material) -> vec3<f32> {
    return m.kd * m.albedo * (from_lights(s) * accessibility(s, occlusion::DIFFUSE));
}

fn matte(s: Surface, m: Material) -> vec3<f32> {
    let arriving = white_diffuse(s.normal) * accessibility(s, occlusion::AMBIENT)
        + from_lights(s) * accessibility(s, occlusion::DIFFUSE);
    return m.kd * m.albedo * arriving;
}

fn shiny_thesis(s: Surface, m: Material) -> vec3<f32> {
    return m.ks * specular_thesis(s, m);
}

fn thesis(s: Surface, m: Material) -> vec3<f32> {
    return matte(s, m) + shiny_thesis(s, m);
}

fn shiny_ggx(s: Surface, m: Material) -> vec3<f32> {
    return m.ks * specular_ggx(s, m).radiance;
}

fn ggx(s: Surface, m: Material) -> vec3<f32> {
    let specular = specular_ggx(s, m);
    // What is reflected at the surface does not reach the body below it, and a metal has none.
    let passes = (1.0 - m.metallic) * (1.0 - m.ks * specular.share);
    return matte(s, m) * passes + m.ks * specular.radiance;
}
