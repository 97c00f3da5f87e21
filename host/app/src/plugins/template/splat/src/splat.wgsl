#import surfelshop::light
#import surfelshop::splat
#import surfelshop::view
#import cloud
#import params::settings

// The largest albedo that the host's own surface holds.
const BRIGHTEST: f32 = 65504.0;

// What surfel number `i` looks like: a flat Gaussian, whose standard deviation is half the radius.
fn draw(i: u32) -> splat::Splat {
    let position = cloud::position(i);
    let normal = unit(cloud::normal(i));
    let across = select(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), abs(normal.x) > 0.6);
    let u = normalize(cross(normal, across));
    let deviation = 0.5 * settings.size * cloud::radius(i);
    let axes = mat3x3(deviation * u, deviation * cross(normal, u), vec3(0.0));
    var s = splat::gaussian(position, axes, 0.3, false);
    s.opacity *= settings.opacity;
    // Summed up by how much of each surfel is seen: light from either side, and 1 for coverage.
    let from_eye = position - view::view.world_from_view[3].xyz;
    let arriving = settings.ambient
        + light::diffuse_irradiance_at(from_eye, normal)
        + light::diffuse_irradiance_at(from_eye, -normal);
    let albedo = clamp(cloud::color(i), vec3(0.0), vec3(BRIGHTEST));
    s.payload[0] = vec4(albedo * arriving, 1.0);
    return s;
}

// Normals may have any length; one without makes a splat that is not drawn.
fn unit(v: vec3<f32>) -> vec3<f32> {
    return normalize(v / max(abs(v.x), max(abs(v.y), abs(v.z))));
}
