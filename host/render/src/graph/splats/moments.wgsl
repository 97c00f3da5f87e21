// How far the splats of a pixel lie apart.

// The distance of the first splat of a pixel; sums of weights, of weights times distances from that, and of weights times
// their squares, with another splat.
fn with_moments(m: vec4<f32>, weight: f32, distance: f32) -> vec4<f32> {
    let first = select(m.x, distance, m.y == 0.0);
    let apart = distance - first;
    let moment = weight * apart;
    return vec4(first, m.y + weight, m.z + moment, m.w + moment * apart);
}

const LARGEST = 0x1.fffffep+127f;

// The sum over pairs of splats of their weights times the square of what they are apart, squared scene units.
fn distortion_of(m: vec4<f32>) -> f32 {
    let sum = m.y * m.w - m.z * m.z;
    let of_units = select(LARGEST, max(sum, 0.0), is_finite_number(sum));
    return min(of_units * params.unit * params.unit, LARGEST);
}
