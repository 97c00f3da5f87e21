// Light of the pixels of a block is merged, as far as they show one surface, and reflected.
//
// Source: Keller & Heidrich 2001; Preiner 2010, section 3 (geometry-aware filter).
#import surfelshop::view
#import surfelshop::surface::Surface
#import surfelshop::surface
#import gi::material::Material
#import gi::material

struct Settings {
    // Pixels on a side of a block.
    interleaving: u32,
    // How far pixels are merged: 0 is not at all, 1 a block, 2 a block with the ones around it.
    smoothing: u32,
    // Whether direct light counts.
    direct: u32,
}

// Whether there is light that lights have left out near surfaces.
override COMPENSATES: bool = true;

var<uniform> settings: Settings;
var<uniform> body: Material;
var direct_light: texture_2d<f32>;
var diffuse_light: texture_2d<f32>;
var specular_light: texture_2d<f32>;
var missing: texture_2d<f32>;

// How much another pixel shows the same surface: its normal is within about 25 degrees, and it lies
// near the plane of this one by the width of so many pixels there.
fn likeness(s: Surface, other: Surface) -> f32 {
    if !other.covered {
        return 0.0;
    }
    let turned = clamp((dot(s.normal, other.normal) - 0.9) * 20.0, 0.0, 1.0);
    let off_plane = abs(dot(other.position - s.position, s.normal));
    let width = length(surface::footprint(s).across) * f32(settings.interleaving);
    return turned * clamp(2.0 - off_plane / max(width, 1e-30), 0.0, 1.0);
}

struct Light {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
}

// Light that lights left out is gathered at few places around each pixel, however many lights a pixel takes:
// it is merged over windows of so many pixels at least.
const GATHERED = 4;

// Weight of a pixel in a window of `n` pixels on a side that weighs each of n^2 kinds of pixels alike: a
// square, or a tent of twice the width, which is a square spread over a square.
fn weight_in(n: i32, away: vec2<i32>) -> f32 {
    if settings.smoothing == 2u {
        return f32(max(n - abs(away.x), 0) * max(n - abs(away.y), 0));
    }
    let low = -(n - 1) / 2;
    return select(0.0, 1.0, all(away >= vec2(low)) && all(away < vec2(low + n)));
}

fn merged(s: Surface) -> Light {
    let smooths = settings.smoothing > 0u;
    let n = select(1, i32(settings.interleaving), smooths);
    let n_missing = select(1, max(n, GATHERED), smooths && COMPENSATES);
    let reach = max(n, n_missing) - 1;
    let at = vec2<i32>(s.pixel);
    let size = vec2<i32>(view::view.size_px);
    var light = Light(vec3(0.0), vec3(0.0));
    var left_out = vec3(0.0);
    var weights = vec2(0.0);
    for (var y = -reach; y <= reach; y++) {
        for (var x = -reach; x <= reach; x++) {
            let away = vec2(x, y);
            let pixel = at + away;
            let weight = vec2(weight_in(n, away), weight_in(n_missing, away));
            if all(weight == vec2(0.0)) || any(pixel < vec2(0)) || any(pixel >= size) {
                continue;
            }
            let alike = weight * likeness(s, surface::surface_at(vec2<u32>(pixel)));
            if alike.x > 0.0 {
                light.diffuse += alike.x * textureLoad(diffuse_light, pixel, 0).rgb;
                if material::shines() {
                    light.specular += alike.x * textureLoad(specular_light, pixel, 0).rgb;
                }
            }
            if COMPENSATES {
                left_out += alike.y * textureLoad(missing, pixel, 0).rgb;
            }
            weights += alike;
        }
    }
    // A pixel is like itself, so that there is some weight.
    weights = max(weights, vec2(1e-6));
    return Light(light.diffuse / weights.x + left_out / weights.y, light.specular / weights.x);
}

fn reflect_light(s: Surface) -> vec4<f32> {
    var radiance = vec3(0.0);
    if settings.direct == 1u {
        radiance = textureLoad(direct_light, s.pixel, 0).rgb;
    }
    let light = merged(s);
    return vec4(radiance + s.albedo * body.diffuse * light.diffuse + light.specular, 1.0);
}
