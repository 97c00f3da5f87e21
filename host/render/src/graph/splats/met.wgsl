// Where the ray of a pixel meets a splat, and what it hides there.

const MOST_OPACITY = 0.99;

struct Hit {
    inside: bool,
    opacity: f32,
    distance: f32,
#ifdef PER_PIXEL
    // Of a plane where the ray meets it, of a conic pixels from the centre.
    place: vec2<f32>,
    exponent: f32,
#endif
}

fn met(f: Footprint, pixel: vec2<f32>) -> Hit {
    let p = pixel - f.center.xy;
    var r2: f32;
    var distance = f.distance.z;
#ifdef PER_PIXEL
    var at = p;
#endif
    if is_planar() {
        let w = select(f.distance, vec3(0.0, 0.0, 1.0), params.orthographic == 1u);
        let k = vec3(p.x * w.xy - f.shape.xy, p.x * w.z);
        let l = vec3(p.y * w.xy - f.shape.zw, p.y * w.z);
        let across = cross(k, l);
        let place = across.xy / across.z;
        let in_plane = dot(place, place);
        let on_screen = LOW_PASS * dot(p, p);
        r2 = select(on_screen, in_plane, in_plane < on_screen);
        if in_plane <= on_screen {
            distance = dot(f.distance, vec3(place, 1.0));
        }
#ifdef PER_PIXEL
        at = select(vec2(0.0), place, in_plane <= on_screen);
#endif
    } else {
        r2 = f.shape.x * p.x * p.x + 2.0 * f.shape.y * p.x * p.y + f.shape.z * p.y * p.y;
    }
    let inside = r2 >= 0.0 && r2 <= cutoff_of(f.opacity) && distance >= params.near;
    let opacity = min(min(f.opacity, 1.0) * exp(-0.5 * r2), MOST_OPACITY);
#ifdef PER_PIXEL
    return Hit(inside, opacity, distance, at, -0.5 * r2);
#else
    return Hit(inside, opacity, distance);
#endif
}
