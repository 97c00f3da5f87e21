// A triangle that covers the picture.
@vertex
fn cover_screen(@builtin(vertex_index) v: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(v & 1u) * 4.0 - 1.0, f32(v >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
