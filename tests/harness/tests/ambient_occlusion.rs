//! Ambient occlusion against known answers, and on clouds that are hard.

use glam::{DVec3, Vec3};
use surfelshop_ambient_occlusion::SurfelshopPackage;
use surfelshop_api::HostInfo;
use surfelshop_api::abi::host_side::{Fault, Plugin};
use surfelshop_api::columns::{ColumnView, NORMAL, POSITION, Values};
use surfelshop_tests::clouds::{self, Surfels};
use surfelshop_tests::occlusion::{Desk, Mesh, bake, blob, room, sheet, truth, values};

/// Every method at its defaults.
const METHODS: [&str; 4] = ["method=hybrid", "method=rays", "method=octree", "method=brute-force"];

/// Accessibility with these settings.
fn baked(surfels: &Surfels, settings: &str) -> Vec<f32> {
    let baked = bake(&surfels.cloud().view(), &values(settings));
    let ao = baked.expect("the settings are good").ao;
    assert_eq!(ao.len(), surfels.positions.len());
    assert!(ao.iter().all(|ao| (0.0..=1.0).contains(ao)), "{settings}: {ao:?}");
    ao
}

/// Root mean square of a difference.
fn rms(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len().max(1) as f64).sqrt()
}

/// Surfels of a sphere that a test keeps, seen from inside or outside.
fn part_of_sphere(n: usize, keep: impl Fn(Vec3) -> bool, outward: bool) -> Surfels {
    let mut part = Surfels::default();
    for position in clouds::sphere(n, 1.0).positions.into_iter().filter(|&p| keep(p)) {
        part.push(position, if outward { position } else { -position }, 0.01);
    }
    part
}

/// A disc of surfels at a height that faces up.
fn disc(rings: u32, radius: f32, height: f32) -> Surfels {
    let mut disc = Surfels::default();
    let step = radius / (rings as f32 + 0.5);
    disc.push(Vec3::Y * height, Vec3::Y, step);
    for ring in 1..=rings {
        // Rings of equal width whose surfels have equal areas.
        for i in 0..6 * ring {
            let angle = std::f32::consts::TAU * i as f32 / (6 * ring) as f32;
            let at = Vec3::new(angle.cos(), 0.0, angle.sin()) * (ring as f32 * step);
            disc.push(at + Vec3::Y * height, Vec3::Y, step);
        }
    }
    disc
}

fn joined(parts: &[Surfels]) -> Surfels {
    let mut all = Surfels::default();
    for part in parts {
        all.positions.extend(&part.positions);
        all.normals.extend(&part.normals);
        all.radii.extend(&part.radii);
    }
    all
}

#[test]
fn convex_body_is_open_everywhere() {
    let sphere = clouds::sphere(5000, 1.0);
    for method in METHODS {
        let least = baked(&sphere, method).into_iter().fold(1.0, f32::min);
        // Nothing is above any horizon, and rays start above the neighbours' planes.
        assert!(least > 0.999, "{method}: {least}");
    }
}

#[test]
fn every_surfel_of_a_bowl_sees_the_share_of_the_sphere_that_the_bowl_is() {
    // Inside a sphere every pair has the form factor A / (4 pi R^2), wherever the two are; so half
    // a sphere covers half of the sky of each of its surfels.
    let bowl = part_of_sphere(20_000, |p| p.y < 0.0, false);
    for method in ["brute-force", "octree"] {
        let ao =
            baked(&bowl, &format!("method={method} passes=1 cast-from=front tolerance=0.0002"));
        let worst = ao.iter().map(|ao| (ao - 0.5).abs()).fold(0.0, f32::max);
        // The area that eq. 9 adds to pi r^2 takes the near ones' share away: for n surfels
        // about (1 + ln n) / n of the whole; cells at the rim reach half a step, 1 % of the area,
        // beyond it.
        assert!(worst < 0.01, "{method}: {worst}");
    }
    let ao = baked(&bowl, "method=rays rays=1024");
    let mean = ao.iter().sum::<f32>() / ao.len() as f32;
    // Discs overlap the rim by their own radius, again 1 %; the noise of the mean is far less.
    assert!((mean - 0.5).abs() < 0.02, "{mean}");
}

#[test]
fn closed_sphere_from_inside_sees_nothing() {
    let sphere = part_of_sphere(20_000, |_| true, false);
    let ao = baked(&sphere, "method=brute-force passes=1 cast-from=front");
    assert!(ao.iter().all(|&ao| ao < 0.002), "the sum of A / (4 pi R^2) is 1");
}

#[test]
fn disc_opposite_covers_what_theory_says() {
    // From the middle of a disc, another of radius a at height h covers a^2 / (a^2 + h^2).
    for (radius, height) in [(1.0f32, 0.5f32), (1.0, 1.0), (0.5, 1.0)] {
        let expected = 1.0 - radius.powi(2) / (radius.powi(2) + height.powi(2));
        let discs = joined(&[disc(30, 1.0, 0.0), disc(30, radius, height)]);
        for settings in [
            "method=brute-force passes=1",
            "method=octree passes=1",
            "method=rays rays=4096",
            "method=hybrid rays=4096",
        ] {
            let ao = baked(&discs, settings)[0];
            // The upper disc's edge lies half a step, 1.6 % of its radius, beyond its last ring and
            // the discs of rays one radius; that is at most 1.6 % of the sky.
            assert!((ao - expected).abs() < 0.02, "{settings}: {ao}, expected {expected}");
        }
    }
}

