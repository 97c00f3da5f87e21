// From sums over splats to what outputs show.

struct Settings {
    // 1 where splats have sRGB-encoded colours.
    encoded: u32,
    // 1 where there is a surface besides.
    has_surface: u32,
}

var<uniform> settings: Settings;
var sums: texture_2d<f32>;
var behind: texture_2d<f32>;

fn decoded(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

fn encoded(c: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3(0.0031308));
}

// Splats over what is behind them, in the space that they were trained in: over black where nothing is.
@fragment
fn color(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(at.xy);
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
    return vec4(shown, coverage);
}

@fragment
fn normal(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let sum = textureLoad(sums, vec2<u32>(at.xy), 0);
    let length = length(sum.xyz);
    return vec4(select(vec3(0.0), sum.xyz / length, length > 0.0), select(0.0, 1.0, length > 0.0));
}
