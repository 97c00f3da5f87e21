mod layers;

use super::*;
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::buffer::Buffer;
use crate::cloud::changes::changed_rows;
use crate::cloud::column::Column;
use crate::display::{Attribute, FilterTest};
use glam::{DQuat, DVec2, DVec3};
use surfelshop_api::{Camera, Projection, View};

/// A square of n x n surfels in the plane z = 0 and another one behind it at z = -1, at a scale and a place.
fn sheets(n: usize, scale: f32, origin: DVec3) -> Cloud {
    let mut position = Vec::new();
    for z in [0.0, -1.0] {
        for i in 0..n * n {
            let at = |k: usize| (k as f32 + 0.5) / n as f32 - 0.5;
            position.extend([at(i % n) * scale, at(i / n) * scale, z * scale]);
        }
    }
    let len = 2 * n * n;
    let class = (0..len).map(|i| (i % 3) as u8).collect();
    Cloud::new(
        origin,
        vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("normal", 3, Buffer::F32([0.0, 0.0, 1.0].repeat(len))),
            Column::new("radius", 1, Buffer::F32(vec![0.75 * scale / n as f32; len])),
            Column::new("class", 1, Buffer::U8(class)),
        ],
    )
    .unwrap()
}

fn cloud() -> Cloud {
    sheets(10, 1.0, DVec3::ZERO)
}

fn chosen(selection: &Selection) -> Vec<usize> {
    selection.indices().collect()
}

#[test]
fn selections_are_sets_of_bits() {
    for len in [0, 1, 63, 64, 65, 200] {
        let even = Selection::of(len, |i| i % 2 == 0).unwrap();
        let third = Selection::of(len, |i| i % 3 == 0).unwrap();
        let expect = |how: Combine, test: &dyn Fn(usize) -> bool| {
            let combined = even.combined(&third, how).unwrap();
            let expected: Vec<usize> = (0..len).filter(|&i| test(i)).collect();
            assert_eq!(chosen(&combined), expected, "{how:?} of {len}");
            assert_eq!(combined.count(), expected.len());
            assert_eq!(combined.mask().iter().filter(|chosen| **chosen).count(), expected.len());
        };
        expect(Combine::Replace, &|i| i % 3 == 0);
        expect(Combine::Add, &|i| i % 2 == 0 || i % 3 == 0);
        expect(Combine::Subtract, &|i| i % 2 == 0 && i % 3 != 0);
        expect(Combine::Intersect, &|i| i % 6 == 0);
        assert_eq!(even.inverted().count() + even.count(), len);
        assert_eq!(even.inverted().inverted(), even);
        assert!(!even.contains(len) && !even.inverted().contains(len));
    }
    let (a, b) = (Selection::none(3).unwrap(), Selection::none(4).unwrap());
    let line = a.combined(&b, Combine::Add).unwrap_err().to_string();
    assert_eq!(line, "selection: expected one of 3 surfels, found one of 4");
}

#[test]
fn regions_are_in_world_space_at_any_scale() {
    for (scale, origin) in
        [(1.0, DVec3::ZERO), (1e-6, DVec3::ZERO), (1.0, DVec3::new(1e6, -2e6, 50.0))]
    {
        let cloud = sheets(10, scale, origin);
        let size = f64::from(scale);
        let at = |x: f64, y: f64, z: f64| origin + DVec3::new(x, y, z) * size;
        let count = |region: Region| region.select(&cloud).unwrap().count();
        assert_eq!(count(Region::All), 200);
        assert_eq!(count(Region::Box([at(-1.0, -1.0, -0.5), at(0.0, 1.0, 0.5)])), 50);
        // Turned by half a right angle it is a diamond.
        let diamond = |degrees: f64| Region::TurnedBox {
            middle: at(0.0, 0.0, 0.0),
            half: DVec3::new(0.33, 0.33, 0.1) * size,
            turn: DQuat::from_rotation_z(degrees.to_radians()),
        };
        let turned = count(diamond(45.0));
        let straight = count(diamond(0.0));
        let in_diamond = |i: usize| {
            let place = cloud.world_position(i).unwrap() - origin;
            (place.x.abs() + place.y.abs()) <= 0.33 * size * std::f64::consts::SQRT_2
                && place.z.abs() <= 0.1 * size
        };
        assert_eq!(turned, (0..cloud.len()).filter(|&i| in_diamond(i)).count());
        assert!(turned != straight && straight > 0, "{turned} and {straight}");
        assert_eq!(count(Region::Sphere { center: at(0.0, 0.0, 0.0), radius: 0.1 * size }), 4);
        let plane = Region::Plane { point: at(0.0, 0.0, -0.5), normal: DVec3::NEG_Z };
        assert_eq!(count(plane), 100);
    }
    let values = |name: &str| Region::Values {
        attribute: Attribute::column(name),
        test: FilterTest::Values(vec![1]),
        up: Axis::PlusY,
    };
    assert_eq!(values("class").select(&cloud()).unwrap().count(), 67);
    let line = values("klass").select(&cloud()).unwrap_err().to_string();
    assert!(line.contains("no cloud has a column `klass`; there are `class`"), "{line}");
}

