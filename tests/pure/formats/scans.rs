//! What becomes of a file's clouds: poses, scanners, and colours that are narrower than their type. Costs 1 s.

use crate::formats::in_memory::{InMemoryCloud, write};
use crate::formats::stage::{Files, load, places, values};
use glam::{DQuat, DVec3};
use surfelshop_api::columns::{COLOR, Element};
use surfelshop_api::format::{INTENSITY, Pose, SCAN};
use surfelshop_cloud::Buffer;

/// Points on a ball around a place, and the directions from it.
fn ball(n: usize, around: DVec3) -> (Vec<DVec3>, Vec<DVec3>) {
    let directions: Vec<DVec3> = (0..n)
        .map(|i| {
            // Even on a sphere: Fibonacci's spiral.
            let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
            let angle = i as f64 * 2.399_963_229_728_653;
            let radius = (1.0 - z * z).sqrt();
            DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        })
        .collect();
    (directions.iter().map(|direction| around + *direction).collect(), directions)
}

/// Turned about an axis that is none of the coordinates', and moved far away.
fn pose(angle: f64, translation: DVec3) -> Pose {
    let axis = DVec3::new(0.6, 0.0, 0.8);
    Pose { rotation: DQuat::from_axis_angle(axis, angle), translation }
}

/// Two scans of different sizes, with intensities that tell the points apart.
fn two_scans() -> ([InMemoryCloud; 2], Vec<DVec3>, Vec<DVec3>) {
    let poses = [
        pose(0.7, DVec3::new(400_000.0, 5_000_000.0, 100.0)),
        pose(-2.1, DVec3::new(400_010.0, 5_000_020.0, 103.0)),
    ];
    let (mut all_places, mut all_normals) = (Vec::new(), Vec::new());
    let clouds = [(300, DVec3::X), (200, DVec3::new(0.0, 3.0, -1.0))];
    let scan = |(i, (n, around)): (usize, (usize, DVec3))| {
        let (places, normals) = ball(n, around);
        all_places.extend(places.iter().map(|place| poses[i].place(*place)));
        all_normals.extend(normals.iter().map(|normal| poses[i].rotation * *normal));
        let intensities = (0..n).map(|k| (1000 * i + k) as u16).collect();
        InMemoryCloud::at(&places)
            .with_normals(&normals)
            .with(INTENSITY, 1, Buffer::U16(intensities))
            .standing(["first", "second"][i], poses[i])
    };
    let clouds: Vec<InMemoryCloud> = clouds.into_iter().enumerate().map(scan).collect();
    (clouds.try_into().unwrap(), all_places, all_normals)
}

/// Invariant: scans of a file become one cloud in common coordinates, which knows of each point its scan
#[test]
fn scans_become_one_cloud_in_common_coordinates() {
    let (clouds, expected, normals) = two_scans();
    // PTX rounds to the decimals that it writes, SFL positions to f32; neither E57 nor PTX has normals of SFL.
    for (format, name, most_off, has_normals) in [
        ("org.surfelshop.e57/e57", "two.e57", 1e-4, true),
        ("org.surfelshop.text/ptx", "two.ptx", 1e-3, false),
        ("org.surfelshop.sfl/sfl", "two.sfl", 1e-4, true),
    ] {
        let files = Files::new();
        let (path, _) = write(&files, format, name, clouds.to_vec());
        let loaded = load(&path);
        let cloud = &loaded.cloud;
        assert_eq!(cloud.len(), 500, "{name}");
        let scan = cloud.column(SCAN).unwrap();
        assert_eq!((scan.components(), scan.values().element()), (1, Element::U16), "{name}");
        let of_first = values(cloud, SCAN).iter().filter(|&&number| number < 0.5).count();
        assert_eq!(of_first, 300, "{name}");
        // SFL turns coordinates so that y points up.
        let found = places(cloud);
        let off = expected.iter().zip(&found).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        assert!(off < most_off, "{name}: {off}");
        if has_normals {
            assert_eq!(loaded.summary.normals.estimated, 0, "{name}");
            let pairs = normals.iter().zip(cloud.normals());
            let off = pairs.map(|(a, b)| a.distance(b.as_dvec3())).fold(0.0, f64::max);
            assert!(off < 1e-3, "{name}: normals are off by {off}");
        }
        let scans = &cloud.source().scans;
        assert_eq!(scans.len(), 2, "{name}");
        for (scan, given) in scans.iter().zip(&clouds) {
            let Pose { rotation, translation } = given.header.pose;
            assert!(scan.pose.translation.distance(translation) < 1e-3, "{name}: {scan:?}");
            assert!(scan.pose.rotation.dot(rotation).abs() > 1.0 - 1e-6, "{name}: {scan:?}");
        }
    }
}

