//! What files say of clouds beside columns comes through, or a line says what does not. Costs 1 s.

use crate::formats::in_memory::{InMemoryCloud, write};
use crate::formats::stage::{Files, formats, load, reading, writing};
use glam::{DQuat, DVec3};
use surfelshop_api::columns::COLOR;
use surfelshop_api::format::{CloudHeader, Pose, UpAxis};
use surfelshop_cloud::convert::{Selection, convert};
use surfelshop_cloud::{Buffer, ColorBits, ReadOptions, heads, read};

/// Formats with names of files, but for PLY, which is written by the host.
const FILES: [(&str, &str); 8] = [
    ("las", "a.las"),
    ("las", "a.laz"),
    ("e57", "a.e57"),
    ("pcd", "a.pcd"),
    ("xyz", "a.xyz"),
    ("pts", "a.pts"),
    ("ptx", "a.ptx"),
    ("sfl", "a.sfl"),
];

/// Six points in a grid, and all that can be said of them.
fn told(up: UpAxis) -> InMemoryCloud {
    let places: Vec<DVec3> =
        (0..6).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), 0.5)).collect();
    let mut cloud = InMemoryCloud::at(&places);
    cloud.header = CloudHeader {
        name: "hall".to_owned(),
        pose: Pose { rotation: DQuat::IDENTITY, translation: DVec3::new(10.0, 0.0, 0.0) },
        scanner: Some(DVec3::new(1.0, 2.0, 3.0)),
        up,
        metres_per_unit: 0.3048,
        coordinate_system: "EPSG:2992".to_owned(),
        time: "2018-03-05 10:00:00 UTC".to_owned(),
        grid: Some([3, 2]),
        comments: vec!["swept twice".to_owned()],
        ..cloud.header
    };
    cloud
}

fn header_of(path: &std::path::Path) -> CloudHeader {
    heads(path, &reading(formats())).unwrap_or_else(|error| panic!("{error}")).remove(0)
}

/// What of a header is not as it was, by words that a line about it has.
fn differing(a: &CloudHeader, b: &CloudHeader) -> Vec<&'static str> {
    // Where feet became metres, places are compared in these.
    let in_metres = b.metres_per_unit.to_bits() == 1f64.to_bits();
    let unit = |header: &CloudHeader| if in_metres { header.metres_per_unit } else { 1.0 };
    let scanner =
        |header: &CloudHeader| header.scanner.map(|place| header.pose.place(place) * unit(header));
    let near = |(a, b): (DVec3, DVec3)| (a - b).length() < 1e-6;
    // Single precision, as SFL has it.
    let is_unit = (a.metres_per_unit - b.metres_per_unit).abs() < 1e-7;
    // E57 has one comment, which is read as `description: …`.
    let comes = |comment: &String| b.comments.iter().any(|other| other.ends_with(comment));
    let has_comments = a.comments.iter().all(comes);
    let kept = [
        (a.name == b.name, "name"),
        (scanner(a).zip(scanner(b)).map_or(a.scanner == b.scanner, near), "scanner"),
        (a.up == b.up, "points up"),
        (is_unit, "unit"),
        (a.coordinate_system == b.coordinate_system, "coordinate reference system"),
        (a.time == b.time, "time"),
        (a.grid == b.grid, "grid"),
        (has_comments, "comment"),
    ];
    kept.into_iter().filter(|(is_kept, _)| !is_kept).map(|(_, word)| word).collect()
}

/// Invariant: what a header says comes back from every format that is written, or a line names it
/// Cost: 0.2 s
#[test]
fn what_headers_say_comes_back_or_a_line_names_it() {
    for (format, name) in FILES {
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z, UpAxis::Unknown] {
            let (files, mut cloud) = (Files::new(), told(up));
            // Others get clouds in common coordinates.
            if !["e57", "ptx", "sfl"].contains(&format) {
                cloud.header.pose = Pose::default();
            }
            let (path, lines) = write(&files, format, name, vec![cloud.clone()]);
            for word in differing(&cloud.header, &header_of(&path)) {
                let is_said = lines.iter().any(|line| line.contains(word));
                // Clouds of which nobody knows are shown with y up, as what says so.
                let is_same = word == "points up"
                    && up == UpAxis::Y
                    && header_of(&path).up == UpAxis::Unknown;
                assert!(is_said || is_same, "{name}, {up:?} up: `{word}` goes silently: {lines:?}");
            }
        }
    }
}