fn view() -> View {
    let camera = Camera {
        eye: DVec3::new(0.0, 0.0, 2.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 2.0 * 0.25f64.atan() },
    };
    View { camera, size_px: [100, 100], near: 0.1, far: 10.0 }
}

#[test]
fn what_is_seen_is_selected_or_all_that_lies_behind() {
    // At the front sheet the picture is one unit high.
    let left = ScreenShape::Rectangle([DVec2::new(50.0, 100.0), DVec2::ZERO]);
    let front = vec![2.0f32; 100 * 100];
    let select = |shape: &ScreenShape, depth: Option<&[f32]>| {
        let depth =
            depth.map(|depth| DepthPicture::new([100, 100], depth, (shape, [100, 100])).unwrap());
        let region = ScreenRegion { view: view(), shape: shape.clone(), depth };
        chosen(&region.select(&cloud()).unwrap())
    };
    let seen = select(&left, Some(&front));
    assert_eq!(seen, (0..100).filter(|i| i % 10 < 5).collect::<Vec<_>>());
    // The sheet behind is smaller in the picture, so that all of its left half is in it.
    assert_eq!(select(&left, None).len(), 100);
    // Where the front one is not drawn, the one behind is seen.
    let behind = vec![3.0f32; 100 * 100];
    assert_eq!(select(&left, Some(&behind)).len(), 100);
    let nothing = vec![0.0f32; 100 * 100];
    assert!(select(&left, Some(&nothing)).is_empty());
    // Depths that are missing count as nothing.
    assert!(select(&left, Some(&behind[..10])).is_empty());
    // A triangle with the right angle at the lower left corner.
    let half = [DVec2::new(0.0, 0.0), DVec2::new(0.0, 100.0), DVec2::new(100.0, 100.0)];
    let lasso = select(&ScreenShape::Lasso(half.to_vec()), None);
    assert!(lasso.contains(&0) && !lasso.contains(&99) && lasso.contains(&10));
    let circle = ScreenShape::Circle { center: DVec2::splat(50.0), radius: 8.0 };
    assert_eq!(select(&circle, Some(&front)), [44, 45, 54, 55]);
    // Lines without an inside, and what is behind the camera.
    assert!(select(&ScreenShape::Lasso(vec![DVec2::ZERO; 2]), None).is_empty());
    let mut away = view();
    away.camera.target = DVec3::new(0.0, 0.0, 4.0);
    let region = ScreenRegion { view: away, shape: left, depth: None };
    assert!(region.select(&cloud()).unwrap().is_empty());
}

#[test]
fn neighbours_are_found_alike_on_any_number_of_threads() {
    for scale in [1.0, 1e-6] {
        let cloud = sheets(10, scale, DVec3::ZERO);
        let size = f64::from(scale);
        let first = Selection::of(200, |i| i == 0).unwrap();
        let more = |distance: f64| grown(&cloud, &first, distance * size).unwrap();
        assert_eq!(chosen(&more(0.11)), [0, 1, 10]);
        assert_eq!(chosen(&more(0.15)), [0, 1, 10, 11]);
        let back = shrunk(&cloud, &more(0.15), 0.11 * size).unwrap();
        assert_eq!(chosen(&back), [0]);
        let sheet = component(&cloud, DVec3::new(0.4, 0.0, -0.9) * size, 0.11 * size).unwrap();
        assert_eq!(chosen(&sheet), (100..200).collect::<Vec<_>>());
        assert_eq!(component(&cloud, DVec3::ZERO, 0.09 * size).unwrap().count(), 1);
        assert_eq!(component(&cloud, DVec3::ZERO, 1.01 * size).unwrap().count(), 200);
        assert!((usual_distance(&cloud) / size - 0.15).abs() < 1e-6);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| more(0.15)), more(0.15));
    }
    for distance in [0.0, -1.0, f64::NAN] {
        assert!(grown(&cloud(), &Selection::none(200).unwrap(), distance).is_err());
    }
}

