// What lights that do not get stronger near a surface leave out, gathered from the surfaces around that
// the picture shows: 1 / d^2 less what was counted, times what these surfaces radiate to the eye.
//
// Source: Kollig & Keller 2004, "Illumination in the Presence of Weak Singularities"; Novak et al. 2011,
// "Screen-Space Bias Compensation for Interactive High-Quality Global Illumination with Virtual Point
// Lights".
#import surfelshop::view
#import surfelshop::surface::Surface
#import surfelshop::surface
#import gi::random
#import gi::material::Material
#import gi::vpl

struct Settings {
    // Places that are looked at for each pixel.
    n_samples: u32,
    frame: u32,
    radius_squared: f32,
    bounded: u32,
    per_extent: f32,
    // How far is looked, in radii.
    reach: f32,
    // Share of the light that was reflected before that is reflected once more: the last bounce is not.
    again: f32,
}

var<uniform> settings: Settings;
var<uniform> body: Material;
var direct_light: texture_2d<f32>;
var diffuse_light: texture_2d<f32>;
var missing: texture_storage_2d<rgba32float, write>;

// Width of a pixel at a surface, units of the extent.
fn pixel_width(s: Surface) -> f32 {
    let width = 2.0 * view::view.half_extent.y / view::view.size_px.y;
    return width * select(s.depth, 1.0, view::view.orthographic == 1u) * settings.per_extent;
}

@compute @workgroup_size(8, 8)
fn compensate(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec2<u32>(view::view.size_px);
    if any(id.xy >= size) {
        return;
    }
    let s = surface::surface_at(id.xy);
    var sum = vec3(0.0);
    var weights = 0.0;
    if s.covered {
        let seed = random::mixed(id.x + 16384u * id.y + 0x9e3779b9u * settings.frame);
        let turn = random::fraction(seed);
        let shift = random::fraction(random::mixed(seed));
        let width = pixel_width(s);
        // On the screen, pixels; what is nearer than one is the pixel's own.
        let most = min(settings.reach * sqrt(settings.radius_squared) / width, 0.5 * f32(max(size.x, size.y)));
        let octaves = log2(max(most, 2.0));
        for (var i = 0u; i < settings.n_samples; i++) {
            // Evenly by the logarithm of the distance, around in golden steps.
            let r = exp2(octaves * fract((f32(i) + 0.5) / f32(settings.n_samples) + shift));
            let angle = 6.2831853 * fract(turn + 0.61803399 * f32(i));
            let place = vec2<f32>(id.xy) + 0.5 + r * vec2(cos(angle), sin(angle));
            if any(place < vec2(0.0)) || any(place >= vec2<f32>(size)) {
                continue;
            }
            let other = surface::surface_at(vec2<u32>(place));
            if !other.covered {
                continue;
            }
            let offset = (other.position - s.position) * settings.per_extent;
            let square = dot(offset, offset);
            let direction = offset * inverseSqrt(max(square, 1e-20));
            let cosines = max(dot(s.normal, direction), 0.0) * max(-dot(other.normal, direction), 0.0);
            // The disc's own width keeps pixels of one surface from each other.
            if cosines <= 1e-4 || square < 1e-14 {
                continue;
            }
            let left_out = 1.0 / square - vpl::bounded_falloff(square, settings.radius_squared, settings.bounded);
            // The surface that a pixel shows, and pixels for each place: 1 / (2 pi r^2 ln most).
            let other_width = pixel_width(other);
            let facing = max(dot(other.normal, other.to_eye), 0.05);
            let axis = select(1.0, abs(other.depth) * inverseSqrt(max(dot(other.position, other.position), 1e-30)), view::view.orthographic == 0u);
            let area = other_width * other_width * axis / facing;
            let per_place = 6.2831853 * r * r * octaves * 0.69314718 / f32(settings.n_samples);
            let weight = cosines * left_out * area * per_place * 0.31830989;
            let pixel = vec2<i32>(place);
            let radiance = textureLoad(direct_light, pixel, 0).rgb
                + other.albedo * (body.diffuse * settings.again) * textureLoad(diffuse_light, pixel, 0).rgb;
            sum += radiance * weight;
            weights += weight;
        }
        // No surfaces around are more than all that is around.
        sum /= max(weights, 1.0);
    }
    textureStore(missing, id.xy, vec4(sum, 1.0));
}
