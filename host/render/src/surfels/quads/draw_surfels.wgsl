// Draws the discs of one chunk of surfels as quads in their tangent planes.
//
// A quad through the disc's plane gives exact perspective by interpolation and is clipped by the
// near plane as any triangle. The first stage keeps the nearest surfel of each pixel, the second
// adds up all surfels within the depth tolerance.
//
// Source: Zwicker et al. 2001 (visibility, then blending), Botsch & Kobbelt 2003 (object-space
// quads); erratum B3 and B6 of Botsch et al. 2004 for why not a screen-space box.

var nearest: texture_2d<u32>;

#ifdef COMPUTED
// The surfels that compute has left to be drawn as quads; see list_large.wgsl.
var<storage, read> list: array<u32>;
#endif

// The surfel of an instance.
fn surfel_of(instance: u32) -> u32 {
#ifdef COMPUTED
    return surfel_drawn_by(list[instance]);
#else
    return surfel_drawn_by(instance);
#endif
}

// The quad's corner, in units of the half axes.
fn corner_of(vertex: u32) -> vec2<f32> {
    return vec2(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
}

// A position that no rasteriser draws.
const NOWHERE = vec4(0.0, 0.0, -1.0, 1.0);

fn project(disc: Disc, corner: vec2<f32>) -> vec4<f32> {
    let p = disc.center + corner.x * disc.axis_u + corner.y * disc.axis_v;
    return view::view.clip_from_view * vec4(p, 1.0);
}

struct Nearest {
    @builtin(position) @invariant clip: vec4<f32>,
    @location(0) corner: vec2<f32>,
    @location(1) @interpolate(flat) surfel: u32,
#ifdef EXPLICIT_DEPTH
    @location(2) distance: f32,
#endif
#ifdef CLIP
    @location(3) sides: vec3<f32>,
#endif
}

@vertex
fn nearest_vertex(@builtin(vertex_index) v: u32, @builtin(instance_index) drawn: u32) -> Nearest {
    let i = surfel_of(drawn);
    let disc = load_disc(i);
    let corner = corner_of(v);
    var out: Nearest;
    out.clip = select(NOWHERE, project(disc, corner), disc.visible && i < chunk.count);
    out.corner = corner;
    out.surfel = (chunk.first + i) | (disc.back << BACK_BIT);
#ifdef EXPLICIT_DEPTH
    out.distance = -(disc.center + corner.x * disc.axis_u + corner.y * disc.axis_v).z;
#endif
#ifdef CLIP
    out.sides = sides_of(load_cut(i, disc), corner);
#endif
    return out;
}

struct Winner {
    // Number and bits of the distance, see disc.wgsl.
    @location(0) number_distance: vec2<u32>,
#ifdef EXPLICIT_DEPTH
    @builtin(frag_depth) depth: f32,
#endif
}

@fragment
fn nearest_fragment(in: Nearest) -> Winner {
#ifdef EXPLICIT_DEPTH
    // OpenGL maps depth to [-1, 1] and back, which leaves nothing of the small values of a
    // reversed depth; it is written here instead.
    let distance = in.distance;
#else
    let distance = view::distance_from_depth(in.clip.z);
#endif
    // The projection's own near plane lies before `near`, so that the depth tolerance of the
    // second stage has room; what lies between is left out here.
    if dot(in.corner, in.corner) > 1.0 || distance < view::view.near {
        discard;
    }
#ifdef CLIP
    if is_cut_off(in.sides) {
        discard;
    }
#endif
    var out: Winner;
    out.number_distance = vec2(in.surfel, bitcast<u32>(distance));
#ifdef EXPLICIT_DEPTH
    let clip = view::view.clip_from_view * vec4(0.0, 0.0, -distance, 1.0);
    out.depth = clip.z / clip.w;
#endif
    return out;
}

struct Blended {
    @builtin(position) @invariant clip: vec4<f32>,
    // In units of the half axes, and the distance along the viewing axis.
    @location(0) corner_distance: vec3<f32>,
    // The normal and the share, negative where the surfel is seen from behind: few and full values,
    // as software drivers keep every one of them for each triangle that waits for its pixels.
    @location(1) @interpolate(flat) normal_share: vec4<f32>,
    @location(2) @interpolate(flat) albedo_ao: vec4<f32>,
#ifdef CLIP
    @location(3) sides: vec3<f32>,
#endif
#ifdef FIELD
    @location(4) normal: vec3<f32>,
#endif
}

@vertex
fn blended_vertex(@builtin(vertex_index) v: u32, @builtin(instance_index) drawn: u32) -> Blended {
    let i = surfel_of(drawn);
    let disc = load_disc(i);
    let corner = corner_of(v);
    var clip = project(disc, corner);
    clip.z = clip_z_brought_nearer(clip.z, disc);
    var out: Blended;
    out.clip = select(NOWHERE, clip, disc.visible && i < chunk.count);
    let p = disc.center + corner.x * disc.axis_u + corner.y * disc.axis_v;
    out.corner_distance = vec3(corner, -p.z);
    out.normal_share = vec4(disc.normal, select(disc.share, -disc.share, disc.back == 1u));
    out.albedo_ao = vec4(seen_albedo(i, disc.back), load_ao(i));
#ifdef CLIP
    out.sides = sides_of(load_cut(i, disc), corner);
#endif
#ifdef FIELD
    out.normal = normal_on(load_field(i, disc), corner);
#endif
    return out;
}

struct Sums {
    @location(0) normal_weight: vec4<f32>,
    @location(1) albedo_ao: vec4<f32>,
}

// Only surfels seen from the same side as the nearest one are added up: just behind a silhouette
// lie surfels of the other side, whose normals, turned to the eye, would point against their
// neighbours' and cancel them.
@fragment
fn blended_fragment(in: Blended) -> Sums {
    let r2 = dot(in.corner_distance.xy, in.corner_distance.xy);
    // What lies behind the near plane may have been brought before that of the projection.
    if r2 > 1.0 || in.corner_distance.z < view::view.near {
        discard;
    }
#ifdef CLIP
    if is_cut_off(in.sides) {
        discard;
    }
#endif
    if textureLoad(nearest, vec2<u32>(in.clip.xy), 0).x >> BACK_BIT != select(0u, 1u, in.normal_share.w < 0.0) {
        discard;
    }
    let w = splat_weight(r2) * abs(in.normal_share.w);
#ifdef FIELD
    let normal = normalize(in.normal);
#else
    let normal = in.normal_share.xyz;
#endif
    return Sums(vec4(normal * w, w), in.albedo_ao * w);
}

// The nearest surfel of a pixel, counted within this chunk; a number not below `chunk.count` where
// another chunk's surfel, or none, is nearest.
fn nearest_in_chunk(winner: vec2<u32>) -> u32 {
    return (winner.x & INDEX_MASK) - chunk.first;
}

// Fills the surface buffer from the nearest surfel alone, for the pixels of this chunk.
@fragment
fn lookup_fragment(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let winner = textureLoad(nearest, vec2<u32>(p.xy), 0).xy;
    let i = nearest_in_chunk(winner);
    if i >= chunk.count {
        discard;
    }
    let disc = load_disc(i);
    let distance = bitcast<f32>(winner.y);
    return packing::pack_surface(distance, disc.normal, seen_albedo(i, disc.back), load_ao(i));
}

// The material of the nearest surfel, for the pixels of this chunk.
@fragment
fn material_fragment(@builtin(position) p: vec4<f32>) -> @location(0) u32 {
    let i = nearest_in_chunk(textureLoad(nearest, vec2<u32>(p.xy), 0).xy);
    if i >= chunk.count {
        discard;
    }
#ifdef MATERIAL
    return material[i];
#else
    return 0u;
#endif
}

// The cloud of the nearest surfel, for the pixels of this chunk.
@fragment
fn object_fragment(@builtin(position) p: vec4<f32>) -> @location(0) u32 {
    let i = nearest_in_chunk(textureLoad(nearest, vec2<u32>(p.xy), 0).xy);
    if i >= chunk.count {
        discard;
    }
    return chunk.object;
}
