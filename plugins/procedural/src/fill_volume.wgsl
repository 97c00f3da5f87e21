// Fills one mip level of the noise volume: noise at the centres of texels, and for the coarser
// levels its mean over them.
#import surfelshop::noise

struct Level {
    // Texels along this level.
    side: u32,
    // Samples along a texel.
    n_samples: u32,
    key: vec3<u32>,
}

var<uniform> level: Level;
var filled: texture_storage_3d<rgba16float, write>;

// Twin: `PERIOD` of volume.rs.
const PERIOD = 16u;

@compute @workgroup_size(4, 4, 4)
fn fill(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id >= vec3(level.side)) {
        return;
    }
    let texel = f32(PERIOD) / f32(level.side);
    let step = texel / f32(level.n_samples);
    let first = vec3<f32>(id) * texel + 0.5 * step;
    let n = level.n_samples;
    var sum = vec3(0.0);
    for (var i = 0u; i < n * n * n; i++) {
        let at = first + step * vec3<f32>(vec3(i % n, i / n % n, i / (n * n)));
        let l = noise::moved(noise::Lattice(vec3(0i), vec3(0.0)), at);
        sum += noise::vector(l, noise::Seed(level.key, PERIOD - 1u));
    }
    textureStore(filled, id, vec4(sum / f32(n * n * n), 1.0));
}
