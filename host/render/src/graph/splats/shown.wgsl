// A splat at a pixel, where the pass has a function of its own for each.

fn finite(v: vec4<f32>) -> vec4<f32> {
    return vec4(
        select(0.0, v.x, is_finite_number(v.x)),
        select(0.0, v.y, is_finite_number(v.y)),
        select(0.0, v.z, is_finite_number(v.z)),
        select(0.0, v.w, is_finite_number(v.w)),
    );
}

// What the function makes of it: an opacity from 0 to 1, and finite vectors.
fn shown_at(at_px: vec2<f32>, hit: Hit, number: u32) -> surfelshop_splat::Fragment {
    var p: surfelshop_splat::Pixel;
    p.index = number;
    p.pixel = at_px;
    p.place = hit.place;
    p.exponent = hit.exponent;
    p.depth = params.unit * hit.distance;
    p.opacity = hit.opacity;
    for (var k = 0u; k < N_PAYLOADS; k++) {
        p.payload[k] = payloads[number * N_PAYLOADS + k];
    }
    var f = FUNCTION_PER_PIXEL(p);
    let is_number = (bitcast<u32>(f.opacity) & 0x7fffffffu) <= 0x7f800000u;
    f.opacity = select(0.0, clamp(f.opacity, 0.0, 1.0), is_number);
    for (var k = 0u; k < N_PAYLOADS; k++) {
        f.payload[k] = finite(f.payload[k]);
    }
    return f;
}
