use super::*;
use crate::samples::Random;

/// A cube of edge 2 about the origin, counterclockwise seen from outside.
fn cube() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corners = (0..8).map(|i| Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    (corners, faces)
}

/// A sphere of radius 1 in rows of latitude, with an odd number of slices so that triangles have
/// many shapes, acute and obtuse.
fn sphere(rows: u32, slices: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut positions = vec![Vec3::Z];
    for row in 1..rows {
        for slice in 0..slices {
            let (latitude, longitude) = (
                std::f64::consts::PI * f64::from(row) / f64::from(rows),
                std::f64::consts::TAU * (f64::from(slice) + 0.3 * f64::from(row))
                    / f64::from(slices),
            );
            let (sine, cosine) = latitude.sin_cos();
            let at = DVec3::new(sine * longitude.cos(), sine * longitude.sin(), cosine);
            positions.push(at.as_vec3());
        }
    }
    positions.push(-Vec3::Z);
    let at = |row: u32, slice: u32| match row {
        0 => 0,
        row if row == rows => (rows - 1) * slices + 1,
        row => 1 + (row - 1) * slices + slice % slices,
    };
    let mut faces = Vec::new();
    for row in 0..rows {
        for slice in 0..slices {
            let [a, b] = [at(row, slice), at(row, slice + 1)];
            let [c, d] = [at(row + 1, slice), at(row + 1, slice + 1)];
            faces.extend((row > 0).then_some([a, c, b]));
            faces.extend((row + 1 < rows).then_some([b, c, d]));
        }
    }
    (positions, faces)
}

