//! Regions as they are kept, what of a ball they have, and edits that are done to parts.

use super::*;
use crate::cloud::edit::EditedCloud;
use crate::cloud::part::CloudPart;
use crate::cloud::provenance::ToolRun;
use crate::cloud::transform::{Rotation, Transform};
use glam::Vec3;
use proptest::prelude::*;
use serde_json::Map;
use std::sync::Arc;
use std::time::SystemTime;
use surfelshop_api::params::Values;
use surfelshop_api::{Dabs, Stroke, StrokeSample};

/// Some region in a cube of about [-2, 2].
fn region() -> impl Strategy<Value = Region> {
    let place = || [-2.0..2.0f64, -2.0..2.0, -2.0..2.0].prop_map(DVec3::from_array);
    let turn = place().prop_map(|axis| {
        DQuat::from_axis_angle((axis + DVec3::new(0.0, 0.0, 2.5)).normalize_or(DVec3::Z), axis.x)
    });
    let shape = prop_oneof![
        [0.0..100.0f64, 0.0..100.0, 0.0..100.0, 0.0..100.0].prop_map(|[a, b, c, d]| {
            ScreenShape::Rectangle([DVec2::new(a, b), DVec2::new(c, d)])
        }),
        proptest::collection::vec([0.0..100.0f64, 0.0..100.0], 3..8).prop_map(|line| {
            ScreenShape::Lasso(line.into_iter().map(DVec2::from_array).collect())
        }),
        ([0.0..100.0f64, 0.0..100.0], 1.0..40.0f64).prop_map(|(center, radius)| {
            ScreenShape::Circle { center: DVec2::from_array(center), radius }
        }),
    ];
    let seen = (shape, any::<bool>(), any::<bool>(), proptest::option::of(1.5f32..3.5)).prop_map(
        |(shape, central, coarse, depth)| {
            let mut view = view();
            if !central {
                view.camera.projection = Projection::Orthographic { height: 2.0 };
            }
            let depth = depth.map(|depth| {
                let ramp = |i: usize| depth + 0.004 * (i % 100) as f32;
                let mut depths: Vec<f32> = (0..100 * 100).map(ramp).collect();
                depths[..3000].fill(0.0);
                let depth = DepthPicture::new([100, 100], &depths, (&shape, [100, 100])).unwrap();
                if coarse { depth.coarse(9, 1.5) } else { depth }
            });
            Region::Seen(Box::new(ScreenRegion { view, shape, depth }))
        },
    );
    prop_oneof![
        Just(Region::All),
        (place(), place()).prop_map(|(a, b)| Region::Box([a.min(b), a.max(b)])),
        (place(), place(), turn).prop_map(|(middle, half, turn)| Region::TurnedBox {
            middle,
            half: half.abs(),
            turn
        }),
        (place(), 0.1..2.0f64).prop_map(|(center, radius)| Region::Sphere { center, radius }),
        (proptest::collection::vec(place(), 0..5), 0.1..1.0f64)
            .prop_map(|(centers, radius)| Region::Spheres { centers, radius }),
        (place(), place()).prop_map(|(point, normal)| Region::Plane { point, normal }),
        seen,
        (-2.0..2.0f64, 0.0..3.0f64).prop_map(|(low, size)| Region::Values {
            attribute: Attribute::Height,
            test: FilterTest::Range([low, low + size]),
            up: Axis::MinusZ,
        }),
        Just(Region::Values {
            attribute: Attribute::column("class"),
            test: FilterTest::Range([f64::NEG_INFINITY, 1.0]),
            up: Axis::PlusY,
        }),
    ]
}

fn step() -> impl Strategy<Value = RegionStep> {
    let how = prop_oneof![
        Just(Combine::Replace),
        Just(Combine::Add),
        Just(Combine::Subtract),
        Just(Combine::Intersect)
    ];
    prop_oneof![
        1 => Just(RegionStep::Invert),
        4 => (how, region()).prop_map(|(how, region)| RegionStep::Take { how, region }),
    ]
}

