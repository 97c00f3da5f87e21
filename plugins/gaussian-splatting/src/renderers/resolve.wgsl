// From sums over splats to what outputs show.

struct Settings {
    // 1 where splats have sRGB-encoded colours.
    encoded: u32,
    // 1 where there is a surface besides.
    has_surface: u32,
}

var<uniform> settings: Settings;
var sums: texture_2d<f32>;
var picture: texture_storage_2d<rgba32float, write>;
var behind: texture_2d<f32>;

fn decoded(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

fn encoded(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3(0.0031308));
}

// Splats over what is behind them, in the space that they were trained in: over black where nothing is.
@compute @workgroup_size(8, 8)
fn color(@builtin(global_invocation_id) at: vec3<u32>) {
    let pixel = at.xy;
    let sum = max(textureLoad(sums, pixel, 0), vec4(0.0));
    var shown = sum.rgb;
    var coverage = min(sum.w, 1.0);
    if settings.has_surface == 1u {
        let surface = max(textureLoad(behind, pixel, 0), vec4(0.0));
        let left = max(1.0 - sum.w, 0.0);
        if settings.encoded == 1u {
            shown += left * encoded(surface.rgb);
        } else {
            shown += left * surface.rgb;
        }
        coverage += left * surface.w;
    }
    if settings.encoded == 1u {
        shown = decoded(shown);
    }
    textureStore(picture, pixel, vec4(shown, coverage));
}

@compute @workgroup_size(8, 8)
fn normal(@builtin(global_invocation_id) at: vec3<u32>) {
    let sum = textureLoad(sums, at.xy, 0);
    let length = length(sum.xyz);
    let is_there = length > 0.0;
    let normal = vec4(select(vec3(0.0), sum.xyz / length, is_there), select(0.0, 1.0, is_there));
    textureStore(picture, at.xy, normal);
}
