// Direct light, with shadows looked up in the depths of the light views.
#import surfelshop::surface::Surface
#import surfelshop::light
#import gi::light_views
#import gi::material
#import gi::material::Material

var<uniform> faces: light_views::Faces;
var<uniform> body: Material;
// Along the axes of the faces, units of the extent; 0 where nothing is seen.
var<storage, read> depths: array<f32>;

// A point as a face sees it.
struct FacePoint {
    // From -1 to 1 in the picture, y down.
    place: vec2<f32>,
    // Along the axis, units of the extent; at most 0 where it is not before the face.
    depth: f32,
}

fn project(face: light_views::Face, position: vec3<f32>) -> FacePoint {
    let offset = position - face.from_eye;
    let depth = -dot(offset, face.backward);
    var width = face.half_extent;
    if face.is_parallel == 0u {
        width *= max(depth, 1e-20);
    }
    return FacePoint(vec2(dot(offset, face.right), -dot(offset, face.up)) / width, depth);
}

// The visibility of a light from a point, filtered over three texels (percentage-closer filtering).
//
// What a texel must be behind to be in the shadow is the plane of the surface where the texel looks, so
// that no surface shadows itself however flat the light falls.
fn visibility_of(light_index: u32, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    for (var i = 0u; i < faces.count; i++) {
        let face = faces.items[i];
        let point = project(face, position);
        if face.light_index != light_index || point.depth <= 0.0 || max(abs(point.place.x), abs(point.place.y)) > face.own {
            continue;
        }
        return visibility_in(face, i, point, normal);
    }
    return 1.0;
}

fn visibility_in(face: light_views::Face, number: u32, point: FacePoint, normal: vec3<f32>) -> f32 {
    let side = f32(faces.side);
    let at = (point.place * 0.5 + 0.5) * side - 0.5;
    let low = floor(at) - 1.0;
    let part = at - floor(at);
    // The plane in the axes of the picture: across, down and into it.
    let n = vec3(dot(normal, face.right), -dot(normal, face.up), -dot(normal, face.backward));
    let texel_width = 2.0 * face.half_extent / side * select(point.depth, 1.0, face.is_parallel == 1u);
    let most = 12.0 * texel_width;
    // Discs that lie steeply in the picture are widened by a pixel, out of their plane in part.
    let straight = vec3(point.place * face.half_extent * select(1.0, 0.0, face.is_parallel == 1u), 1.0);
    let cosine = -dot(n, straight) * inverseSqrt(dot(straight, straight));
    let slope = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 0.05);
    let bias = texel_width * (1.0 + 1.5 * slope);
    var open = 0.0;
    for (var y = 0; y < 4; y++) {
        for (var x = 0; x < 4; x++) {
            let texel = clamp(low + vec2(f32(x), f32(y)), vec2(0.0), vec2(side - 1.0));
            // Where the texel's ray meets the plane, as far as that is known: at a cosine that is lit.
            let moved = (texel - at) * (2.0 * face.half_extent / side);
            let ray = vec3(point.place * face.half_extent + moved, 1.0);
            let falls = select(n.z, dot(n, ray), face.is_parallel == 0u);
            let steps = dot(n.xy, moved) * select(1.0, point.depth, face.is_parallel == 0u);
            let plane = point.depth - clamp(steps / min(falls, -0.02), -most, most);
            let place = (number * faces.side + u32(texel.y)) * faces.side + u32(texel.x);
            let depth = depths[place];
            // Bilinear weights of 3 x 3 texels around: 4 x 4 with the outermost in part.
            let weight_x = select(select(1.0, 1.0 - part.x, x == 0), part.x, x == 3);
            let weight_y = select(select(1.0, 1.0 - part.y, y == 0), part.y, y == 3);
            let is_open = depth <= 0.0 || depth >= plane - bias;
            open += select(0.0, weight_x * weight_y, is_open);
        }
    }
    return open / 9.0;
}

fn shade(s: Surface) -> vec4<f32> {
    var radiance = vec3(0.0);
    for (var i = 0u; i < light::lights.count; i++) {
        let source = light::arriving(i, s.position);
        let cosine = dot(s.normal, source.towards);
        if cosine <= 0.0 || all(source.radiance == vec3(0.0)) {
            continue;
        }
        var reflected = s.albedo * (body.diffuse * cosine);
        if material::shines() {
            reflected += vec3(material::highlight(body, s.normal, source.towards, s.to_eye, 0.0));
        }
        radiance += source.radiance * reflected * visibility_of(i, s.position * faces.per_extent, s.normal);
    }
    return vec4(radiance, 1.0);
}