fn regions() -> impl Strategy<Value = RegionSelection> {
    let placed = (any::<bool>(), 0.5..2.0f64, -1.0..1.0f64).prop_map(|(is_moved, scale, by)| {
        let moved = Transform {
            translation: DVec3::splat(by),
            rotation: Rotation::Euler(DVec3::new(by, 0.5, -by)),
            scale,
        };
        if is_moved { moved } else { Transform::default() }
    });
    (placed, proptest::collection::vec(step(), 1..5))
        .prop_map(|(placed, steps)| RegionSelection { placed, steps })
}

/// Surfels in a ball.
fn in_ball(middle: DVec3, radius: f64) -> Cloud {
    let at = |i: usize| {
        let turned = DQuat::from_rotation_y(i as f64) * DQuat::from_rotation_x(2.1 * i as f64);
        let share = (i % 7) as f64 / 6.0;
        (turned * DVec3::Z * radius * share * (1.0 - 1e-6)).as_vec3().to_array()
    };
    let position: Vec<f32> = (0..60).flat_map(at).collect();
    Cloud::new(
        middle,
        vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("class", 1, Buffer::U8((0..60).map(|i| i % 4).collect())),
        ],
    )
    .unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Cost: half a second.
    #[test]
    fn what_is_said_of_a_ball_is_true_of_all_that_is_in_it(
        regions in regions(),
        place in [-2.5..2.5f64, -2.5..2.5, -2.5..2.5],
        radius in 0.01..1.5f64,
    ) {
        let middle = DVec3::from_array(place);
        let cloud = in_ball(middle, radius);
        let found = regions.select(&cloud).unwrap().count();
        match regions.reach(middle, radius) {
            Reach::Nothing => prop_assert_eq!(found, 0),
            Reach::All => prop_assert_eq!(found, cloud.len()),
            Reach::Some => {}
        }
    }

    #[test]
    fn regions_are_read_as_they_were_written(regions in regions()) {
        let text = serde_json::to_string(&regions).unwrap();
        prop_assert_eq!(serde_json::from_str::<RegionSelection>(&text).unwrap(), regions);
    }

    #[test]
    fn a_placed_selection_is_that_of_the_placed_cloud(regions in regions()) {
        let cloud = in_ball(DVec3::ZERO, 1.5);
        let placed = cloud.transformed(&regions.placed).unwrap();
        let own = regions.select(&cloud).unwrap();
        let world = regions.select_in_world(&placed).unwrap();
        let only = |a: &Selection, b| a.combined(b, Combine::Subtract).unwrap().count();
        // Rounding of placed positions tells a border differently, and of 60 surfels few lie that close to one.
        prop_assert!(only(&own, &world) + only(&world, &own) <= 2);
        if regions.placed == Transform::default() {
            prop_assert_eq!(regions.select(&cloud).unwrap(), regions.select_in_world(&cloud).unwrap());
        }
    }
}

