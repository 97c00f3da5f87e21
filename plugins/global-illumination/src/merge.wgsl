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
var matte: texture_2d<f32>;
var shiny: texture_2d<f32>;
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
    matte: vec3<f32>,
    shiny: vec3<f32>,
}

// Every window weighs each of the n^2 kinds of pixels alike: a square of n x n, or a tent of twice the
// width, which is a square spread over a square.
fn merged(s: Surface) -> Light {
    let n = i32(settings.interleaving);
    let at = vec2<i32>(s.pixel);
    var low = vec2(0);
    var high = vec2(0);
    if settings.smoothing == 1u && n > 1 {
        low = vec2(-(n - 1) / 2);
        high = low + n - 1;
    }
    if settings.smoothing == 2u && n > 1 {
        high = vec2(n - 1);
        low = -high;
    }
    let size = vec2<i32>(view::view.size_px);
    var light = Light(vec3(0.0), vec3(0.0));
    var weights = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let pixel = at + vec2(x, y);
            if any(pixel < vec2(0)) || any(pixel >= size) {
                continue;
            }
            let other = surface::surface_at(vec2<u32>(pixel));
            var weight = likeness(s, other);
            if settings.smoothing == 2u {
                weight *= f32((n - abs(x)) * (n - abs(y)));
            }
            light.matte += weight * textureLoad(matte, pixel, 0).rgb;
            if COMPENSATES {
                light.matte += weight * textureLoad(missing, pixel, 0).rgb;
            }
            if material::shines() {
                light.shiny += weight * textureLoad(shiny, pixel, 0).rgb;
            }
            weights += weight;
        }
    }
    // A pixel is like itself, so that there is some weight.
    return Light(light.matte / max(weights, 1e-6), light.shiny / max(weights, 1e-6));
}

fn reflect_light(s: Surface) -> vec4<f32> {
    var radiance = vec3(0.0);
    if settings.direct == 1u {
        radiance = textureLoad(direct_light, s.pixel, 0).rgb;
    }
    let light = merged(s);
    return vec4(radiance + s.albedo * body.diffuse * light.matte + light.shiny, 1.0);
}