#[test]
fn what_is_selected_is_deleted_extracted_and_given_values() {
    let cloud = cloud();
    let ones = Region::Values {
        attribute: Attribute::column("class"),
        test: FilterTest::Values(vec![1]),
        up: Axis::PlusY,
    };
    let ones = ones.select(&cloud).unwrap();
    assert_eq!(deleted(&cloud, &ones).unwrap().len(), 133);
    assert_eq!(extracted(&cloud, &ones).unwrap().len(), 67);
    let classified = with_value(&cloud, &ones, "class", &[7.0]).unwrap();
    let Some(Buffer::U8(values)) = classified.column("class").map(Column::values) else { panic!() };
    assert!((0..200).all(|i| values[i] == if i % 3 == 1 { 7 } else { (i % 3) as u8 }));
    assert_eq!(
        changed_rows(
            cloud.column("class").unwrap().generation(),
            classified.column("class").unwrap().generation(),
        )
        .map(|rows| rows.len()),
        Some(67)
    );
    // New columns have the type that their name or their values ask for.
    let material = with_value(&cloud, &ones, "material", &[3.0]).unwrap();
    assert!(
        matches!(material.column("material").unwrap().values(), Buffer::U32(values) if values[1] == 3)
    );
    let color = with_value(&cloud, &ones, "color", &[255.0, 0.0, 9.0]).unwrap();
    assert!(
        matches!(color.column("color").unwrap().values(), Buffer::U8(v) if v[3..6] == [255, 0, 9])
    );
    let line = |result: Result<Cloud, SelectionError>| result.unwrap_err().to_string();
    assert_eq!(
        line(with_value(&cloud, &ones, "class", &[300.0])),
        "column `class`: expected a number of type u8, found 300"
    );
    assert_eq!(
        line(with_value(&cloud, &ones, "position", &[0.0])),
        "column `position`: expected 3 values, found 1"
    );
    let none = Selection::none(200).unwrap();
    assert_eq!(line(deleted(&cloud, &none)), "nothing is selected");
    assert!(line(deleted(&cloud, &none.inverted())).starts_with("all 200 surfels"));
}

#[test]
fn a_tint_changes_what_is_selected_and_nothing_else() {
    let cloud = cloud();
    let none = Selection::none(200).unwrap();
    let generations =
        |cloud: &Cloud| cloud.columns().iter().map(Column::generation).collect::<Vec<_>>();
    assert_eq!(generations(&tinted(&cloud, &none, None, Tint::Full).unwrap()), generations(&cloud));
    let some = Selection::of(200, |i| i == 5 || i == 150).unwrap();
    let with_colors = with_value(&cloud, &none.inverted(), "color", &[10.0, 20.0, 30.0]).unwrap();
    // Shown are the surfels of the second half alone.
    let rows: Vec<u32> = (100..200).collect();
    let shown = with_colors.keep(
        &none.inverted().mask().iter().enumerate().map(|(i, _)| i >= 100).collect::<Vec<_>>(),
    );
    let tint = tinted(&shown.unwrap(), &some, Some(&rows), Tint::Full).unwrap();
    let Some(Buffer::U8(values)) = tint.column("color").map(Column::values) else { panic!() };
    for (i, color) in values.chunks_exact(3).enumerate() {
        assert_eq!(color == [10, 20, 30], i != 50, "{i}: {color:?}");
    }
    let neutral = tinted(&cloud, &some, None, Tint::Full).unwrap();
    assert_eq!(neutral.column("color").unwrap().components(), 3);
}

#[test]
fn a_selection_follows_what_is_gone_and_added() {
    let some = Selection::of(5, |i| i == 1 || i == 4).unwrap();
    let left: Vec<usize> =
        some.followed(Some(&[true, false, true, true, true]), 2).unwrap().indices().collect();
    assert_eq!(left, [3, 4, 5], "what was added is selected, too");
    assert_eq!(some.followed(None, 0).unwrap(), some);
    assert!(some.followed(Some(&[true]), 0).is_err());
}
