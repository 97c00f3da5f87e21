// Which pixels a splat may cover.

// Low and high of what a planar splat may cover along one axis, pixels from its centre.
fn along(row: vec2<f32>, w: vec3<f32>, cutoff: f32) -> vec2<f32> {
    let d = w.z * w.z - cutoff * dot(w.xy, w.xy);
    if !(d > 0.0 && w.z > 0.0) {
        return vec2(-1e9, 1e9);
    }
    let least = sqrt(cutoff / LOW_PASS);
    let middle = -cutoff * dot(row, w.xy);
    let half = sqrt(middle * middle + d * cutoff * dot(row, row));
    return vec2(min((middle - half) / d * 1.0001, -least), max((middle + half) / d * 1.0001, least));
}

// The pixels that a splat may cover, left and top, right and bottom, the latter beyond; zeros where there are none.
fn covered(f: Footprint) -> vec4<u32> {
    let none = vec4(0u);
    if !(f.opacity >= LEAST_OPACITY) || !are_finite(f.shape) || !are_finite(vec4(f.distance, 0.0))
        || !are_finite(vec4(f.center.xy, 0.0, 0.0)) || any(abs(f.distance) > vec3(MOST_DISTANCE)) {
        return none;
    }
    let cutoff = cutoff_of(f.opacity);
    var x: vec2<f32>;
    var y: vec2<f32>;
    if params.planar == 1u {
        let w = select(f.distance, vec3(0.0, 0.0, 1.0), params.orthographic == 1u);
        x = f.center.x + along(f.shape.xy, w, cutoff);
        y = f.center.y + along(f.shape.zw, w, cutoff);
    } else {
        let determinant = f.shape.x * f.shape.z - f.shape.y * f.shape.y;
        if !(f.shape.x > 0.0 && f.shape.z > 0.0 && determinant > 0.0) || f.distance.z < params.near {
            return none;
        }
        let reach = 1.0001 * sqrt(cutoff * f.shape.zx / determinant);
        x = f.center.x + vec2(-reach.x, reach.x);
        y = f.center.y + vec2(-reach.y, reach.y);
    }
    let size = vec2<f32>(params.size_px);
    let first = max(ceil(vec2(x.x, y.x) - 0.5), vec2(0.0));
    let end = min(floor(vec2(x.y, y.y) - 0.5) + 1.0, size);
    if any(first >= end) {
        return none;
    }
    return vec4(vec2<u32>(first), vec2<u32>(end));
}
