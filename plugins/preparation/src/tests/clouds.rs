//! `normals`, `radii`, `outliers` and `thin`.

use super::*;
use crate::normals::{Normals, Orientation};
use crate::outliers::Outliers;
use crate::radii::Radii;
use crate::thin::{Radius, Thin};
use crate::{normals, outliers, radii, thin};
use surfelshop_geometry::hashing::{fraction, scattered};

/// A sphere with normals and radii.
fn ball(n: u32) -> TestCloud {
    let positions = sphere(n);
    let radii = vec![0.05; positions.len()];
    TestCloud { normals: flat(&positions), radii, ..TestCloud::new(&positions) }
}

#[test]
fn normals_face_where_they_are_asked_to() {
    let mut given = ball(1500);
    // Every second one faces inwards.
    given.normals.chunks_mut(6).for_each(|pair| pair[..3].iter_mut().for_each(|c| *c = -*c));
    given.origin = DVec3::new(100.0, 0.0, 0.0);
    let positions = sphere(1500);
    let with = |orientation, towards_x| {
        let params = normals::Settings { orientation, towards_x, ..Default::default() };
        run::<Normals>(&given, &params).unwrap()
    };
    let outwards = with(Orientation::Outwards, 0.0);
    assert_eq!(
        outwards.message,
        "1500 normals, 0 without a plane around them, 1 part turned outwards"
    );
    for (position, normal) in positions.iter().zip(outwards.vectors("normal")) {
        assert!(position.dot(normal) > 0.99);
    }
    // A place in the middle of the sphere, in the world.
    for (position, normal) in
        positions.iter().zip(with(Orientation::Towards, 100.0).vectors("normal"))
    {
        assert!(position.dot(normal) < -0.99);
    }
    // One far away to the right sees the right half from outside.
    for (position, normal) in
        positions.iter().zip(with(Orientation::Towards, 1e6).vectors("normal"))
    {
        assert!(normal.x >= -1e-4 && position.dot(normal).abs() > 0.99);
    }
    // What can be seen of a ball is its outside.
    for (position, normal) in
        positions.iter().zip(with(Orientation::Visible, 0.0).vectors("normal"))
    {
        assert!(position.dot(normal) > 0.99);
    }
    let kept = with(Orientation::Keep, 0.0).vectors("normal");
    let flipped = with(Orientation::Flip, 0.0).vectors("normal");
    for ((given, kept), flipped) in given.view().vectors(NORMAL).zip(kept).zip(flipped) {
        assert!(kept.dot(given) > 0.99 && flipped == -given);
    }
    let bare = TestCloud::new(&positions);
    let params = normals::Settings { orientation: Orientation::Keep, ..Default::default() };
    assert!(refusal::<Normals>(&bare, &params).contains("orientation=outwards"));
}

#[test]
fn radii_follow_factor_and_limits() {
    let given = ball(1000);
    let with = |factor, minimum, maximum| {
        let params = radii::Settings { factor, minimum, maximum, ..Default::default() };
        run::<Radii>(&given, &params).unwrap()
    };
    let plain = with(1.0, 0.0, 0.0).floats("radius");
    // Points on a sphere of 1000: 4 pi / 1000 each, covered by 0.66 to 0.8 of its root.
    assert!(plain.iter().all(|&radius| radius > 0.06 && radius < 0.13));
    let twice = with(2.0, 0.0, 0.0).floats("radius");
    assert!(plain.iter().zip(&twice).all(|(plain, twice)| (plain * 2.0 - twice).abs() < 1e-6));
    let middle = plain[500];
    let limited = with(1.0, 0.0, f64::from(middle));
    assert!(limited.floats("radius").iter().all(|&radius| radius <= middle));
    assert!(with(1.0, 0.5, 0.0).floats("radius").iter().all(|&radius| radius == 0.5));
    let params = radii::Settings { minimum: 2.0, maximum: 1.0, ..Default::default() };
    assert!(refusal::<Radii>(&given, &params).contains("`minimum` of at most the `maximum` 1"));
}

