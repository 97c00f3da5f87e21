//! Measures against shapes whose numbers are known. Together they take half a second.

use super::*;
use crate::cloud::Cloud;
use crate::{Buffer, Column};
use glam::{DQuat, Vec3};

/// Numbers of a row without a pattern, in [0, 1). Source: the additive recurrence of the plastic number, Roberts 2018.
fn spread(i: usize) -> [f64; 2] {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    [1.0, 2.0].map(|power| ((i as f64 + 1.0) * PLASTIC.powf(-power)).fract())
}

fn with_normals(origin: DVec3, places: impl Iterator<Item = (DVec3, Vec3)>) -> Cloud {
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for (place, normal) in places {
        positions.extend((place - origin).as_vec3().to_array());
        normals.extend(normal.to_array());
    }
    let n = positions.len() / 3;
    let column = |name, components, values| Column::new(name, components, Buffer::F32(values));
    let columns = vec![
        column("position", 3, positions),
        column("normal", 3, normals),
        column("radius", 1, vec![0.01; n]),
    ];
    Cloud::new(origin, columns).unwrap()
}

/// Surfels that face a direction.
fn cloud(origin: DVec3, up: DVec3, places: impl Iterator<Item = DVec3>) -> Cloud {
    with_normals(origin, places.map(|place| (place, up.as_vec3())))
}

fn near(found: f64, expected: f64, share: f64) {
    let bound = share * expected.abs();
    assert!((found - expected).abs() <= bound, "{found} for {expected}, off by more than {bound}");
}

fn first(measure: &Measure, up: DVec3) -> f64 {
    measure.quantities(up)[0].value
}

/// Where the scene lies: at the origin, far away, and turned.
fn placements() -> [(DVec3, DQuat); 3] {
    let far = DVec3::new(481_000.5, 5_456_000.25, 1e6);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize_or(DVec3::X), 0.7);
    [(DVec3::ZERO, DQuat::IDENTITY), (far, DQuat::IDENTITY), (far, turn)]
}

#[test]
fn far_places_are_measured_as_exactly_as_near_ones() {
    for (origin, turn) in placements() {
        let at = |x: f64, y: f64, z: f64| origin + turn * DVec3::new(x, y, z);
        let up = turn * DVec3::Z;
        // Rounding of places at 5e6 is 1e-9.
        let of = |kind, places: &[DVec3]| Measure::new(kind, places.to_vec());
        let line =
            of(MeasureKind::Distance, &[at(0.0, 0.0, 0.0), at(3.0, 4.0, 0.0), at(3.0, 4.0, 12.0)]);
        near(first(&line, up), 17.0, 1e-9);
        let parts = line.quantities(up);
        let named = |name: &str| parts.iter().find(|part| part.name == name).unwrap().value;
        near(named("across"), 5.0, 1e-9);
        near(named("rise"), 12.0, 1e-9);
        near(named("from end to end"), 13.0, 1e-9);
        let right =
            of(MeasureKind::Angle, &[at(2.0, 0.0, 0.0), at(0.0, 0.0, 0.0), at(0.0, 0.3, 0.0)]);
        near(first(&right, up), 90.0, 1e-8);
        let small =
            of(MeasureKind::Angle, &[at(1.0, 0.0, 0.0), at(0.0, 0.0, 0.0), at(1.0, 1e-4, 0.0)]);
        near(first(&small, up), 1e-4f64.atan().to_degrees(), 1e-4);
        let height = of(MeasureKind::Height, &[at(0.0, 0.0, 1.0), at(5.0, 1.0, -1.5)]);
        near(first(&height, up), -2.5, 1e-8);
        // An L, which is not convex.
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        let area = of(MeasureKind::Area, &corners.map(|(x, y)| at(x, y, 0.5)));
        near(first(&area, up), 6.0, 1e-8);
        near(area.quantities(up)[1].value, 14.0, 1e-8);
        assert!(area.quantities(up)[2].value < 1e-8, "all lie in a plane");
    }
    assert!(Measure::new(MeasureKind::Angle, vec![DVec3::ZERO]).quantities(DVec3::Y).is_empty());
}

