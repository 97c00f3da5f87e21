// The footprint and the colour of a Gaussian in space.
#import surfelshop::splat
#import gaussian
#import radiance
#import drawing::settings

fn footprint(i: u32) -> splat::Splat {
    let turned = splat::rotation(gaussian::splat_rotation(i));
    let scale = settings.size * gaussian::splat_scale(i);
    let axes = mat3x3(turned[0] * scale.x, turned[1] * scale.y, turned[2] * scale.z);
    let position = gaussian::position(i);
    var s = splat::gaussian(position, axes, settings.low_pass, settings.keeps_sum == 1u);
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

// The axis along which it is flattest, turned to the eye.
fn facing(i: u32) -> splat::Splat {
    var s = footprint(i);
    let turned = splat::rotation(gaussian::splat_rotation(i));
    let scale = gaussian::splat_scale(i);
    var normal = turned[2];
    if scale.x < min(scale.y, scale.z) {
        normal = turned[0];
    } else if scale.y < scale.z {
        normal = turned[1];
    }
    let away = dot(normal, splat::direction_to(gaussian::position(i))) > 0.0;
    s.payload[0] = vec4(select(normal, -normal, away), 1.0);
    return s;
}