/// Points of the mesh that no disc covers, seen along the face's normal.
fn holes(positions: &[Vec3], normals: &[Vec3], radii: &[f32], faces: &[[u32; 3]]) -> usize {
    let mut random = Random::new(5);
    let mut open = 0;
    for face in faces {
        let [a, b, c] = face.map(|corner| positions[corner as usize].as_dvec3());
        let across = (b - a).cross(c - a).normalize_or_zero();
        for _ in 0..50 {
            let (mut u, mut v) = (random.unit(), random.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let point = a + u * (b - a) + v * (c - a);
            open += usize::from(!face.iter().any(|&corner| {
                let corner = corner as usize;
                let (centre, normal) = (positions[corner].as_dvec3(), normals[corner].as_dvec3());
                // Where the line through the point along the face's normal meets the disc's plane.
                let along = (centre - point).dot(normal) / across.dot(normal);
                (point + along * across).distance(centre) <= f64::from(radii[corner])
            }));
        }
    }
    open
}

#[test]
fn areas_are_those_of_the_body_and_vertices_share_them() {
    let (positions, faces) = cube();
    assert!(areas(&positions, &faces).iter().all(|&area| area == 2.0));
    assert!((vertex_areas(&positions, &faces).iter().sum::<f64>() - 24.0).abs() < 1e-12);
    let (positions, faces) = sphere(64, 127);
    let total: f64 = areas(&positions, &faces).iter().sum();
    // Chords of pi / 64 lie below the sphere by 1 - cos(pi / 128), of which areas lose about twice.
    assert!((total / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{total}");
    let shared: f64 = vertex_areas(&positions, &faces).iter().sum();
    assert!((shared / total - 1.0).abs() < 1e-12);
}

#[test]
fn normals_of_a_sphere_are_its_directions() {
    let (positions, faces) = sphere(40, 81);
    for (position, normal) in positions.iter().zip(vertex_normals(&positions, &faces)) {
        assert!(position.dot(normal) > 0.999);
    }
    for (face, normal) in faces.iter().zip(face_normals(&positions, &faces)) {
        assert!(positions[face[0] as usize].dot(normal) > 0.99);
    }
}

/// Invariant: discs at the vertices of a mesh leave no hole
#[test]
fn discs_of_the_vertices_leave_no_hole() {
    for (positions, faces) in [cube(), sphere(12, 31), sphere(40, 20), sphere(9, 60)] {
        let normals = vertex_normals(&positions, &faces);
        let radii = vertex_radii(&positions, &normals, &faces);
        assert_eq!(holes(&positions, &normals, &radii, &faces), 0);
        let shrunk: Vec<f32> = radii.iter().map(|radius| radius * 0.6).collect();
        assert!(holes(&positions, &normals, &shrunk, &faces) > 0);
    }
}

#[test]
fn reaches_are_those_of_a_full_search() {
    let mut random = Random::new(9);
    for _ in 0..200 {
        let at = [(); 3].map(|()| random.in_ball());
        let found = reaches(at);
        let mut farthest = [0.0f64; 3];
        const SIDE: u32 = 120;
        for i in 0..=SIDE {
            for j in 0..=SIDE - i {
                let (u, v) = (f64::from(i) / f64::from(SIDE), f64::from(j) / f64::from(SIDE));
                let point = at[0] + u * (at[1] - at[0]) + v * (at[2] - at[0]);
                let distances = at.map(|corner| corner.distance(point));
                let nearest =
                    (0..3).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap();
                farthest[nearest] = farthest[nearest].max(distances[nearest]);
            }
        }
        // The grid's points are at most a step of 2 / 120 apart.
        for (found, farthest) in found.into_iter().zip(farthest) {
            assert!(found > farthest - 1e-9 && found < farthest + 0.04, "{found} {farthest}");
        }
    }
}

#[test]
fn faces_without_extent_or_with_bad_corners_count_for_nothing() {
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0, Vec3::NAN];
    let bad = [[0, 1, 3], [0, 0, 1], [0, 1, 4], [0, 1, 9]];
    assert_eq!(areas(&positions, &bad), [0.0; 4]);
    assert_eq!(vertex_areas(&positions, &bad), [0.0; 5]);
    assert_eq!(vertex_normals(&positions, &bad), [Vec3::ZERO; 5]);
    assert_eq!(face_normals(&positions, &bad), [Vec3::ZERO; 4]);
    let radii = vertex_radii(&positions, &[], &bad);
    assert!(radii.iter().all(|radius| radius.is_finite()) && radii[2] == 0.0 && radii[4] == 0.0);
    // Half of the first unit is nearest to its corner.
    assert!((radii[0] - 0.575).abs() < 1e-6, "{radii:?}");
    let both = [[0, 1, 2], [0, 2, 1]];
    assert_eq!(vertex_normals(&positions, &both), [Vec3::ZERO; 5]);
    assert_eq!(areas(&[], &[]), Vec::<f64>::new());
    assert!(!is_inside_out(&[], &[]));
}

#[test]
fn meshes_of_any_size_have_normals() {
    let (unit, faces) = sphere(10, 21);
    let expected = vertex_normals(&unit, &faces);
    for scale in [1e-37f32, 1e-20, 1e20, 1e37] {
        let positions: Vec<Vec3> = unit.iter().map(|&position| position * scale).collect();
        for (normal, expected) in vertex_normals(&positions, &faces).iter().zip(&expected) {
            assert!(normal.dot(*expected) > 0.9999, "{scale} {normal} {expected}");
        }
        assert!(vertex_radii(&positions, &[], &faces).iter().all(|&r| r > 0.0 && r.is_finite()));
    }
}

#[test]
fn closed_meshes_that_are_inside_out_are_told() {
    let turned = |faces: &[[u32; 3]]| -> Vec<[u32; 3]> {
        faces.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
    };
    for (mut positions, faces) in [cube(), sphere(8, 13)] {
        // Far from the origin the volume must not drown in that of the pyramids to it.
        positions.iter_mut().for_each(|position| *position += Vec3::splat(100.0));
        assert!(!is_inside_out(&positions, &faces));
        assert!(is_inside_out(&positions, &turned(&faces)));
        assert!(!is_inside_out(&positions, &turned(&faces[1..])), "it is open");
    }
}