/// Invariant: the volume of a cap of a sphere over a plane is that of the formula, wherever it lies
#[test]
fn the_volume_of_a_cap_of_a_sphere_is_that_of_the_formula() {
    let (radius, height) = (1.0, 0.4);
    let below = radius - height;
    let exact = std::f64::consts::PI * height * height * (3.0 * radius - height) / 3.0;
    for (origin, turn) in placements() {
        let place = |i: usize| {
            let [x, y] = spread(i).map(|share| 3.0 * share - 1.5);
            let top = (radius * radius - x * x - y * y).max(0.0).sqrt() - below;
            origin + turn * DVec3::new(x, y, top.max(0.0))
        };
        let up = turn * DVec3::Z;
        let whole = cloud(origin, up, (0..60_000).map(place));
        let corners = [(-1.2, -1.2), (1.2, -1.2), (1.2, 1.2), (-1.2, 1.2)];
        let places = corners.map(|(x, y)| origin + turn * DVec3::new(x, y, 0.0)).to_vec();
        let measure = Measure::new(MeasureKind::Volume, places);
        let volume = Volume::of(&measure, up, &[&whole]).unwrap();
        near(volume.above, exact, 2e-3);
        assert!(volume.below < 1e-3 * exact, "{}", volume.below);
        near(volume.area, 5.76, 1e-8);
        assert!(volume.covered > 0.97, "{}", volume.covered);
        // Turned over it is a hollow.
        let hollow = Volume::of(&measure, -up, &[&whole]).unwrap();
        near(hollow.below, exact, 2e-2);
        // Two halves are one whole.
        let half = |first: usize| cloud(origin, up, (first..60_000).step_by(2).map(place));
        let both = Volume::of(&measure, up, &[&half(0), &half(1)]).unwrap();
        near(both.above, volume.above, 1e-9);
    }
}

/// Invariant: a body that stands on a plane has its volume, though there are surfels at its underside
#[test]
fn the_underside_of_a_body_is_not_in_its_volume() {
    // A box of 2 by 1 by 0.5 on the ground, its top and its underside, and the ground around it.
    let place = |i: usize| {
        let [x, y] = spread(i);
        let ground = DVec3::new(10.0 * x - 4.0, 10.0 * y - 4.0, 0.0);
        let is_under = (0.0..=2.0).contains(&ground.x) && (0.0..=1.0).contains(&ground.y);
        // As many to a unit everywhere.
        match i {
            0..4_000 => Some((DVec3::new(2.0 * x, y, 0.5), Vec3::Z)),
            4_000..8_000 => Some((DVec3::new(2.0 * x, y, 0.0), -Vec3::Z)),
            _ => (!is_under).then_some((ground, Vec3::Z)),
        }
    };
    let all: Vec<(DVec3, Vec3)> = (0..208_000).filter_map(place).collect();
    let turned = |sign: f32| with_normals(DVec3::ZERO, all.iter().map(|(p, n)| (*p, *n * sign)));
    let corners = [(-2.0, -2.0), (5.5, -2.0), (-2.0, 5.5)];
    let places = corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
    let measure = Measure::new(MeasureKind::Volume, places);
    for sign in [1.0, -1.0] {
        let volume = Volume::of(&measure, DVec3::Z, &[&turned(sign)]).unwrap();
        near(volume.above, 1.0, 0.03);
        assert!(volume.below < 1e-6);
    }
}