#[test]
fn balls_are_told_apart() {
    // Of what a property allows, nothing would be told; these are.
    let ball = (DVec3::ZERO, 0.5);
    let height = |low: f64, high: f64| Region::Values {
        attribute: Attribute::Height,
        test: FilterTest::Range([low, high]),
        up: Axis::PlusX,
    };
    let cases = [
        (Region::Box([DVec3::splat(-1.0), DVec3::splat(1.0)]), Reach::All),
        (Region::Box([DVec3::splat(0.6), DVec3::splat(1.0)]), Reach::Nothing),
        (Region::Sphere { center: DVec3::X, radius: 0.4 }, Reach::Nothing),
        (Region::Sphere { center: DVec3::X, radius: 0.6 }, Reach::Some),
        (Region::Spheres { centers: vec![DVec3::ONE, DVec3::ZERO], radius: 0.6 }, Reach::All),
        (Region::Plane { point: DVec3::X, normal: DVec3::X }, Reach::Nothing),
        (Region::Plane { point: DVec3::X, normal: DVec3::NEG_X }, Reach::All),
        (Region::All, Reach::All),
        (height(0.6, f64::INFINITY), Reach::Nothing),
        (height(0.4, f64::INFINITY), Reach::Some),
        (height(-0.6, 0.6), Reach::All),
    ];
    let mut all = RegionSelection::default();
    for (region, expected) in cases {
        assert_eq!(region.reach(ball.0, ball.1), expected, "{region:?}");
        all = all.with(RegionStep::Take { how: Combine::Replace, region });
    }
    assert_eq!((all.steps.len(), all.reach(ball.0, ball.1)), (1, Reach::All));
    assert_eq!(all.with(RegionStep::Invert).reach(ball.0, ball.1), Reach::Nothing);
    let seen = |at: [f64; 2], depth: f32| {
        let shape = ScreenShape::Circle { center: DVec2::from_array(at), radius: 5.0 };
        let depths = vec![depth; 100 * 100];
        let depth = DepthPicture::new([100, 100], &depths, (&shape, [100, 100])).unwrap();
        Region::Seen(Box::new(ScreenRegion { view: view(), shape, depth: Some(depth) }))
    };
    assert_eq!(seen([50.0, 50.0], 2.0).reach(DVec3::ZERO, 0.1), Reach::Some);
    assert_eq!(seen([5.0, 50.0], 2.0).reach(DVec3::ZERO, 0.1), Reach::Nothing);
    assert_eq!(seen([50.0, 50.0], 1.0).reach(DVec3::ZERO, 0.1), Reach::Nothing);
}

#[test]
fn cells_of_a_picture_keep_what_is_farthest() {
    let shape = ScreenShape::Rectangle([DVec2::new(20.0, 30.0), DVec2::new(79.0, 60.0)]);
    let depths: Vec<f32> = (0..100 * 100).map(|i| 1.0 + (i % 100) as f32 / 100.0).collect();
    let fine = DepthPicture::new([100, 100], &depths, (&shape, [100, 100])).unwrap();
    let coarse = fine.clone().coarse(8, 0.0);
    for y in 30..60 {
        for x in 20..79 {
            let share = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / 100.0;
            for depth in [1.0, 1.3, 1.7, 2.0] {
                let both = [&fine, &coarse].map(|picture| picture.shows(share, depth, 0.0));
                assert!(both[1] || !both[0], "{x}, {y}, {depth}");
            }
            assert!(!coarse.shows(share, depths[x as usize].into(), -0.3));
        }
    }
    // Beyond what is kept nothing is seen, and numbers of hostile files do no harm.
    assert!(!fine.shows(DVec2::new(0.05, 0.5), 0.5, 0.0));
    assert!(!fine.shows(DVec2::splat(1e300), 0.5, 0.0));
    let text = serde_json::to_string(&fine).unwrap();
    for (from, to) in [
        ("\"size\":[64,35]", "\"size\":[4294967295,4294967295]"),
        ("\"size\":[64,35]", "\"size\":[64,34]"),
        ("\"corner\":[18,28]", "\"corner\":[-9223372036854775808,28]"),
        ("\"depths\":\"", "\"depths\":\"!"),
    ] {
        assert!(text.contains(from), "{}", &text[..200.min(text.len())]);
        assert!(serde_json::from_str::<DepthPicture>(&text.replace(from, to)).is_err(), "{to}");
    }
}

