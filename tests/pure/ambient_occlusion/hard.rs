//! Clouds that are hard: degenerate, damaged, tiny, huge and far away.

use crate::ambient_occlusion::stage::{METHODS, baked, disc, joined, part_of_sphere, rms};
use glam::{DVec3, Vec3};
use surfelshop_api::CloudView;
use surfelshop_api::columns::{ColumnView, NORMAL, POSITION, Values};
use surfelshop_runtime::boundary::Fault;
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::occlusion::{bake, blob, values};

/// Bakes columns that no cloud of the host's would have.
fn baked_raw(positions: &[f32], normals: &[f32], settings: &str) -> Result<Vec<f32>, Fault> {
    let column = |name, values| ColumnView {
        name,
        components: 3,
        generation: 1,
        values: Values::F32(values),
    };
    let cloud = CloudView {
        len: positions.len() / 3,
        columns: vec![column(POSITION, positions), column(NORMAL, normals)],
        ..CloudView::default()
    };
    Ok(bake(&cloud, &values(settings))?.ao)
}

#[test]
fn empty_cloud_and_single_points_are_open() {
    for method in METHODS {
        assert!(baked_raw(&[], &[], method).unwrap().is_empty());
        assert_eq!(baked_raw(&[1.0, 2.0, 3.0], &[0.0, 0.0, 1.0], method).unwrap(), [1.0]);
    }
}

#[test]
fn duplicates_count_once() {
    let discs = joined(&[disc(8, 1.0, 0.0), disc(8, 1.0, 0.5)]);
    let tenfold = joined(&vec![discs.clone(); 10]);
    let heap = joined(&[discs.clone(), {
        let mut heap = Surfels::default();
        (0..20_000).for_each(|_| heap.push(Vec3::Y * 0.5, Vec3::Y, 0.1));
        heap
    }]);
    for method in METHODS {
        let once = baked(&discs, method)[0];
        for (what, many) in [("tenfold", &tenfold), ("heap", &heap)] {
            let ao = baked(many, method)[0];
            // Eq. 9 adds the emitter's area to pi r^2, and that of a copy is a tenth: at this
            // distance and spacing 1.7 % of the shadow.
            assert!((ao - once).abs() < 0.02, "{method} {what}: {ao}, once {once}");
        }
    }
}

#[test]
fn lines_and_planes_of_points_are_no_trouble() {
    let mut line = Surfels::default();
    let mut upright = Surfels::default();
    for i in 0..3000 {
        line.push(Vec3::X * i as f32, Vec3::Y, 1.0);
        upright.push(Vec3::Y * i as f32, Vec3::Y, 1.0);
    }
    for method in METHODS {
        assert!(baked(&line, method).iter().all(|&ao| ao > 0.99), "{method}");
        // Above each other they hide each other, somewhat.
        baked(&upright, method);
    }
}

#[test]
fn radii_do_not_matter() {
    let mut discs = joined(&[disc(8, 1.0, 0.0), disc(8, 1.0, 0.5)]);
    let expected = baked(&discs, "");
    for radius in [0.0, -1.0, 1e30] {
        discs.radii.fill(radius);
        assert_eq!(baked(&discs, ""), expected);
    }
}

#[test]
fn what_has_no_direction_or_place_is_left_open_and_counted() {
    let discs = joined(&[disc(8, 1.0, 0.0), disc(8, 1.0, 0.5)]);
    let flat = |list: &[Vec3]| list.iter().flat_map(Vec3::to_array).collect::<Vec<_>>();
    let (mut positions, mut normals) = (flat(&discs.positions), flat(&discs.normals));
    let clean = baked_raw(&positions, &normals, "").unwrap();
    for (position, normal) in [(f32::NAN, 1.0), (f32::INFINITY, 1.0), (0.1, f32::NAN), (0.1, 0.0)] {
        positions.extend([position; 3]);
        normals.extend([normal; 3]);
    }
    for method in METHODS {
        let ao = baked_raw(&positions, &normals, method).unwrap();
        assert_eq!(ao[clean.len()..], [1.0; 4], "{method}");
        assert!(ao.iter().all(|ao| (0.0..=1.0).contains(ao)));
    }
    assert_eq!(baked_raw(&positions, &normals, "").unwrap()[..clean.len()], clean);
    let cloud = CloudView {
        len: positions.len() / 3,
        columns: vec![
            ColumnView {
                name: POSITION,
                components: 3,
                generation: 1,
                values: Values::F32(&positions),
            },
            ColumnView {
                name: NORMAL,
                components: 3,
                generation: 1,
                values: Values::F32(&normals),
            },
        ],
        ..CloudView::default()
    };
    let last = bake(&cloud, &values("")).unwrap().messages.pop().unwrap();
    assert!(last.contains("left open: 4 without a position or normal"), "{last}");
}