/// Invariant: a profile through a box is its section
#[test]
fn a_profile_through_a_box_is_its_section() {
    for (origin, turn) in placements() {
        let place = |i: usize| {
            let [x, y] = spread(i).map(|share| 4.0 * share - 2.0);
            let is_top = x.abs() < 1.0 && y.abs() < 0.5;
            origin + turn * DVec3::new(x, y, if is_top { 0.75 } else { 0.0 })
        };
        let up = turn * DVec3::Z;
        let whole = cloud(origin, up, (0..40_000).map(place));
        let ends = [(-1.5, 0.1), (1.5, 0.1)].map(|(x, y)| origin + turn * DVec3::new(x, y, 0.2));
        let mut measure = Measure::new(MeasureKind::Profile, ends.to_vec());
        measure.thickness = Some(0.2);
        let profile = Profile::of(&measure, up, &[&whole]).unwrap();
        near(profile.length, 3.0, 1e-9);
        // As many as the slab's share of the ground has.
        near(profile.points.len() as f64, 40_000.0 * 0.6 / 16.0, 0.05);
        let base = origin.dot(up);
        for [along, height] in &profile.points {
            let expected = if (0.5..2.5).contains(along) { 0.75 } else { 0.0 };
            let is_edge = (along - 0.5).abs() < 1e-6 || (along - 2.5).abs() < 1e-6;
            assert!(is_edge || (height - base - expected).abs() < 1e-6, "{height} at {along}");
        }
        assert!(profile.points.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
        near(profile.heights()[1] - profile.heights()[0], 0.75, 1e-6);
        assert!(profile.some(100).len() <= 100);
        let csv = profile.csv();
        assert_eq!(csv.lines().count(), profile.points.len() + 1);
        let last = csv.lines().last().unwrap();
        let numbers: Vec<f64> = last.split(',').map(|n| n.parse().unwrap()).collect();
        assert_eq!(numbers, profile.points.last().unwrap(), "all digits are written");
    }
}

#[test]
fn what_cannot_be_measured_is_said() {
    let whole = cloud(DVec3::ZERO, DVec3::Y, (0..10).map(|i| DVec3::splat(f64::from(i))));
    let of = |kind, places: &[DVec3]| Measure::new(kind, places.to_vec());
    let above = of(MeasureKind::Profile, &[DVec3::ZERO, DVec3::Y]);
    assert_eq!(Profile::of(&above, DVec3::Y, &[&whole]), Err(MeasureError::Vertical));
    let beside = of(MeasureKind::Profile, &[DVec3::X * 50.0, DVec3::X * 60.0]);
    let nothing = MeasureError::Nothing { kind: MeasureKind::Profile };
    assert_eq!(Profile::of(&beside, DVec3::Y, &[&whole]), Err(nothing));
    assert!(matches!(
        Profile::of(&of(MeasureKind::Profile, &[DVec3::ZERO]), DVec3::Y, &[]),
        Err(MeasureError::Places { found: 1, .. })
    ));
    let line = of(MeasureKind::Volume, &[DVec3::ZERO, DVec3::X, DVec3::X * 3.0]);
    assert_eq!(Volume::of(&line, DVec3::Y, &[&whole]), Err(MeasureError::Flat));
    let away = of(MeasureKind::Volume, &[DVec3::Z * 90.0, DVec3::X, DVec3::Z * 91.0]);
    let none = MeasureError::Nothing { kind: MeasureKind::Volume };
    assert_eq!(Volume::of(&away, DVec3::Y, &[]), Err(none));
}

#[test]
fn labels_have_the_unit_that_suits_them() {
    let metres = |metres| Units { metres: Some(metres) };
    for (value, kind, units, expected) in [
        (2.418_74, QuantityKind::Length, metres(1.0), "2.4187 m"),
        (0.142, QuantityKind::Length, metres(1.0), "14.2 cm"),
        (-0.142, QuantityKind::Length, metres(1.0), "-14.2 cm"),
        (1234.56, QuantityKind::Length, metres(1.0), "1.2346 km"),
        (50.0, QuantityKind::Length, metres(0.001), "5 cm"),
        (0.5, QuantityKind::Area, metres(1.0), "5000 cm²"),
        (12_345_678.0, QuantityKind::Area, metres(1.0), "12345678 m²"),
        (2.0, QuantityKind::Volume, metres(0.01), "2 cm³"),
        (0.0, QuantityKind::Length, metres(1.0), "0 m"),
        (0.012_345_67, QuantityKind::Length, Units::default(), "0.012346"),
        (1e-9, QuantityKind::Length, Units::default(), "1.0000e-9"),
        (89.999_999, QuantityKind::Degrees, Units::default(), "90°"),
        (0.973, QuantityKind::Share, Units::default(), "97.3 %"),
        (1200.0, QuantityKind::Count, metres(1.0), "1200"),
    ] {
        assert_eq!(units.text(&Quantity::new("a", value, kind)), expected);
    }
    let mut line = Measure::new(MeasureKind::Distance, vec![DVec3::ZERO, DVec3::X * 2.0]);
    assert_eq!(metres(1.0).label(&line, DVec3::Y, &[]), "2 m");
    line.name = "door".to_owned();
    assert_eq!(Units::default().label(&line, DVec3::Y, &[]), "door  2");
    assert_eq!(
        (line.title(3).as_str(), Measure::default().title(3).as_str()),
        ("door", "distance 4")
    );
}

#[test]
fn figures_go_where_the_places_are() {
    let at = |x: f64, y: f64| DVec3::new(x, y, 7.0);
    let l = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
    let area = Measure::new(MeasureKind::Area, l.map(|(x, y)| at(x, y)).to_vec());
    let figure = Figure::of(&area, DVec3::Y);
    assert_eq!((figure.segments.len(), figure.places.len()), (6, 6));
    // The middle of the L by its two boxes.
    let middle = (at(2.0, 0.5) * 4.0 + at(0.5, 2.0) * 2.0) / 6.0;
    assert!(figure.anchor.unwrap().distance(middle) < 1e-9);
    let angle = Measure::new(MeasureKind::Angle, vec![at(2.0, 0.0), at(0.0, 0.0), at(0.0, 2.0)]);
    let arc = Figure::of(&angle, DVec3::Y);
    let radius = arc.anchor.unwrap().distance(at(0.0, 0.0));
    assert!((radius - 0.7).abs() < 1e-9 && arc.segments.len() > 20);
    let height = Measure::new(MeasureKind::Height, vec![at(0.0, 0.0), at(3.0, 2.0)]);
    let figure = Figure::of(&height, DVec3::Y);
    assert_eq!(figure.segments[0].ends, [at(0.0, 0.0), at(0.0, 2.0)]);
    assert_eq!(figure.segments.iter().filter(|line| line.is_faint).count(), 2);
    assert_eq!(Figure::of(&Measure::default(), DVec3::Y), Figure::default());
}

#[test]
fn every_value_of_a_measure_in_a_scene_is_checked() {
    let refused = |lines: &str| {
        let text = format!("format = 1\n[[measure]]\n{lines}\n");
        let read = crate::scene::read_bytes(std::path::Path::new("a.scene.toml"), text.as_bytes());
        read.unwrap_err().to_string()
    };
    let kinds = "distance, angle, height, area, profile, volume, note";
    for (lines, expected) in [
        ("", format!("2:1: `measure[1].kind`: expected one of {kinds}, found no such key; add it")),
        ("kind = 'size'", format!("3:8: `measure[1].kind`: expected one of {kinds}, found `'size'`")),
        (
            "kind = 'angle'\nplaces = [[0, 0, 0], [1, 0, 0]]",
            "4:10: `measure[1].places`: expected 3 places of three numbers each, found \
             `[[0, 0, 0], [1, 0, 0]]`"
                .to_owned(),
        ),
        (
            "kind = 'note'\nplaces = [[0, 0, inf]]",
            "4:11: `measure[1].places`: expected three numbers from -1e37 to 1e37, found `[0, 0, inf]`"
                .to_owned(),
        ),
        (
            "kind = 'height'\nplaces = [[0, 0, 0], [0, 1, 0]]\ntext = 'a'",
            "5:8: `measure[1].text`: expected `kind = \"note\"` beside it, found `'a'`".to_owned(),
        ),
        (
            "kind = 'profile'\nplaces = [[0, 0, 0], [0, 1, 0]]\nthickness = 0",
            "5:13: `measure[1].thickness`: expected a length above 0, at most 1e37, found `0`".to_owned(),
        ),
    ] {
        assert_eq!(refused(lines), format!("a.scene.toml:{expected}"), "{lines}");
    }
    let many = "[0, 0, 0], ".repeat(MOST_PLACES + 1);
    let many = refused(&format!("kind = 'distance'\nplaces = [{many}]"));
    assert!(many.contains("expected at most 1000 places, found 1001"), "{many}");
}

#[test]
fn what_a_measure_is_of_may_be_in_the_balls_around_it() {
    let up = DVec3::Z;
    let places = (0..4000).map(|i| {
        let [x, y] = spread(i);
        DVec3::new(4.0 * x - 1.0, 4.0 * y - 1.0, (7.0 * x).sin())
    });
    let places: Vec<DVec3> = places.collect();
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.1 * x);
    let mut slab = Measure::new(MeasureKind::Profile, vec![at(0.0, 0.0), at(1.0, 0.5)]);
    slab.thickness = Some(0.1);
    let corners = vec![at(0.0, 0.0), at(1.0, 0.2), at(0.3, 1.0)];
    let prism = Measure::new(MeasureKind::Volume, corners);
    for measure in [slab, prism] {
        let (mut n, mut n_left_out) = (0, 0);
        for place in &places {
            let one = cloud(*place, up, [*place].into_iter());
            let is_of = measure.surfel_quantities(up, &[&one]).is_ok();
            // The place lies at the edge of a ball.
            let middle = *place + 0.3 * DVec3::new(0.6, 0.0, 0.8);
            let may_be = measure.may_be_of(up, middle, 0.3 + 1e-9);
            assert!(may_be || !is_of, "{place}");
            (n, n_left_out) = (n + usize::from(is_of), n_left_out + usize::from(!may_be));
        }
        assert!(n > 5 && n_left_out > 1000, "{n}, {n_left_out}");
        assert!(measure.may_be_of(up, DVec3::NAN, 0.1));
    }
    let none = Measure::new(MeasureKind::Distance, vec![at(0.0, 0.0), at(1.0, 0.0)]);
    assert!(!none.may_be_of(up, DVec3::ZERO, 1.0));
}
