#import surfelshop::surface::Surface
#import surfelshop::noise::{Place, gradient}
override N: u32 = 4u;
override B: bool = true;
var<workgroup> w: array<atomic<u32>, 16>;
struct S { a: array<vec4<f32>, 4>, b: mat3x3<f32> }
var<storage, read_write> s: S;
fn shade(f: Surface) -> vec4<f32> {
    var x = 0.0;
    for (var i = 0u; i < N; i++) { loop { x += sin(x); if x > 1.0 { break; } continuing { x *= 2.0; break if x > 3.0; } } }
    while B { switch i32(x) { case 1, 2: { return vec4(x); } default: { x += 1.0; } } }
    return select(vec4(f.albedo, 1.0), s.a[0], x < 0.0);
}
@compute @workgroup_size(4, N)
fn main(@builtin(global_invocation_id) id: vec3<u32>) { atomicAdd(&w[id.x % 16u], 1u); workgroupBarrier(); s.b[0] = vec3<f32>(id); }