/// Invariant: of a slanted surface all that is seen is selected, however much farther away it is within a pixel
#[test]
fn a_slanted_surface_is_selected_whole_and_nothing_behind_it() {
    // The ground, 1 below the eye, seen at 6 degrees, and another one below it.
    let mut view = view();
    view.camera.eye = DVec3::new(0.0, 1.0, 10.0);
    view.camera.target = DVec3::ZERO;
    let place = |i: usize, below: f64| {
        let [x, z] = [i % 60, i / 60].map(|k| (k as f64 + 0.37) / 60.0 - 0.5);
        DVec3::new(x, -below, 4.0 * z).as_vec3().to_array()
    };
    let places = (0..3600).map(|i| place(i, 0.0)).chain((0..3600).map(|i| place(i, 0.6)));
    let n = 7200;
    let cloud = Cloud::new(
        DVec3::ZERO,
        vec![
            Column::new("position", 3, Buffer::F32(places.flatten().collect())),
            Column::new("radius", 1, Buffer::F32(vec![1e-4; n])),
        ],
    )
    .unwrap();
    // The distances of the ground, in the middle of pixels that are seen up to half a pixel beside.
    let [half_x, half_y] = view.half_extent();
    let matrix = view.view_from_offset(DVec3::ZERO).inverse();
    for beside in [0.0, -0.5, 0.5] {
        let depth = |i: u32| {
            let [x, y] = [i % 100, i / 100].map(|k| (f64::from(k) + 0.5 + beside) / 50.0 - 1.0);
            let ray = matrix.transform_vector3(DVec3::new(x * half_x, -y * half_y, -1.0));
            let along = -view.camera.eye.y / ray.y;
            let at = view.camera.eye + along * ray;
            let is_ground = along > 0.0 && at.x.abs() < 0.55 && at.z.abs() < 2.2;
            if is_ground { along as f32 } else { 0.0 }
        };
        let depths: Vec<f32> = (0..100 * 100).map(depth).collect();
        let shape = ScreenShape::Rectangle([DVec2::ZERO, DVec2::splat(100.0)]);
        let fine = DepthPicture::new([100, 100], &depths, (&shape, [100, 100])).unwrap();
        for picture in [fine.clone(), fine.coarse(40, 0.0)] {
            let region = ScreenRegion { view, shape: shape.clone(), depth: Some(picture) };
            let found = chosen(&region.select(&cloud).unwrap());
            let seen = found.iter().filter(|i| **i < 3600).count();
            assert!(seen == 3600, "{seen} of 3600");
            assert!(found.len() - seen < 60, "{} below the ground", found.len() - seen);
        }
    }
}

/// A layer of three edits in the plane of the sheets.
fn layer() -> EditLayer {
    let take = |region: Region| RegionSelection {
        steps: vec![RegionStep::Take { how: Combine::Add, region }],
        ..RegionSelection::default()
    };
    let left = Region::Plane { point: DVec3::ZERO, normal: DVec3::NEG_X };
    let ball = Region::Sphere { center: DVec3::new(0.3, 0.3, 0.0), radius: 0.2 };
    let back = Region::Plane { point: DVec3::new(0.0, 0.0, -0.5), normal: DVec3::NEG_Z };
    // What is hidden is not deleted.
    let set = LayerChange::Set { column: "material".to_owned(), values: vec![3.0] };
    EditLayer::default()
        .with(take(back), LayerChange::Hide)
        .with(take(left), LayerChange::Delete)
        .with(take(ball), set)
}

