/// The surfel whose disc is nearest to a point, with the distance in its radii.
fn nearest(cloud: &Cloud, point: DVec3) -> Option<(usize, f32)> {
    let at = (point - cloud.origin()).as_vec3();
    let (normals, radii) = (cloud.normals(), cloud.radii());
    let distance = |i: usize| {
        let offset = at - cloud.positions()[i];
        let normal = normals.get(i).copied().unwrap_or_default();
        let above = offset.dot(normal);
        // Height above a disc counts more than distance along it: the point is on another surface.
        let radius = radii.get(i).copied().unwrap_or(1.0).max(f32::MIN_POSITIVE);
        (offset.length() + 4.0 * above.abs()) / radius
    };
    (0..cloud.len())
        .into_par_iter()
        .with_min_len(1 << 14)
        .map(|i| (i, distance(i)))
        .filter(|(_, distance)| distance.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

fn color(cloud: &Cloud, index: usize) -> String {
    use surfelshop_cloud::Buffer;
    let Some(column) = cloud.column(surfelshop_api::columns::COLOR) else { return String::new() };
    let n = column.components() as usize;
    let range = n * index..n * index + 3;
    match column.values() {
        Buffer::U8(values) => {
            values.get(range).map(|c| format!("   colour {} {} {}", c[0], c[1], c[2]))
        }
        Buffer::U16(values) => {
            values.get(range).map(|c| format!("   colour {} {} {}", c[0], c[1], c[2]))
        }
        Buffer::F32(values) => {
            values.get(range).map(|c| format!("   colour {:.3} {:.3} {:.3}", c[0], c[1], c[2]))
        }
        _ => None,
    }
    .unwrap_or_default()
}