#[test]
fn missing_columns_are_named() {
    let nothing = CloudView::default();
    let Err(Fault::Error(line)) = bake(&nothing, &values("")) else { panic!("expected an error") };
    assert!(line.contains("`position`"), "{line}");
    let positions = [0.0; 3];
    let cloud = CloudView {
        len: 1,
        columns: vec![ColumnView {
            name: POSITION,
            components: 3,
            generation: 1,
            values: Values::F32(&positions),
        }],
        ..nothing
    };
    let Err(Fault::Error(line)) = bake(&cloud, &values("")) else { panic!("expected an error") };
    assert!(line.contains("`normal`") && line.contains("tool `normals`"), "{line}");
}

#[test]
fn normals_that_cancel_in_a_node_cast_as_all_pairs_do() {
    // A double-sided sheet: two layers of surfels back to back, 0.001 apart, above a plane.
    let (up, mut down) = (disc(40, 1.0, 0.5), disc(40, 1.0, 0.499));
    down.normals.iter_mut().for_each(|n| *n = -*n);
    let scene = joined(&[disc(40, 1.0, 0.0), up, down]);
    let pairs = baked(&scene, "method=brute-force");
    let tree = baked(&scene, "method=octree");
    assert!(rms(&pairs, &tree) < 0.002, "{}", rms(&pairs, &tree));
    // It hides four fifths of the sky from the middle below, seen as a closed body.
    let hybrid = baked(&scene, "method=hybrid");
    assert!((hybrid[0] - 0.2).abs() < 0.05, "{}", hybrid[0]);
}

#[test]
fn scale_and_place_do_not_matter() {
    let mesh = blob(3000);
    let base = Surfels {
        radii: vec![0.1; mesh.positions.len()],
        positions: mesh.positions.clone(),
        normals: mesh.normals.clone(),
        ..Surfels::default()
    };
    for method in ["method=hybrid", "method=octree", "method=brute-force"] {
        let expected = baked(&base, method);
        for scale in [1e-6f32, 1e-20, 1e6, 1e18] {
            let mut scaled = base.clone();
            scaled.positions.iter_mut().for_each(|p| *p *= scale);
            // Only the rounding of f32 positions differs.
            let error = rms(&baked(&scaled, method), &expected);
            assert!(error < 1e-3, "{method} at {scale:e}: {error}");
        }
        let far = Surfels { origin: DVec3::new(1e6, -2e6, 5e5), ..base.clone() };
        assert_eq!(baked(&far, method), expected);
        let mut offset = base.clone();
        // Without an origin, a million units away f32 keeps 1/16: on a body of 100 units that is
        // a noise of a thousandth.
        offset.positions.iter_mut().for_each(|p| *p = *p * 100.0 + Vec3::splat(1e6));
        let error = rms(&baked(&offset, method), &expected);
        assert!(error < 0.05, "{method} with an offset: {error}");
    }
}

#[test]
fn strays_do_not_change_what_is_near() {
    // Seen from inside, a closed sphere is dark.
    let sphere = part_of_sphere(3000, |_| true, false);
    for distance in [1e2f32, 1e4, 1e5, 1e8, 1e16, 1e25, 1e30] {
        let mut strays = sphere.clone();
        strays.push(Vec3::X * distance, Vec3::Y, 0.1);
        strays.push(Vec3::splat(-distance), Vec3::Y, 0.1);
        for method in ["method=hybrid", "method=rays rays=64"] {
            let ao = baked(&strays, method);
            // Unevenly placed discs leak a thousandth of the rays.
            let mean = ao[..3000].iter().sum::<f32>() / 3000.0;
            assert!(mean < 0.01, "{distance:e} {method}: {mean}");
            assert_eq!(ao[3000..], [1.0; 2], "{distance:e} {method}");
        }
    }
}

#[test]
fn heaps_of_copies_end_and_cast_one_shadow() {
    // Cameras write points they did not measure as (0, 0, 0), thousands of them.
    let mut scene = clouds::plane(100, 1.0);
    for i in 0..30_000 {
        let normal = if i % 3 == 0 { -Vec3::Y } else { Vec3::Y };
        scene.push(Vec3::ZERO, normal, 0.1);
    }
    let mut heap = Surfels::default();
    (0..30_000).for_each(|_| heap.push(Vec3::ONE, Vec3::Y, 0.1));
    for method in ["method=hybrid", "method=octree", "method=rays rays=16"] {
        assert!(baked(&scene, method)[..10_000].iter().all(|&ao| ao > 0.99), "{method}");
        assert!(baked(&heap, method).iter().all(|&ao| ao == 1.0), "{method}");
    }
}

#[test]
fn two_sides_at_the_same_places_keep_their_areas() {
    let (up, mut down) = (disc(30, 1.0, 0.5), disc(30, 1.0, 0.5));
    down.normals.iter_mut().for_each(|n| *n = -*n);
    let scene = joined(&[disc(30, 1.0, 0.0), up, down]);
    for method in ["method=brute-force", "method=octree", "method=rays rays=4096"] {
        let ao = baked(&scene, method)[0];
        // As for a disc opposite: a^2 / (a^2 + h^2) is 0.8.
        assert!((ao - 0.2).abs() < 0.02, "{method}: {ao}");
    }
}