#[test]
fn outliers_go_and_the_rest_stays() {
    let mut positions = sphere(2000);
    let strays = [Vec3::splat(1.2), Vec3::new(0.0, 2.0, 0.0), Vec3::new(-9.0, 0.0, 0.0)];
    positions.extend(strays);
    positions.push(strays[0]);
    let given = TestCloud::new(&positions);
    for method in
        [outliers::Method::Robust, outliers::Method::Statistical, outliers::Method::Radius]
    {
        let params = outliers::Settings { method, deviations: 4.0, ..Default::default() };
        let ran = run::<Outliers>(&given, &params).unwrap();
        assert_eq!(count(&ran.mask()), 2000, "{}", ran.message);
        assert!(ran.mask()[..2000].iter().all(|kept| *kept));
        assert!(ran.message.contains(" of 2004 removed: "), "{}", ran.message);
    }
    let params =
        outliers::Settings { method: outliers::Method::Radius, radius: 1e-6, ..Default::default() };
    let line = refusal::<Outliers>(&given, &params);
    assert!(line.contains("found all 2004 to be outliers (fewer than 4 points within"), "{line}");
}

#[test]
fn fewer_surfels_still_cover_the_sphere() {
    let given = ball(6000);
    let positions = sphere(6000);
    for method in [thin::Method::BlueNoise, thin::Method::Grid] {
        for (wanted, spacing) in [(600, 0.0), (0, 0.14)] {
            let params = thin::Settings { method, count: wanted, spacing, ..Default::default() };
            let ran = run::<Thin>(&given, &params).unwrap();
            let (mask, radii) = (ran.mask(), ran.floats("radius"));
            if method == thin::Method::BlueNoise && wanted > 0 {
                assert_eq!(count(&mask), wanted as usize);
            }
            assert!((300..900).contains(&count(&mask)), "{}", count(&mask));
            let kept: Vec<(Vec3, f32)> =
                (0..6000).filter(|&i| mask[i]).map(|i| (positions[i], radii[i])).collect();
            for position in &positions {
                let covers = |(at, radius): &(Vec3, f32)| {
                    let offset = *position - *at;
                    (offset - *at * offset.dot(*at)).length() <= *radius && offset.dot(*at) > -0.5
                };
                assert!(kept.iter().any(covers), "{method:?} {position}");
            }
            assert!((0..6000).filter(|&i| !mask[i]).all(|i| radii[i] == 0.05));
        }
    }
}

#[test]
fn radii_of_a_thinned_cloud_may_scale_or_stay() {
    let given = ball(2000);
    let with = |radius| {
        let params = thin::Settings { count: 500, radius, ..Default::default() };
        run::<Thin>(&given, &params).unwrap()
    };
    assert!(with(Radius::Scale).floats("radius").iter().all(|&radius| (radius - 0.1).abs() < 1e-6));
    let kept = with(Radius::Keep);
    assert_eq!((kept.staged.len(), count(&kept.mask())), (1, 500));
    let half = run::<Thin>(&given, &thin::Settings::default()).unwrap();
    assert_eq!(count(&half.mask()), 1000);
    let thrown = |seed| {
        let params = thin::Settings { spacing: 0.2, seed, ..Default::default() };
        run::<Thin>(&given, &params).unwrap().mask()
    };
    assert!(thrown(1) == thrown(1) && thrown(1) != thrown(2));
    let both = thin::Settings { count: 5, spacing: 0.1, ..Default::default() };
    assert!(refusal::<Thin>(&given, &both).contains("a `count` or a `spacing`, found both"));
}

