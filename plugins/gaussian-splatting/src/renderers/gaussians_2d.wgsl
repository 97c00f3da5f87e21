// The footprint and the colour of a Gaussian in a plane.
#import surfelshop::splat
#import gaussian
#import radiance
#import drawing::settings

// Standard deviations along the two longest axes, and the shortest one, which stands on the plane.
fn axes(i: u32) -> mat3x3<f32> {
    let turned = splat::rotation(gaussian::splat_rotation(i));
    let scale = settings.size * gaussian::splat_scale(i);
    let scaled = mat3x3(turned[0] * scale.x, turned[1] * scale.y, turned[2] * scale.z);
    if scale.x < min(scale.y, scale.z) {
        return mat3x3(scaled[1], scaled[2], turned[0]);
    }
    if scale.y < scale.z {
        return mat3x3(scaled[2], scaled[0], turned[1]);
    }
    return mat3x3(scaled[0], scaled[1], turned[2]);
}

fn footprint(i: u32) -> splat::Splat {
    let axes = axes(i);
    var s = splat::planar(gaussian::position(i), axes[0], axes[1]);
    let own = gaussian::opacity(i);
    s.opacity *= select(own, 0.0, own < settings.least_opacity);
    return s;
}

fn colored(i: u32) -> splat::Splat {
    var s = footprint(i);
    if s.opacity > 0.0 {
        let direction = splat::direction_to(gaussian::position(i));
        s.payload[0] = vec4(radiance::toward(i, direction), 1.0);
    }
    return s;
}

// The normal of the plane, turned to the eye.
fn facing(i: u32) -> splat::Splat {
    var s = footprint(i);
    let normal = axes(i)[2];
    let away = dot(normal, splat::direction_to(gaussian::position(i))) > 0.0;
    s.payload[0] = vec4(select(normal, -normal, away), 1.0);
    return s;
}
