// Pictures for whoever looks into the renderer: the lights, their maps, and light alone.
#import surfelshop::view
#import gi::maps
#import gi::vpl::Vpl

struct Settings {
    // Lights of a bounce.
    n_vpls: u32,
    // Maps in a row of the picture.
    columns: u32,
}

var<uniform> settings: Settings;
var<uniform> sizes: maps::Sizes;
var<storage, read> vpls: array<Vpl>;
var<storage, read> depths: array<u32>;

var picture: texture_storage_2d<rgba32float, write>;

// A column of pixels for each light of the first bounce: position and whether it lives, normal and the
// surfel's number, flux, albedo, and where its light comes from.
@compute @workgroup_size(8, 8)
fn show_vpls(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    let size = vec2<u32>(view::view.size_px);
    let i = pixel.x + (pixel.y / 5u) * size.x;
    if any(pixel >= size) {
        return;
    }
    var shown = vec4(0.0);
    if i < settings.n_vpls {
        let v = vpls[i];
        switch pixel.y % 5u {
            case 0u: { shown = vec4(v.position / sizes.per_extent, f32(v.valid)); }
            case 1u: { shown = vec4(v.normal, f32(v.surfel)); }
            case 2u: { shown = vec4(v.flux, 1.0); }
            case 3u: { shown = vec4(v.albedo, 1.0); }
            default: { shown = vec4(v.incoming, v.cosine); }
        }
    }
    textureStore(picture, pixel, shown);
}

// Its maps side by side: one over the distance times the extent, 0 where nothing is.
@compute @workgroup_size(8, 8)
fn show_maps(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= vec2<u32>(view::view.size_px)) {
        return;
    }
    let map = pixel / sizes.side;
    let number = map.y * settings.columns + map.x;
    var shown = vec4(0.0);
    if map.x < settings.columns && number < settings.n_vpls {
        let texel = pixel % sizes.side;
        let near = bitcast<f32>(depths[(number * sizes.side + texel.y) * sizes.side + texel.x]);
        shown = vec4(vec3(near), 1.0);
    }
    textureStore(picture, pixel, shown);
}