#[test]
fn odd_clouds_are_prepared_or_refused() {
    for given in odd_clouds() {
        for orientation in
            [Orientation::Outwards, Orientation::Towards, Orientation::Keep, Orientation::Visible]
        {
            let params = normals::Settings { orientation, neighbours: 256, ..Default::default() };
            let ran = run::<Normals>(&given, &params).unwrap();
            assert!(ran.vectors("normal").iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
        }
        let ran = run::<Radii>(&given, &radii::Settings::default()).unwrap();
        assert!(ran.floats("radius").iter().all(|&r| r > 0.0 && r.is_finite()));
        for method in [outliers::Method::Robust, outliers::Method::Statistical] {
            let params = outliers::Settings { method, neighbours: 256, ..Default::default() };
            assert!(count(&run::<Outliers>(&given, &params).unwrap().mask()) > 0);
        }
        for method in [thin::Method::BlueNoise, thin::Method::Grid] {
            for (count, spacing) in [(0, 0.0), (1, 0.0), (1_000_000, 0.0), (0, 1e-30), (0, 1e30)] {
                let params = thin::Settings { method, count, spacing, ..Default::default() };
                let ran = run::<Thin>(&given, &params).unwrap();
                assert!(super::count(&ran.mask()) > 0);
                assert!(ran.floats("radius").iter().all(|&r| r > 0.0 && r.is_finite()));
            }
        }
    }
    let empty = TestCloud::default();
    assert!(refusal::<Normals>(&empty, &Default::default()).contains("empty cloud"));
    assert!(refusal::<Radii>(&empty, &Default::default()).contains("empty cloud"));
    assert!(refusal::<Outliers>(&empty, &Default::default()).contains("empty cloud"));
    assert!(refusal::<Thin>(&empty, &Default::default()).contains("empty cloud"));
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    let given = ball(50);
    for wrong in [f64::NAN, f64::INFINITY] {
        let params = normals::Settings { towards_y: wrong, ..Default::default() };
        assert!(refusal::<Normals>(&given, &params).contains("`towards-y`"));
        let params = radii::Settings { factor: wrong, ..Default::default() };
        assert!(refusal::<Radii>(&given, &params).contains("`factor`"));
        let params = outliers::Settings { deviations: wrong, ..Default::default() };
        assert!(refusal::<Outliers>(&given, &params).contains("`deviations`"));
        let params = thin::Settings { spacing: wrong, ..Default::default() };
        assert!(refusal::<Thin>(&given, &params).contains("`spacing`"));
    }
}

#[test]
fn tools_stop_at_every_question() {
    let given = ball(200);
    stops_everywhere::<Normals>(&given, &normals::Settings::default());
    stops_everywhere::<Radii>(&given, &radii::Settings::default());
    for method in [outliers::Method::Robust, outliers::Method::Radius] {
        let params = outliers::Settings { method, ..Default::default() };
        stops_everywhere::<Outliers>(&given, &params);
    }
    for method in [thin::Method::BlueNoise, thin::Method::Grid] {
        for spacing in [0.0, 0.3] {
            let params = thin::Settings { method, spacing, ..Default::default() };
            stops_everywhere::<Thin>(&given, &params);
        }
    }
}

#[test]
fn ellipses_grow_with_their_radius() {
    let mut given = ball(400);
    given.radii = vec![0.01; 400];
    let tangents: Vec<f32> = [0.01, 0.0, 0.0].repeat(400);
    let mut view = given.view();
    for name in ["tangent_u", "tangent_v"] {
        let values = Values::F32(&tangents);
        view.columns.push(ColumnView { name, components: 3, generation: 1, values });
    }
    let host = RecordingHost::default();
    Radii.run(&view, &radii::Settings::default(), &Job::new(&host)).unwrap();
    let ran = ToolOutput { staged: host.staged.into_inner(), message: String::new() };
    let (radii, tangents) = (ran.floats("radius"), ran.vectors("tangent_v"));
    for (radius, tangent) in radii.iter().zip(tangents) {
        assert!(*radius > 0.05 && (tangent.length() / radius - 1.0).abs() < 1e-5);
    }
}

/// Invariant: soft normals of what is no surface face the place or the side that was asked for, like all others
#[test]
fn what_is_no_surface_faces_where_it_is_asked_to() {
    let unit = |i: u64| fraction(scattered(i)) as f32 * 2.0 - 1.0;
    let points: Vec<Vec3> =
        (0..2000).map(|i| Vec3::new(unit(3 * i), unit(3 * i + 1), unit(3 * i + 2))).collect();
    let mut given = TestCloud::new(&points);
    let settings = normals::Settings {
        orientation: Orientation::Towards,
        towards_y: 50.0,
        measures: true,
        ..Default::default()
    };
    let made = run::<Normals>(&given, &settings).unwrap();
    let n_scattered = made.floats("planarity").iter().filter(|&&p| p < 0.5).count();
    assert!(n_scattered > 1000, "{n_scattered} of no surface");
    let place = Vec3::new(0.0, 50.0, 0.0);
    let faces = |(normal, point): (&Vec3, &Vec3)| normal.dot(place - point) >= 0.0;
    assert!(made.vectors(NORMAL).iter().zip(&points).all(faces));
    given.normals = flat(&vec![Vec3::X; points.len()]);
    let keep = normals::Settings { orientation: Orientation::Keep, ..Default::default() };
    let made = run::<Normals>(&given, &keep).unwrap();
    assert!(made.vectors(NORMAL).iter().all(|normal| normal.x >= 0.0));
}