#[test]
fn dome_over_a_plane_covers_what_theory_says() {
    // A cap that spans an angle t about the zenith covers sin^2 t of the sky below its middle.
    for degrees in [20.0f32, 45.0, 70.0] {
        let t = degrees.to_radians();
        let cap = part_of_sphere(30_000, |p| p.y > t.cos(), true);
        let scene = joined(&[disc(10, 0.2, 0.0), cap]);
        for settings in [
            "method=brute-force passes=1",
            "method=octree passes=1 tolerance=0.0002",
            "method=rays rays=4096",
        ] {
            let ao = baked(&scene, settings)[0];
            let expected = 1.0 - t.sin().powi(2);
            // The rim is half a step, 0.01 radians, uncertain: sin(2 t) times that; rays add as much
            // for the discs' own radius.
            assert!((ao - expected).abs() < 0.02, "{degrees} {settings}: {ao}, not {expected}");
        }
    }
}

#[test]
fn dome_down_to_the_ground_leaves_nothing_open() {
    let dome = part_of_sphere(30_000, |p| p.y > -0.02, true);
    let scene = joined(&[disc(10, 0.2, 0.0), dome]);
    for method in METHODS {
        let ao = baked(&scene, &format!("{method} passes=1"))[0];
        assert!(ao < 0.02, "{method}: {ao}");
    }
}

#[test]
fn closed_room_is_dark_where_rays_are_traced() {
    let mesh = room(20_000);
    for method in ["method=hybrid", "method=rays"] {
        let ao = bake(&mesh.cloud().view(), &values(method)).unwrap().ao;
        // Regular walls leak only where four discs meet.
        assert!(rms(&ao, &vec![0.0; ao.len()]) < 0.02, "{method}");
    }
}

#[test]
fn lone_plane_is_open() {
    let mut plane = clouds::plane(40, 1.0);
    for method in METHODS {
        assert!(baked(&plane, method).iter().all(|&ao| ao == 1.0), "{method}");
    }
    // Tilted, the neighbours' heights are rounding errors.
    let turn = glam::Quat::from_axis_angle(Vec3::new(0.48, 0.6, 0.64), 1.0);
    plane.positions.iter_mut().for_each(|p| *p = turn * *p);
    plane.normals.iter_mut().for_each(|n| *n = turn * *n);
    for method in METHODS {
        assert!(baked(&plane, method).iter().all(|&ao| ao > 0.9999), "{method}");
    }
}

#[test]
fn octree_agrees_with_all_pairs() {
    let surfels = blob(20_000);
    let cloud = surfels.cloud();
    let ao = |settings: &str| bake(&cloud.view(), &values(settings)).unwrap().ao;
    let pairs = ao("method=brute-force");
    let mut last = f64::INFINITY;
    for (tolerance, bound) in [(0.1, 0.02), (0.008, 0.004), (0.001, 0.002), (0.0, 1e-5)] {
        let error = rms(&ao(&format!("method=octree tolerance={tolerance:?}")), &pairs);
        // At the default 0.001 on a scan (Igea), three times that on this smooth body; with no
        // tolerance only the order of sums differs.
        assert!(error < bound && error < last, "{tolerance}: {error}");
        last = error;
    }
}

#[test]
fn default_is_near_the_truth_on_a_closed_body_and_an_open_sheet() {
    for (mesh, bound) in [(blob(20_000), 0.012), (sheet(10_000), 0.02)] {
        let truth = truth(&mesh, 256, 1.0);
        let ao = bake(&mesh.cloud().view(), &values("")).unwrap().ao;
        let mut errors: Vec<f32> = ao.iter().zip(&truth.ao).map(|(a, b)| (a - b).abs()).collect();
        errors.sort_by(f32::total_cmp);
        errors.truncate(errors.len() * 99 / 100);
        let trimmed = rms(&errors, &vec![0.0; errors.len()]);
        assert!(trimmed < bound, "{trimmed}, truth's own noise {}", truth.noise);
    }
}

#[test]
fn second_pass_takes_double_shadows_away() {
    // The lower of two discs above hides the upper one nearly, so both cover little more than one.
    let discs = joined(&[disc(20, 1.0, 0.0), disc(20, 1.0, 0.5), disc(20, 1.0, 0.6)]);
    let ao = |settings: &str| baked(&discs, settings)[0];
    let traced = ao("method=rays rays=4096");
    for method in ["octree", "brute-force"] {
        let [one, two] = [1, 2].map(|passes| ao(&format!("method={method} passes={passes}")));
        // One pass adds 0.8 and 0.74; the second counts a tenth of the lower one.
        assert!(one == 0.0 && (two - traced).abs() < 0.08, "{one}, {two}, traced {traced}");
    }
}

