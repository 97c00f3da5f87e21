// How the surface buffer packs a pixel into 16 bytes, and directions into 4.
#define_import_path surfelshop::packing

// Unit vector to octahedral coordinates in [-1, 1].
//
// Source: Meyer et al. 2010, "On Floating-Point Normal Vectors".
fn octahedral_encode(n: vec3<f32>) -> vec2<f32> {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    if n.z >= 0.0 {
        return p;
    }
    let s = vec2(select(-1.0, 1.0, p.x >= 0.0), select(-1.0, 1.0, p.y >= 0.0));
    return (1.0 - abs(p.yx)) * s;
}

// Octahedral coordinates to a unit vector.
fn octahedral_decode(p: vec2<f32>) -> vec3<f32> {
    var n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    let t = max(-n.z, 0.0);
    n.x += select(t, -t, n.x >= 0.0);
    n.y += select(t, -t, n.y >= 0.0);
    return normalize(n);
}

// A direction in 32 bits; its error is below 2^-14 rad, a fiftieth of a degree's tenth.
fn pack_direction(n: vec3<f32>) -> u32 {
    return pack2x16snorm(octahedral_encode(n));
}

fn unpack_direction(bits: u32) -> vec3<f32> {
    return octahedral_decode(unpack2x16snorm(bits));
}

// Largest albedo the buffer holds; a finite half-precision number.
const MAX_ALBEDO = 65504.0;

// Depth (f32), normal (octahedral, 2 x 16 bits), albedo (3 x f16), accessibility (16 bits).
fn pack_surface(depth: f32, normal: vec3<f32>, albedo: vec3<f32>, ao: f32) -> vec4<u32> {
    let a = clamp(albedo, vec3(0.0), vec3(MAX_ALBEDO));
    let blue = pack2x16float(vec2(a.b, 0.0)) & 0xffffu;
    let access = u32(clamp(ao, 0.0, 1.0) * 65535.0 + 0.5) << 16u;
    return vec4(bitcast<u32>(depth), pack_direction(normal), pack2x16float(a.rg), blue | access);
}

struct Unpacked {
    depth: f32,
    normal: vec3<f32>,
    albedo: vec3<f32>,
    ao: f32,
}

fn unpack_surface(bits: vec4<u32>) -> Unpacked {
    let blue = unpack2x16float(bits.w & 0xffffu).x;
    return Unpacked(
        bitcast<f32>(bits.x),
        unpack_direction(bits.y),
        vec3(unpack2x16float(bits.z), blue),
        f32(bits.w >> 16u) / 65535.0,
    );
}