#[test]
fn edits_of_parts_are_those_of_the_whole() {
    let (cloud, layer) = (cloud(), layer());
    let left_out =
        |layer: &EditLayer, ball| layer.applied(cloud.clone(), ball, HiddenOnes::LeftOut).unwrap();
    let edited = left_out(&layer, None);
    assert_eq!(edited.len(), 50);
    let Some(Buffer::U32(material)) = edited.column("material").map(Column::values) else {
        panic!()
    };
    let expected = (0..50).map(|i| {
        let place = edited.world_position(i).unwrap();
        u32::from(place.distance(DVec3::new(0.3, 0.3, 0.0)) <= 0.2) * 3
    });
    assert!(material.iter().copied().eq(expected) && material.contains(&3));
    // Part by part, with a ball around each.
    let mut parts = 0;
    for row in 0..20 {
        let mask: Vec<bool> = (0..200).map(|i| i / 10 == row).collect();
        let part = cloud.keep(&mask).unwrap();
        let middle = DVec3::new(0.0, part.positions()[0].y.into(), part.positions()[0].z.into());
        let ball = (middle, 0.46);
        for hidden in [HiddenOnes::LeftOut, HiddenOnes::Stay] {
            let alone = layer.applied(part.clone(), None, hidden).unwrap();
            let told = layer.applied(part.clone(), Some(ball), hidden).unwrap();
            assert_eq!(told.len(), alone.len());
            assert!(told.column("material").is_some());
            let is_gone = row >= 10 && hidden == HiddenOnes::LeftOut;
            assert_eq!(layer.removes(ball, hidden), is_gone, "{row}");
            parts += if hidden == HiddenOnes::LeftOut { told.len() } else { 0 };
        }
    }
    assert_eq!(parts, 50);
    // Hidden ones were not deleted, and are there when they are shown.
    assert_eq!(layer.applied(cloud.clone(), None, HiddenOnes::Stay).unwrap().len(), 150);
    let shown = layer.showing_all();
    assert_eq!((left_out(&shown, None).len(), shown.len()), (150, 4));
    assert!(layer.hides() && !shown.hides() && shown.showing_all().len() == 4);
    assert!(!shown.removes((DVec3::new(0.0, 0.0, -1.0), 0.1), HiddenOnes::LeftOut));
    // What nothing reaches has version 0, and other edits make other versions.
    let has = |name: &str| name == "material";
    let far = (DVec3::new(9.0, 9.0, 9.0), 0.1);
    assert_eq!((layer.version(far, has), shown.version(far, has)), (0, 0));
    assert_ne!(layer.version(far, |_| false), 0, "a column is made there, too");
    let near = |layer: &EditLayer| layer.version((DVec3::new(0.3, 0.3, 0.0), 0.1), has);
    let all = RegionSelection { steps: vec![RegionStep::Invert], ..RegionSelection::default() };
    let more = layer.with(all, LayerChange::Hide);
    assert!(near(&layer) != 0 && near(&layer) == near(&layer.clone()));
    assert_ne!(near(&layer), near(&more));
    assert!(more.removes(far, HiddenOnes::LeftOut) && !more.removes(far, HiddenOnes::Stay));
}

#[test]
fn values_that_do_not_fit_are_refused_before_they_are_set() {
    let line = |column: &str, values: &[f64]| {
        let set = LayerChange::Set { column: column.to_owned(), values: values.to_vec() };
        let layer = layer().with(RegionSelection::default(), set);
        layer.check(&cloud()).map_err(|error| error.to_string())
    };
    assert_eq!(line("class", &[3.0]), Ok(()));
    assert_eq!(line("label", &[3.0]), Ok(()));
    let expected = "column `class`: expected a number of type u8, found 300";
    assert_eq!(line("class", &[300.0]).unwrap_err(), expected);
    assert_eq!(
        line("material", &[1e300]).unwrap_err().split(':').next(),
        Some("column `material`")
    );
    assert!(line("class", &[f64::NAN]).unwrap_err().contains("expected a number, found NaN"));
    assert!(
        line("radius", &[1.0])
            .unwrap_err()
            .contains("where surfels are or how large, found `radius`")
    );
    assert!(line("class", &[1.0, 2.0]).unwrap_err().contains("expected 1 value, found 2"));
}

#[test]
fn layers_are_read_as_they_were_written() {
    let text = serde_json::to_string(&layer()).unwrap();
    let again: EditLayer = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&again).unwrap(), text);
    assert_eq!(again.len(), 3);
    // They are other edits all the same, as of another file.
    assert_ne!(again, layer());
    assert_eq!(again, again.clone());
}

/// Gives surfels the material 7, or takes them away.
#[derive(Debug)]
struct Painter {
    removes: bool,
}

impl StrokeTools for Painter {
    fn check(&self, led: &NamedStroke) -> Result<(), String> {
        if led.tool == "painter" { Ok(()) } else { Err("it is not there".to_owned()) }
    }

    fn lead(&self, _: &NamedStroke, part: CloudPart) -> Result<Option<EditedCloud>, String> {
        let n = part.rows.len();
        let material = Column::new("material", 1, Buffer::U32(vec![7; n]));
        let made = ToolRun::new("painter".into(), "1".into(), &Values::new(), SystemTime::now());
        let edited = EditedCloud {
            cloud: part.cloud.with_columns(vec![material]).unwrap(),
            columns: vec!["material".to_owned()],
            whole: None,
            kept: None,
            n_added: 0,
        };
        let none = part.cloud.keep(&vec![false; n]).unwrap();
        let removed = EditedCloud {
            cloud: none,
            columns: Vec::new(),
            kept: Some(vec![false; n]),
            ..edited.clone()
        };
        let edited = if self.removes { removed } else { edited };
        part.put_back(&edited, made).map(Some).map_err(|error| error.to_string())
    }
}