#[test]
fn what_is_farther_than_asked_casts_no_shadow() {
    let discs = joined(&[disc(20, 1.0, 0.0), disc(20, 1.0, 0.5)]);
    for method in METHODS {
        let near = baked(&discs, &format!("{method} max-distance=0.4"));
        assert!(near.iter().all(|&ao| ao > 0.999), "{method}");
        // What lies within 1.0 is a disc of radius sqrt(0.75) at height 0.5: 3/4 of the sky.
        let some = baked(&discs, &format!("{method} passes=1 rays=4096 max-distance=1.0"))[0];
        assert!((some - 0.25).abs() < 0.04, "{method}: {some}");
    }
    let pairs = baked(&discs, "method=brute-force max-distance=0.8");
    let tree = baked(&discs, "method=octree max-distance=0.8");
    assert!(rms(&pairs, &tree) < 0.003);
}

#[test]
fn cone_leaves_out_what_is_low() {
    let bowl = part_of_sphere(5000, |p| p.y < 0.0, false);
    for method in METHODS {
        let with = |cone: bool| {
            let settings = format!("{method} passes=1 rays=1024 cast-from=front cone={cone}");
            let ao = baked(&bowl, &settings);
            ao.iter().sum::<f32>() / ao.len() as f32
        };
        let share = with(true) - with(false);
        // cos^2 75 degrees, 0.067, is the share of the sky outside of the cone (erratum T23); the
        // bowl fills half of that ring, and more of it low down.
        assert!((0.03..0.067).contains(&share), "{method}: {share}");
    }
}

#[test]
fn seed_and_number_of_threads_decide_alone() {
    let mesh = sheet(4000);
    let cloud = mesh.cloud();
    let with = |threads: usize, settings: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake(&cloud.view(), &values(settings)).unwrap().ao)
    };
    for method in METHODS {
        let bits = |ao: Vec<f32>| ao.into_iter().map(f32::to_bits).collect::<Vec<_>>();
        let one = bits(with(1, method));
        assert_eq!(one, bits(with(2, method)), "{method}");
        let other = bits(with(2, &format!("{method} seed=7")));
        let is_random = matches!(method, "method=rays" | "method=hybrid");
        assert_eq!(one != other, is_random, "{method}");
    }
}

#[test]
fn cancelled_bake_stops_at_once_and_stages_nothing() {
    let mesh = sheet(10_000);
    let cloud = mesh.cloud();
    for method in METHODS {
        let all = Desk::default();
        let run = |desk: &Desk| {
            let mut tool =
                Plugin::of::<SurfelshopPackage>().create(0, &HostInfo::default()).unwrap();
            tool.run(&values(method), &cloud.view(), desk)
        };
        run(&all).unwrap();
        let n_ranges = all.ranges.into_inner();
        let desk = Desk { cancel_after: n_ranges / 2, ..Desk::default() };
        assert_eq!(run(&desk), Err(Fault::Error("cancelled".to_owned())), "{method}");
        assert!(desk.staged.into_inner().unwrap().is_empty());
        // Each thread may have one range in its hands, and asks once more for the next.
        let allowed = n_ranges / 2 + 2 * rayon::current_num_threads();
        assert!(desk.ranges.into_inner() <= allowed, "{method}");
    }
}

/// Bakes columns that no cloud of the host's would have.
fn baked_raw(positions: &[f32], normals: &[f32], settings: &str) -> Result<Vec<f32>, Fault> {
    let column = |name, values| ColumnView {
        name,
        components: 3,
        generation: 1,
        values: Values::F32(values),
    };
    let cloud = surfelshop_api::CloudView {
        len: positions.len() / 3,
        columns: vec![column(POSITION, positions), column(NORMAL, normals)],
        ..surfelshop_api::CloudView::default()
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
    let cloud = surfelshop_api::CloudView {
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
        ..surfelshop_api::CloudView::default()
    };
    let last = bake(&cloud, &values("")).unwrap().messages.pop().unwrap();
    assert!(last.contains("left open: 4 without a position or normal"), "{last}");
}

#[test]
fn missing_columns_are_named() {
    let nothing = surfelshop_api::CloudView::default();
    let Err(Fault::Error(line)) = bake(&nothing, &values("")) else { panic!("expected an error") };
    assert!(line.contains("`position`"), "{line}");
    let positions = [0.0; 3];
    let cloud = surfelshop_api::CloudView {
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

#[test]
fn scenes_have_the_areas_they_say() {
    let area = |mesh: &Mesh| -> f64 {
        let corner = |i: u32| mesh.corners[i as usize].as_dvec3();
        let double = mesh
            .faces
            .iter()
            .map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length());
        double.sum::<f64>() / 2.0
    };
    assert!((area(&room(1000)) - 24.0).abs() < 1e-4);
    let balls = 4.0 * std::f64::consts::PI * (0.09 + 0.04);
    // Balls of 200 meridians lack a thousandth.
    assert!((area(&sheet(1000)) - (4.0 + balls + 0.16 + 0.8 + 0.4)).abs() < 0.005);
}
