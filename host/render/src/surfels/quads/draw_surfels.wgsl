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

// The packed surface of the picture; see rim_fragment.
var packed: texture_2d<u32>;

// What hides the centre of a disc is its own rim up to so many of its radii before it.
const RIM_RADII = 4.0;

// Pixels from one that is seen from behind to the centre of its disc; of larger discs the others are
// left alone.
const MOST_STEPS = 128.0;

// The distance of a pixel that is seen from the front; 0 where it is not, or lies outside.
fn front_distance(pixel: vec2<i32>) -> f32 {
    if any(pixel < vec2(0)) || any(pixel >= vec2<i32>(textureDimensions(nearest))) {
        return 0.0;
    }
    let winner = textureLoad(nearest, pixel, 0).xy;
    return select(bitcast<f32>(winner.y), 0.0, winner.x >> BACK_BIT == 1u);
}

// The longer half axis of a surfel before the low-pass; not above 0 where it is a round splat.
fn own_radius(i: u32) -> f32 {
#ifdef TANGENTS
    let u = vec3(tangent_u[3u * i], tangent_u[3u * i + 1u], tangent_u[3u * i + 2u]);
    let v = vec3(tangent_v[3u * i], tangent_v[3u * i + 1u], tangent_v[3u * i + 2u]);
    let axis_u = (chunk.view_from_chunk * vec4(u, 0.0)).xyz;
    let axis_v = (chunk.view_from_chunk * vec4(v, 0.0)).xyz;
    return max(length(axis_u), length(axis_v)) * chunk.tangent_scale;
#else
#ifdef EQUAL_RADII
    return chunk.radius * chunk.radius_scale;
#else
    return radius[i] * chunk.radius_scale;
#endif
#endif
}

// What is seen of discs from behind only because they stick out past the edge of what hides their
// centres looks as the front does beside it, and keeps its distance, for the pixels of this chunk.
// Why stands in `rims.rs` of `host/raster`, the twin.
//
// Drivers may go on with pixels that are discarded, so that nothing is before the loop, and those that have nothing to
// look for take no step.
@fragment
fn rim_fragment(@builtin(position) p: vec4<f32>) -> @location(0) vec4<u32> {
    let pixel = vec2<i32>(p.xy);
    let winner = textureLoad(nearest, pixel, 0).xy;
    let counted = nearest_in_chunk(winner);
    let is_back = counted < chunk.count && winner.x >> BACK_BIT == 1u;
    let i = select(0u, counted, is_back);
    let own = own_radius(i);
    let local = vec3(position[3u * i], position[3u * i + 1u], position[3u * i + 2u]);
    let center = (chunk.view_from_chunk * vec4(local, 1.0)).xyz;
    let distance = -center.z;
    let clip = view::view.clip_from_view * vec4(center, 1.0);
    let ndc = clip.xy / clip.w;
    let size = view::view.size_px;
    let at = floor(vec2(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size);
    let to_center = at - vec2<f32>(pixel);
    let apart = max(abs(to_center.x), abs(to_center.y));
    let is_near = own > 0.0 && distance > view::view.near && apart >= 1.0 && apart <= MOST_STEPS;
    let px = 0.5 * size.y / view::view.half_extent.y / select(distance, 1.0, view::view.orthographic == 1u);
    let slack = RIM_RADII * (own + chunk.low_pass / px);
    var steps = 0.0;
    if is_back && is_near {
        let hides = front_distance(vec2<i32>(at));
        if hides > 0.0 && hides <= distance && distance - hides <= slack {
            steps = apart;
        }
    }
    for (var k = 1.0; k <= steps; k += 1.0) {
        let beside = pixel + vec2<i32>(floor(to_center * k / steps + 0.5));
        let depth = front_distance(beside);
        if depth > 0.0 && abs(depth - distance) <= slack {
            return vec4(textureLoad(packed, pixel, 0).x, textureLoad(packed, beside, 0).yzw);
        }
    }
    discard;
    return vec4(0u);
}