/// Invariant: a tool that is led over a part of a cloud does there what it does to the whole
#[test]
fn strokes_over_parts_are_those_over_the_whole() {
    let place = |x| StrokeSample {
        place: DVec3::new(x, 2.1, 1.0),
        normal: Vec3::ZERO,
        time: 0.0,
        pressure: 1.0,
    };
    let dabs = Dabs { reach: surfelshop_api::Reach::Volume, ..Dabs::USUAL };
    let stroke = Stroke { radius: 0.15, dabs, samples: vec![place(-0.2), place(0.4)] };
    let led = |tool: &str| {
        let (tool, values) = (tool.to_owned(), Map::new());
        let led =
            NamedStroke { tool, values, stroke: stroke.clone(), n_surfels: None, among: None };
        LayerChange::Stroke(led)
    };
    // The cloud is moved up by two, and one to the front; of its surfels those on the right are selected.
    let translation = DVec3::new(0.0, 2.0, 1.0);
    let right = Region::Plane { point: DVec3::ZERO, normal: DVec3::X };
    let select = RegionSelection {
        placed: Transform { translation, ..Transform::default() },
        steps: vec![RegionStep::Take { how: Combine::Add, region: right }],
    };
    let set = LayerChange::Set { column: "material".to_owned(), values: vec![0.0] };
    let base = EditLayer::default().with(RegionSelection::default(), set);
    for removes in [false, true] {
        let layer =
            base.with(select.clone(), led("painter")).with_tools(Arc::new(Painter { removes }));
        assert!(layer.check(&cloud()).is_ok());
        let whole = layer.applied(cloud(), None, HiddenOnes::LeftOut).unwrap();
        let painted = |cloud: &Cloud| {
            let Some(Buffer::U32(all)) = cloud.column("material").map(Column::values) else {
                panic!()
            };
            all.iter().filter(|&&material| material == 7).count()
        };
        let n_gone = 200 - whole.len();
        assert_eq!((painted(&whole) > 0, n_gone > 0), (!removes, removes));
        let (mut in_parts, mut gone_of_parts, mut n_idle) = (0, 0, 0);
        for row in 0..20 {
            let mask: Vec<bool> = (0..200).map(|i| i / 10 == row).collect();
            let part = cloud().keep(&mask).unwrap();
            let at = part.positions()[0];
            let ball = (DVec3::new(0.0, at.y.into(), at.z.into()), 0.46);
            n_idle += usize::from(layer.version(ball, |_| true) == base.version(ball, |_| true));
            let told = layer.applied(part, Some(ball), HiddenOnes::LeftOut).unwrap();
            in_parts += painted(&told);
            gone_of_parts += 10 - told.len();
        }
        assert_eq!((in_parts, gone_of_parts), (painted(&whole), n_gone));
        assert!((5..20).contains(&n_idle), "{n_idle} parts are far from it");
    }
    // A tool that is not there, nobody to run it, and a column that the cloud lacks.
    let tools = || Arc::new(Painter { removes: false });
    let line = |layer: EditLayer| layer.check(&cloud()).unwrap_err().to_string();
    let other = base.with(select.clone(), led("other"));
    assert_eq!(line(other.with_tools(tools())), "tool `other`: it is not there");
    let alone = base.with(select.clone(), led("painter"));
    assert_eq!(line(alone), "tool `painter`: no tools are run here");
    let lacking = EditLayer::default().with(select, led("painter")).with_tools(tools());
    let bare = cloud().without_column("material");
    let failed = lacking.applied(bare, None, HiddenOnes::LeftOut).unwrap_err().to_string();
    assert!(failed.contains("it makes the column `material`, which the pyramid lacks"), "{failed}");
}
