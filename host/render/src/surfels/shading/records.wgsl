// What shading functions are told of each surfel of a chunk that is drawn, one invocation each.

struct Record {
    // As the surface buffer packs a pixel; depth 0 where the surfel is not drawn.
    surface: vec4<u32>,
    // From the eye, world-oriented, units of drawing.
    position: vec3<f32>,
    // Direction to the eye, packed.
    to_eye: u32,
}

var<storage, read_write> records: array<Record>;

@compute @workgroup_size(64)
fn record(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let drawn = id.x + id.y * groups.x * 64u;
    let i = surfel_drawn_by(drawn);
    if i < chunk.count {
        let disc = load_disc(i);
        let center = (chunk.view_from_chunk * vec4(position[3u * i], position[3u * i + 1u], position[3u * i + 2u], 1.0)).xyz;
        // Surfels that reach before the eye have no direction to it of their own.
        let seen = disc.visible && -center.z > 0.0;
        let depth = select(0.0, -center.z, seen);
        let to_eye = view::world_from_view_direction(view::to_eye_in_view(center));
        records[drawn] = Record(
            packing::pack_surface(depth, disc.normal, seen_albedo(i, disc.back), load_ao(i)),
            view::world_from_view_direction(center),
            packing::pack_direction(to_eye),
        );
    }
}