/// Invariant: scans that are read and written again stand where they stood, each by itself
#[test]
fn scans_that_are_written_again_are_the_same() {
    let (clouds, expected, _) = two_scans();
    let files = Files::new();
    let (path, _) = write(&files, "org.surfelshop.e57/e57", "two.e57", clouds.to_vec());
    let first = load(&path);
    for name in ["again.e57", "again.sfl", "again.ptx"] {
        files.write(name, &first.cloud);
        let again = files.read(name);
        assert_eq!(values(&again.cloud, SCAN), values(&first.cloud, SCAN), "{name}");
        let pairs = expected.iter().zip(places(&again.cloud));
        let off = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(off < 1e-3, "{name}: {off}");
        let poses = |cloud: &surfelshop_cloud::Cloud| -> Vec<DVec3> {
            cloud.source().scans.iter().map(|scan| scan.pose.translation).collect()
        };
        for (a, b) in poses(&first.cloud).iter().zip(poses(&again.cloud)) {
            assert!(a.distance(b) < 1e-3, "{name}");
        }
    }
}

/// A floor or ceiling of 20 x 20 points at a height over the scanner.
fn plane(height: f64) -> Vec<DVec3> {
    let place = |i: usize| DVec3::new((i % 20) as f64 - 9.5, (i / 20) as f64 - 9.5, height);
    (0..400).map(place).collect()
}

/// Invariant: estimated normals face the device that saw them, scan by scan
#[test]
fn estimated_normals_face_the_scanner_of_their_scan() {
    let files = Files::new();
    // In common coordinates both planes lie below the middle of the two scanners.
    let tilted =
        Pose { rotation: DQuat::from_rotation_x(0.3), translation: DVec3::new(50.0, 0.0, 0.0) };
    let clouds = vec![
        InMemoryCloud::at(&plane(-2.0)).standing("floor", Pose::default()),
        InMemoryCloud::at(&plane(3.0)).standing("ceiling", tilted),
    ];
    let (path, _) = write(&files, "org.surfelshop.text/ptx", "two.ptx", clouds);
    let loaded = load(&path);
    let counts = loaded.summary.normals;
    assert_eq!((counts.estimated, counts.towards_scanner), (800, 800));
    assert!(counts.turned > 0, "every normal faced its scanner by chance");
    let scans = &loaded.cloud.source().scans;
    let numbers = values(&loaded.cloud, SCAN);
    for (i, (place, normal)) in places(&loaded.cloud).iter().zip(loaded.cloud.normals()).enumerate()
    {
        let scanner = scans[numbers[i] as usize].scanner.unwrap();
        let normal = normal.as_dvec3();
        assert!(normal.dot(scanner - *place) > 0.0, "point {i} at {place} has {normal}");
        let expected = if i < 400 { DVec3::Z } else { tilted.rotation * DVec3::NEG_Z };
        assert!(normal.dot(expected) > 0.99, "point {i}: {normal}");
    }
}

/// Colours of 16 bits that are at most this, in files of these formats.
fn colors_up_to(most: u16) -> Vec<(Element, Vec<f64>, Vec<String>)> {
    let places: Vec<DVec3> = ball(50, DVec3::ZERO).0;
    let colors: Vec<u16> = (0..150).map(|i| (i * 37 % (u32::from(most) + 1)) as u16).collect();
    let files = Files::new();
    [("org.surfelshop.las/las", "a.las"), ("org.surfelshop.las/las", "a.laz")]
        .into_iter()
        .map(|(format, name)| {
            let cloud = InMemoryCloud::at(&places).with(COLOR, 3, Buffer::U16(colors.clone()));
            let loaded = load(&write(&files, format, name, vec![cloud]).0);
            let element = loaded.cloud.column(COLOR).unwrap().values().element();
            let found = values(&loaded.cloud, COLOR);
            let expected: Vec<f64> = colors.iter().map(|&color| f64::from(color)).collect();
            assert_eq!(found, expected, "{name}");
            (element, found, loaded.summary.warnings)
        })
        .collect()
}

#[test]
fn colours_of_8_bits_in_16_become_8_bits_with_a_line() {
    for (element, _, warnings) in colors_up_to(255) {
        assert_eq!(element, Element::U8);
        let told = "the 16-bit colours hold 8-bit values and were read as such; \
                    `--color-bits 16` reads them as 16-bit values";
        assert_eq!(warnings, [told]);
    }
    for most in [256, 65_535, 0] {
        for (element, _, warnings) in colors_up_to(most) {
            assert_eq!((element, warnings.len()), (Element::U16, 0), "up to {most}: {warnings:?}");
        }
    }
}
