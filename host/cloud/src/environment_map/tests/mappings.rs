use super::*;
use std::f64::consts::PI;
use surfelshop_geometry::harmonics::directions;

const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

#[test]
fn every_direction_comes_back_from_its_place() {
    for mapping in Mapping::ALL {
        for d in directions(2000).chain(AXES) {
            // Lengths do not matter, not even those whose squares are no numbers.
            for length in [1.0, 1e-200, 1e200] {
                let [u, v] = mapping.place(length * d);
                let back = mapping.direction(u, v);
                // The rim of a disc squeezes +z so that rounding there may fall beyond it.
                let back = back.or_else(|| mapping.direction(0.5 + (u - 0.5) * (1.0 - 1e-15), v));
                let back = back.unwrap_or_else(|| panic!("{mapping:?} {d}: nothing at {u} {v}"));
                // At a ball's rim an ulp of the radius is 2e-8 radians.
                assert!(back.distance(d) < 1e-7, "{mapping:?}: {d} became {back}");
                assert!((back.length() - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn any_input_has_a_place() {
    let odd = [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY, DVec3::MAX, DVec3::splat(5e-324)];
    for mapping in Mapping::ALL {
        for d in odd {
            let [u, v] = mapping.place(d);
            assert!((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v), "{mapping:?} {d}");
        }
        for (u, v) in [(f64::NAN, 0.5), (-0.1, 0.5), (0.5, 1.1)] {
            assert_eq!(mapping.direction(u, v), None);
        }
        assert_eq!(Mapping::from_name(mapping.name()), Some(mapping));
    }
    assert_eq!(Mapping::from_name("cube"), None);
}

#[test]
fn places_are_those_of_the_conventions() {
    let at = |mapping: Mapping, u, v| mapping.direction(u, v).unwrap();
    let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} instead of {b}");
    for mapping in [Mapping::Angular, Mapping::MirroredBall, Mapping::LatLong] {
        near(at(mapping, 0.5, 0.5), DVec3::NEG_Z);
    }
    // Halfway to the rim of an angular map is at a right angle; of a ball, at 0.7071.
    near(at(Mapping::Angular, 0.75, 0.5), DVec3::X);
    near(at(Mapping::Angular, 0.5, 0.25), DVec3::Y);
    near(at(Mapping::MirroredBall, 0.5 + 0.125f64.sqrt(), 0.5), DVec3::X);
    near(at(Mapping::LatLong, 0.75, 0.5), DVec3::X);
    near(at(Mapping::LatLong, 0.3, 0.0), DVec3::Y);
    near(at(Mapping::Octahedral, 0.5, 0.5), DVec3::Z);
    near(at(Mapping::Octahedral, 0.5, 1.0), DVec3::Y);
    near(at(Mapping::Octahedral, 0.0, 0.0), DVec3::NEG_Z);
    let cell = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let vertical = [[1, 0], [0, 1], [1, 1], [2, 1], [1, 2], [1, 3]];
    let faces = [DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y, DVec3::Z];
    for ([x, y], face) in vertical.into_iter().zip(faces) {
        near(at(Mapping::VerticalCross, cell(x, 3), cell(y, 4)), face);
        let (x, y) = if face == DVec3::Z { (3, 1) } else { (x, y) };
        near(at(Mapping::HorizontalCross, cell(x, 4), cell(y, 3)), face);
    }
    for (mapping, u, v) in [
        (Mapping::Angular, 0.02, 0.02),
        (Mapping::VerticalCross, 0.1, 0.1),
        (Mapping::VerticalCross, 0.9, 0.9),
        (Mapping::HorizontalCross, 0.7, 0.2),
    ] {
        assert_eq!(mapping.direction(u, v), None, "{mapping:?}");
    }
}

#[test]
fn neighbouring_faces_of_a_cross_join() {
    // Across every edge that two faces share in the picture, directions change by little.
    for (mapping, edges) in [
        (Mapping::VerticalCross, vec![(0.5, 0.25), (0.5, 0.5), (0.5, 0.75), (1.0 / 3.0, 0.4)]),
        (Mapping::HorizontalCross, vec![(0.25, 0.4), (0.5, 0.4), (0.75, 0.4), (0.3, 1.0 / 3.0)]),
    ] {
        for (u, v) in edges {
            let corners = [(-1e-6, -1e-6), (1e-6, 1e-6)];
            let [a, b] = corners.map(|(du, dv)| mapping.direction(u + du, v + dv).unwrap());
            assert!(a.distance(b) < 1e-4, "{mapping:?} at {u} {v}: {a}, {b}");
        }
    }
}

/// Invariant: solid angles of every mapping add up to the sphere
#[test]
fn solid_angles_sum_to_the_sphere() {
    for mapping in Mapping::ALL {
        // Exact but for rounding, or by the quadrature at the rim, which is coarse in small discs.
        let tolerance = match mapping {
            Mapping::Angular | Mapping::MirroredBall => 1e-5 * 4.0 * PI,
            _ => 1e-9,
        };
        for size in [4, 12, 20, 64, 100, 516] {
            let (width, height) = shape(mapping, size);
            let angles = solid_angles(mapping, width, height);
            assert_eq!(angles.len(), (width * height) as usize);
            assert!(angles.iter().all(|&angle| angle >= 0.0));
            let sum: f64 = angles.iter().sum();
            assert!((sum - 4.0 * PI).abs() < tolerance, "{mapping:?} {size}: {sum}");
        }
    }
    for odd in [1, 3, 5, 63, 301] {
        for mapping in [Mapping::Octahedral, Mapping::Angular, Mapping::MirroredBall] {
            let sum: f64 = solid_angles(mapping, odd, odd).iter().sum();
            // A single texel of an angular map has the whole disc, which takes three nodes too few.
            let tolerance = if mapping == Mapping::Octahedral { 1e-9 } else { 1e-4 };
            if odd > 3 || mapping == Mapping::Octahedral {
                assert!((sum - 4.0 * PI).abs() < tolerance, "{mapping:?} {odd}: {sum}");
            }
        }
    }
}

#[test]
fn solid_angles_are_those_of_the_texels() {
    // Counted: of evenly spread directions, as many fall into a block of texels as its angle says.
    const N: usize = 200_000;
    for mapping in Mapping::ALL {
        let (width, height) = shape(mapping, 12);
        let mut counts = vec![0.0; (width * height) as usize];
        for d in directions(N) {
            let [u, v] = mapping.place(d);
            let x = ((u * f64::from(width)) as u32).min(width - 1);
            let y = ((v * f64::from(height)) as u32).min(height - 1);
            counts[(y * width + x) as usize] += 4.0 * PI / N as f64;
        }
        for (i, angle) in solid_angles(mapping, width, height).into_iter().enumerate() {
            // A spiral misjudges a region by about its border: a few dozen directions of thousands.
            assert!((counts[i] - angle).abs() < 4e-3, "{mapping:?} {i}: {} {angle}", counts[i]);
        }
    }
}

/// The colour of the axis nearest to a direction.
fn axis_color(d: DVec3) -> [f32; 3] {
    let colors = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 1.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0],
    ];
    let nearest = (0..6).max_by(|&a, &b| AXES[a].dot(d).total_cmp(&AXES[b].dot(d))).unwrap();
    colors[nearest]
}

#[test]
fn six_colours_come_out_in_their_places() {
    for mapping in Mapping::ALL {
        let probe = probe(painted(mapping, 256, axis_color), mapping);
        let side = probe.facts.side;
        let mut checked = 0;
        for j in 0..side {
            for i in 0..side {
                let d = of_map(&probe, i, j);
                // Away from the edges between colours, by more than a texel of the coarsest part.
                let mut sorted = d.abs().to_array();
                sorted.sort_by(f64::total_cmp);
                if sorted[2] - sorted[1] < 0.1 {
                    continue;
                }
                checked += 1;
                let found = probe.texels[(j * side + i) as usize];
                for (a, b) in found.into_iter().zip(axis_color(d)) {
                    // Weights of interpolation sum to 1 but for rounding.
                    assert!((a - b).abs() < 1e-6, "{mapping:?} {d}: {found:?}");
                }
            }
        }
        assert!(checked > side * side / 2, "{checked}");
    }
}

#[test]
fn the_border_of_the_map_is_equal_where_it_shows_one_direction() {
    let wild = |d: DVec3| [d.x, d.y, d.z].map(|c| (2.0 + (17.0 * c).sin()) as f32);
    for mapping in Mapping::ALL {
        let probe = probe(painted(mapping, 128, wild), mapping);
        let side = probe.facts.side as usize;
        let (last, at) = (side - 1, |i: usize, j: usize| probe.texels[j * side + i]);
        for k in 0..side {
            for edge in [0, last] {
                assert_eq!(at(edge, k), at(edge, last - k));
                assert_eq!(at(k, edge), at(last - k, edge));
            }
        }
        assert!([(last, 0), (0, last), (last, last)].iter().all(|&(i, j)| at(i, j) == at(0, 0)));
    }
}
