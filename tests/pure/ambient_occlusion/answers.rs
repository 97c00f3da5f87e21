//! Known answers: theory, the truth from triangles, and one method from another.

use crate::ambient_occlusion::stage::{METHODS, baked, disc, joined, part_of_sphere, rms};
use glam::Vec3;
use surfelshop_ambient_occlusion::SurfelshopPackage;
use surfelshop_api::HostInfo;
use surfelshop_runtime::boundary::{Fault, Plugin};
use surfelshop_tests::clouds;
use surfelshop_tests::occlusion::{Mesh, bake, blob, room, sheet, truth, values};
use surfelshop_tests::recording_host::RecordingHost;

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

/// Invariant: ambient occlusion is what theory says of bowls, discs, domes, rooms and planes, on
/// degenerate clouds too
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

/// Invariant: the octree agrees with all pairs, at any number of threads
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

/// Invariant: a second pass takes away shadows that count twice
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
        let all = RecordingHost::default();
        let run = |desk: &RecordingHost| {
            let mut tool =
                Plugin::of::<SurfelshopPackage>().create(0, &HostInfo::default()).unwrap();
            tool.run(&values(method), &cloud.view(), desk)
        };
        run(&all).unwrap();
        let n_ranges = all.ranges.into_inner();
        let desk = RecordingHost { cancel_after: n_ranges / 2, ..RecordingHost::default() };
        assert_eq!(run(&desk), Err(Fault::Error("cancelled".to_owned())), "{method}");
        assert!(desk.staged.into_inner().unwrap().is_empty());
        // Each thread may have one range in its hands, and asks once more for the next.
        let allowed = n_ranges / 2 + 2 * rayon::current_num_threads();
        assert!(desk.ranges.into_inner() <= allowed, "{method}");
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
