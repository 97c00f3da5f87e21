// The footprint and the colour of a Gaussian in a plane.
#import surfelshop::splat
#import gaussian
#import radiance
#import drawing::settings

fn footprint(i: u32) -> splat::Splat {
    let turned = splat::rotation(gaussian::splat_rotation(i));
    let scale = settings.size * gaussian::splat_scale(i);
    var s = splat::planar(gaussian::position(i), turned[0] * scale.x, turned[1] * scale.y);
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
    let normal = splat::rotation(gaussian::splat_rotation(i))[2];
    let away = dot(normal, splat::direction_to(gaussian::position(i))) > 0.0;
    s.payload[0] = vec4(select(normal, -normal, away), 1.0);
    return s;
}