/// Invariant: a PLY file says in comments which axis points up, units, system, scanner and time
/// Cost: milliseconds
#[test]
fn ply_files_keep_what_is_said_in_comments() {
    let files = Files::new();
    // All that PLY holds, in a format that holds it, too, one in text and one in metres.
    for (format, from, scanner) in [("las", "in.las", None), ("ptx", "in.ptx", Some(DVec3::ZERO))] {
        let mut cloud = told(UpAxis::Z);
        cloud.header.scanner = scanner;
        let (path, _) = write(&files, format, from, vec![cloud]);
        let before = header_of(&path);
        for (i, ascii) in [false, true].into_iter().enumerate() {
            let out = files.at(&format!("{from}{i}.ply"));
            let (read_with, mut write_with) = (reading(formats()), writing(formats()));
            write_with.ascii = ascii;
            let all = Selection::default();
            convert(std::slice::from_ref(&path), &out, &all, false, &read_with, &write_with)
                .unwrap();
            let after = header_of(&out);
            let lost = differing(&before, &after);
            assert!(lost.iter().all(|word| *word == "grid"), "{from}: {lost:?}");
            // The cloud that is read knows the same, and so does the one that is written of it.
            let again = files.at(&format!("again-{from}{i}.ply"));
            surfelshop_cloud::write(&again, &load(&out).cloud, &writing(formats())).unwrap();
            let lost =
                differing(&CloudHeader { comments: Vec::new(), ..after }, &header_of(&again));
            assert!(lost.is_empty(), "{from}: {lost:?}");
        }
    }
}

/// Invariant: what 16-bit colours hold is told by their values, or said
/// Cost: milliseconds
#[test]
fn colours_of_16_bits_are_taken_as_is_said() {
    let files = Files::new();
    for (values, bits, expected) in [
        ([7u16, 200, 255], ColorBits::Told, Buffer::U8(vec![7, 200, 255])),
        ([7, 200, 255], ColorBits::Sixteen, Buffer::U16(vec![7, 200, 255])),
        ([7, 200, 256], ColorBits::Told, Buffer::U16(vec![7, 200, 256])),
        ([7, 200, 256], ColorBits::Eight, Buffer::U8(vec![7, 200, 255])),
    ] {
        let cloud = InMemoryCloud::at(&[DVec3::ZERO]);
        let cloud = cloud.with(COLOR, 3, Buffer::U16(values.to_vec()));
        let (path, _) = write(&files, "las", "a.las", vec![cloud]);
        let options = ReadOptions { color_bits: bits, ..reading(formats()) };
        let loaded = read(&path, &options).unwrap();
        let told = loaded.summary.warnings.iter().any(|line| line.contains("--color-bits 16"));
        assert_eq!(told, bits == ColorBits::Told && values[2] == 255, "{values:?} {bits:?}");
        assert!(*loaded.cloud.column(COLOR).unwrap().values() == expected, "{values:?} {bits:?}");
        let (out, all) = (files.at("a.ply"), Selection::default());
        convert(&[path], &out, &all, false, &options, &writing(formats())).unwrap();
        let converted = load(&out).cloud;
        // As 16-bit values the darkest are told again, unless they are kept so.
        let again = ReadOptions { color_bits: ColorBits::Sixteen, ..reading(formats()) };
        let converted = match bits {
            ColorBits::Sixteen => read(&out, &again).unwrap().cloud,
            _ => converted,
        };
        assert!(*converted.column(COLOR).unwrap().values() == expected, "{values:?} {bits:?}");
    }
}
