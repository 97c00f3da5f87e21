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
    let point = view::world_point_at(vec2<f32>(pixel) + 0.5, depth);
    return Surface(
        depth,
        point.position,
        s.normal,
        point.to_eye,
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

@group(0) @binding(9) var surface_object: texture_2d<u32>;

// Which of the scene's clouds the nearest surfel at a pixel belongs to, from 0 in the order of
// `CloudFacts::objects`; 0 where nothing is. For pixels, not for surfels that are shaded one by one.
fn object_at(pixel: vec2<u32>) -> u32 {
    // One pixel stands for all where there is one cloud.
    let last = textureDimensions(surface_object) - 1u;
    return textureLoad(surface_object, min(pixel, last), 0).x;
}

// How far a pixel reaches over the surface: the two axes of its outline in the tangent plane,
// world-oriented, scene units, the first across the direction of view and the second along it. Their
// lengths are a pixel's width there, and that over the cosine to the eye, at most 16 times as much:
// what is seen at a flatter angle than that is the edge of a disc.
struct Footprint {
    across: vec3<f32>,
    along: vec3<f32>,
}

fn footprint(s: Surface) -> Footprint {
    let width = 2.0 * view::view.half_extent.y / view::view.size_px.y
        * select(s.depth, 1.0, view::view.orthographic == 1u);
    let cosine = clamp(dot(s.normal, s.to_eye), 0.0625, 1.0);
    let side = cross(s.normal, s.to_eye);
    let squared = dot(side, side);
    // Seen straight on every direction across is as good.
    let axis = select(vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0), abs(s.normal.y) > 0.7);
    let other = cross(s.normal, axis);
    let across = select(normalize(other), side * inverseSqrt(max(squared, 1e-20)), squared > 1e-10);
    return Footprint(across * width, cross(across, s.normal) * (width / cosine));
}
