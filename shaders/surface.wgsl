// The host's surface buffer: what the scene's surfels look like as a surface, pixel by pixel.
#define_import_path surfelshop::surface

#import surfelshop::view
#import surfelshop::packing

// One pixel of the surface.
struct Surface {
    // Distance along the viewing axis, scene units; 0 where nothing is.
    depth: f32,
    // From the eye, world-oriented, scene units.
    position: vec3<f32>,
    // Unit, world-oriented, turned to the eye where the scene draws both sides.
    normal: vec3<f32>,
    // Unit vector to the eye, world-oriented.
    to_eye: vec3<f32>,
    // Linear Rec. 709.
    albedo: vec3<f32>,
    // Ambient accessibility, 1 where unknown.
    ao: f32,
    // Pixel of the picture.
    pixel: vec2<u32>,
    // Whether a surfel covers the pixel.
    covered: bool,
    // Half of how far normals turn from this pixel to its neighbours, squared: what the pixel shows
    // is a mixture of such normals. Given to shading functions whose shader names it; else 0.
    normal_variance: f32,
}

@group(0) @binding(2) var surface_packed: texture_2d<u32>;

// The surface at a pixel of the picture.
fn surface_at(pixel: vec2<u32>) -> Surface {
    let bits = textureLoad(surface_packed, pixel, 0);
    let s = packing::unpack_surface(bits);
    let depth = s.depth * view::view.unit;
    let center_px = vec2<f32>(pixel) + 0.5;
    // The direction is taken at distance 1, where no scene's size can overflow its square.
    let to_eye = view::to_eye_in_view(view::position_in_view(center_px, 1.0));
    return Surface(
        depth,
        view::world_from_view_direction(view::position_in_view(center_px, depth)),
        s.normal,
        view::world_from_view_direction(to_eye),
        s.albedo,
        s.ao,
        pixel,
        depth > 0.0,
        0.0,
    );
}

// The normal variance of a pixel whose surface is known; a neighbour that is not covered counts as
// none.
//
// Source: Tokuyoshi & Kaplanyan 2019, "Improved Geometric Specular Antialiasing": the variance of a
// pixel's filter, 1/4, times squared derivatives, here differences.
fn normal_variance_at(s: Surface) -> f32 {
    let right = textureLoad(surface_packed, s.pixel + vec2(1u, 0u), 0);
    let below = textureLoad(surface_packed, s.pixel + vec2(0u, 1u), 0);
    let x = packing::unpack_direction(right.y) - s.normal;
    let y = packing::unpack_direction(below.y) - s.normal;
    return 0.25 * (select(0.0, dot(x, x), right.x != 0u) + select(0.0, dot(y, y), below.x != 0u));
}

@group(0) @binding(3) var surface_material: texture_2d<u32>;

// Index into the scene's material table of the nearest surfel at a pixel; 0 where the cloud has
// no materials. Materials do not blend, so this is the nearest surfel's in every mode.
fn material_at(pixel: vec2<u32>) -> u32 {
    return textureLoad(surface_material, pixel, 0).x;
}
