//! `sample`, and `radii` of triangles.

use super::*;
use crate::radii;
use crate::radii::Radii;
use crate::sample::{From, Method, Radius, Sample, Settings};
use surfelshop_api::params::linear_to_srgb;

/// A cube of edge 2 about the origin with colours, heights and labels.
fn cube() -> TestCloud {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corners: Vec<Vec3> =
        (0..8).map(|i| Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TestCloud {
        origin: DVec3::new(7.0, 8.0, 9.0),
        colors: corners
            .iter()
            .flat_map(|c| if c.z > 0.0 { [255, 0, 128] } else { [0; 3] })
            .collect(),
        heights: corners.iter().map(|corner| corner.z).collect(),
        labels: (0..8).collect(),
        faces,
        ..TestCloud::new(&corners)
    }
}

/// The unit sphere as a mesh of 20 * 4^3 triangles.
fn globe() -> TestCloud {
    let t = f32::midpoint(1.0, 5f32.sqrt());
    let mut corners: Vec<Vec3> = [[0.0, 1.0, t], [1.0, t, 0.0], [t, 0.0, 1.0]]
        .iter()
        .flat_map(|corner| {
            let flip = |mask: u32| {
                let sign = |bit: u32| if mask >> bit & 1 == 1 { -1.0 } else { 1.0 };
                let mut n = 0;
                Vec3::from_array(corner.map(|c| {
                    n += u32::from(c != 0.0);
                    if c == 0.0 { 0.0 } else { c * sign(n - 1) }
                }))
            };
            (0..4).map(flip)
        })
        .map(Vec3::normalize_or_zero)
        .collect();
    let mut faces = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| corners[i as usize]);
                let near = |u: Vec3, v: Vec3| u.distance(v) < 1.1;
                if near(p, q) && near(q, r) && near(r, p) {
                    let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                    faces.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..3 {
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(from, to)| {
                    let middle =
                        (corners[from as usize] + corners[to as usize]).normalize_or_zero();
                    let known = corners.iter().position(|corner| corner.distance(middle) < 1e-4);
                    known.unwrap_or_else(|| {
                        corners.push(middle);
                        corners.len() - 1
                    }) as u32
                });
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    TestCloud { normals: flat(&corners), faces, ..TestCloud::new(&corners) }
}

fn sampled(given: &TestCloud, params: &Settings) -> ToolOutput {
    let ran = run::<Sample>(given, params).unwrap();
    let EditHeader::NewCloud { origin, .. } = &ran.staged[0].0 else { panic!() };
    assert_eq!((*origin, ran.staged.len()), (given.origin, 1));
    ran
}

#[test]
fn surfels_lie_on_the_cube_and_share_its_area() {
    for method in [Method::BlueNoise, Method::Random, Method::Vertices] {
        for normals in [From::Vertex, From::Face] {
            let params = Settings { method, normals, count: 3000, ..Default::default() };
            let ran = sampled(&cube(), &params);
            let positions = ran.vectors("position");
            assert_eq!(positions.len(), if method == Method::Vertices { 8 } else { 3000 });
            for (position, normal) in positions.iter().zip(ran.vectors("normal")) {
                // Weights add up to 1 but for rounding.
                assert!((position.abs().max_element() - 1.0).abs() < 1e-6, "{position}");
                assert!((normal.length() - 1.0).abs() < 1e-6 && position.dot(normal) > 0.9);
                let on_a_side = position.abs().min_element() < 0.9 && method != Method::Vertices;
                if normals == From::Face && on_a_side {
                    assert_eq!(normal.abs().max_element(), 1.0);
                }
            }
            let total: f64 = ran.floats("area").iter().map(|&area| f64::from(area)).sum();
            assert!((total / 24.0 - 1.0).abs() < 1e-5, "{total}");
        }
    }
    let sides =
        |ran: &ToolOutput| ran.vectors("position").iter().filter(|p| p.x > 0.999_999).count();
    let random = Settings { method: Method::Random, count: 6000, ..Default::default() };
    // A sixth of 6000, give or take five standard deviations.
    assert!((sides(&sampled(&cube(), &random)) as f64 - 1000.0).abs() < 145.0);
    let even = Settings { count: 6000, ..Default::default() };
    assert!((sides(&sampled(&cube(), &even)) as f64 - 1000.0).abs() < 40.0);
}

#[test]
fn columns_are_blended_at_the_place() {
    for method in [Method::BlueNoise, Method::Random] {
        let ran = sampled(&cube(), &Settings { method, count: 500, ..Default::default() });
        let (colors, heights) = (ran.bytes("color"), ran.floats("height"));
        let labels = ran.bytes("label");
        for (i, position) in ran.vectors("position").iter().enumerate() {
            assert!((position.z - heights[i]).abs() < 1e-5);
            let linear = f32::midpoint(1.0, position.z);
            let red = (linear_to_srgb(linear) * 255.0).round();
            // An f32 rounding may fall to either side of a half.
            assert!((f32::from(colors[3 * i]) - red).abs() <= 1.0, "{red}");
            assert_eq!(colors[3 * i + 1], 0);
            let corner = u32::from(position.x > 0.0)
                + 2 * u32::from(position.y > 0.0)
                + 4 * u32::from(position.z > 0.0);
            // The nearest corner of the triangle is the nearest of the side but beside the diagonal.
            let label = u32::from(labels[4 * i]);
            assert!((label ^ corner).count_ones() <= 1);
        }
    }
    let at_vertices = Settings { method: Method::Vertices, ..Default::default() };
    let ran = sampled(&cube(), &at_vertices);
    assert_eq!(ran.bytes("color"), cube().colors);
    assert_eq!(ran.floats("height"), cube().heights);
}

#[test]
fn surfels_of_a_sphere_cover_it_and_lie_evenly() {
    let globe = globe();
    for method in [Method::BlueNoise, Method::Random, Method::Vertices] {
        let params = Settings { method, count: 700, ..Default::default() };
        let ran = sampled(&globe, &params);
        let (positions, radii) = (ran.vectors("position"), ran.floats("radius"));
        let normals = ran.vectors("normal");
        for direction in sphere(5000) {
            let covers = |i: usize| {
                // Where the ray from the centre meets the disc's plane.
                let along = positions[i].dot(normals[i]) / direction.dot(normals[i]);
                along > 0.0 && (direction * along).distance(positions[i]) <= radii[i]
            };
            assert!((0..positions.len()).any(covers), "{method:?} {direction}");
        }
        if method == Method::BlueNoise {
            let least = positions
                .iter()
                .enumerate()
                .flat_map(|(i, a)| positions[..i].iter().map(move |b| a.distance(*b)))
                .fold(f32::INFINITY, f32::min);
            let most =
                surfelshop_geometry::spread::largest_distance(4.0 * std::f64::consts::PI, 700);
            assert!(f64::from(least) > 0.6 * most, "{least} of {most}");
        }
    }
    let params = Settings { radius: Radius::Area, factor: 2.0, count: 700, ..Default::default() };
    let ran = sampled(&globe, &params);
    for (area, radius) in ran.floats("area").iter().zip(ran.floats("radius")) {
        assert!((2.0 * (area / std::f32::consts::PI).sqrt() - radius).abs() < 1e-6);
    }
}

#[test]
fn counts_densities_and_defaults() {
    let n = |params: Settings| sampled(&cube(), &params).floats("area").len();
    assert_eq!(n(Settings { density: 10.0, ..Default::default() }), 240);
    assert_eq!(n(Settings::default()), 8);
    assert_eq!(n(Settings { count: 1, ..Default::default() }), 1);
    for (params, expected) in [
        (Settings { count: 5, density: 1.0, ..Default::default() }, "a `count` or a `density`"),
        (
            Settings { density: 1e-9, ..Default::default() },
            "expected 1 to 100000000 surfels, found 0",
        ),
        (Settings { density: 1e20, ..Default::default() }, "expected 1 to 100000000 surfels"),
        (Settings { density: f64::NAN, ..Default::default() }, "`density`"),
        (Settings { factor: f64::INFINITY, ..Default::default() }, "`factor`"),
    ] {
        let line = refusal::<Sample>(&cube(), &params);
        assert!(line.contains(expected), "{line}");
    }
}

#[test]
fn what_has_no_area_gets_no_surfels_and_is_counted() {
    let mut given = cube();
    given.positions.extend([5.0; 3]);
    given.colors.extend([9; 3]);
    given.heights.push(f32::NAN);
    given.labels.push(99);
    given.faces.extend([[0, 1, 1], [8, 8, 8], [8, 0, 8]]);
    let ran = sampled(&given, &Settings { count: 400, ..Default::default() });
    assert_eq!(ran.message, "400 surfels; left out: 3 triangles without area");
    assert!(ran.vectors("position").iter().all(|p| p.abs().max_element() < 1.000_001));
    assert!(ran.floats("height").iter().all(|height| height.is_finite()));
    let vertices = Settings { method: Method::Vertices, ..Default::default() };
    let ran = sampled(&given, &vertices);
    assert_eq!(ran.message, "8 surfels; left out: 1 vertices without a triangle");
    let without = TestCloud { faces: vec![[0, 0, 1], [8, 8, 8]], ..given.clone() };
    assert!(refusal::<Sample>(&without, &Settings::default()).contains("triangles with an area"));
    let bare = TestCloud { faces: vec![], ..given };
    let line = refusal::<Sample>(&bare, &Settings::default());
    assert!(line.contains("found a cloud without triangles"), "{line}");
    let triangles = radii::Settings { method: radii::Method::Triangles, ..Default::default() };
    assert_eq!(refusal::<Radii>(&bare, &triangles), line);
    assert!(refusal::<Sample>(&TestCloud::default(), &Settings::default()).contains("empty cloud"));
}

#[test]
fn radii_of_triangles_reach_their_middles() {
    let triangles = radii::Settings { method: radii::Method::Triangles, ..Default::default() };
    let mut given = cube();
    given.positions.extend([5.0; 3]);
    let given = TestCloud { colors: vec![], heights: vec![], labels: vec![], ..given };
    let ran = run::<Radii>(&given, &triangles).unwrap();
    let radii = ran.floats("radius");
    // Half a diagonal of the cube's sides, and what geometry adds for curvature.
    assert!(radii[..8].iter().all(|radius| (radius / (1.15 * 2f32.sqrt()) - 1.0).abs() < 1e-5));
    assert!(radii[8] > 0.0 && radii[8].is_finite());
}

#[test]
fn samples_follow_from_the_seed_and_stop_at_every_question() {
    let places = |seed| {
        let params = Settings { seed, count: 300, ..Default::default() };
        sampled(&cube(), &params).floats("position")
    };
    assert_eq!(places(1), places(1));
    assert_ne!(places(1), places(2));
    for method in [Method::BlueNoise, Method::Random, Method::Vertices] {
        let params = Settings { method, count: 100, ..Default::default() };
        stops_everywhere::<Sample>(&cube(), &params);
    }
    let triangles = radii::Settings { method: radii::Method::Triangles, ..Default::default() };
    stops_everywhere::<Radii>(&cube(), &triangles);
}
