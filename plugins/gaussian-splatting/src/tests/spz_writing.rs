//! SPZ files that are written come back.

use super::packed::Packed;
use super::*;
use flate2::read::GzDecoder;
use std::io::Read as _;
use surfelshop_api::format::UpAxis;

fn plain(file: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    GzDecoder::new(file).read_to_end(&mut bytes).unwrap();
    bytes
}

#[test]
fn what_was_read_is_written_as_it_was() {
    for degree in 0..=3 {
        let mut packed = Packed::noise(3, degree, 333);
        packed.bits = 14;
        packed.flags = degree % 2;
        // Rotations as a writer makes them: the largest is the largest, and what is nothing has no sign.
        packed.attributes[4] = (0..333u32)
            .flat_map(|i| {
                ((i % 4) << 30 | (i % 280) << 20 | (513 + i % 290) << 10 | (i % 270)).to_le_bytes()
            })
            .collect();
        packed.attributes[0] =
            (0..999i32).flat_map(|i| ((i - 500) * 16_001).to_le_bytes()[..3].to_vec()).collect();
        let found = read::<Spz>(&packed.file()).unwrap();
        let (file, lines) = write::<Spz>(TestCloud::of(&found)).unwrap();
        assert!(lines.is_empty(), "{lines:?}");
        let again = read::<Spz>(&file).unwrap();
        assert_eq!(again.clouds[0].columns[0], found.clouds[0].columns[0]);
        let written = plain(&file);
        // As many bits behind the point as still hold 500 · 16 001 / 2^14, which are those that were there.
        assert_eq!(written[..16], packed.plain()[..16]);
        let same = written.iter().zip(&packed.plain()).position(|(a, b)| a != b);
        assert_eq!((same, written.len()), (None, packed.plain().len()), "degree {degree}");
    }
}

#[test]
fn positions_have_the_finest_step_that_reaches() {
    for (reach, bits) in [(1.0, 16), (127.9, 16), (128.1, 15), (2047.0, 12), (8_388_607.0, 0)] {
        let cloud = TestCloud::at(vec![reach, -reach, 0.3]);
        let file = write::<Spz>(cloud).unwrap().0;
        assert_eq!(plain(&file)[13], bits, "{reach}");
        let found = read::<Spz>(&file).unwrap();
        let step = 2f64.powi(-i32::from(bits));
        let off = values(&found, "position").iter().zip([reach, -reach, 0.3]);
        assert!(off.into_iter().all(|(a, b)| (a - b).abs() <= step / 2.0), "{reach}");
    }
    let line = write::<Spz>(TestCloud::at(vec![8_388_608.0; 3])).unwrap_err().to_string();
    assert!(line.contains("expected coordinates within 8388607"), "{line}");
}

#[test]
fn what_cannot_be_held_is_said() {
    let mut cloud = TestCloud::at(vec![0.0, 1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0, 7.0, 8.0])
        .column("splat_scale", 3, Owned::F32(vec![0.0, 1.0, 1e4, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
        .column("opacity", 1, Owned::F64(vec![0.5, 2.0, -1.0]))
        .column("sh_0", 3, Owned::F32(vec![0.0; 9]))
        .column("sh_1", 9, Owned::F32([[0.0; 9], [0.0; 9], [1.5; 9]].concat()))
        .column("sh_3", 21, Owned::F32(vec![0.0; 63]))
        .column("label", 1, Owned::U8(vec![1, 2, 3]));
    cloud.header.up = UpAxis::Z;
    cloud.header.has_faces = true;
    let (file, lines) = write::<Spz>(cloud).unwrap();
    for part in [
        "`sh_3`, `label`",
        "y points up",
        "triangles",
        "1 Gaussians whose places",
        "2 Gaussians have sizes or colours beyond",
    ] {
        assert!(lines.iter().any(|line| line.contains(part)), "{part}: {lines:?}");
    }
    assert_eq!(lines.len(), 5, "{lines:?}");
    let found = read::<Spz>(&file).unwrap();
    assert_eq!(values(&found, "position"), [0.0, 1.0, 2.0, 6.0, 7.0, 8.0]);
    near(&found, "opacity", &[128.0 / 255.0, 0.0]);
    assert!(values(&found, "splat_scale")[0] < 5e-5);
    // Signs of odd m are turned there and back: -1.5 is cut to -1, 1.5 to 127/128.
    let sh = values(&found, "sh_1");
    assert_eq!((sh[9], sh[12], sh[15]), (1.0, 127.0 / 128.0, 1.0));
}

#[test]
fn plain_clouds_become_round_splats() {
    let cloud = TestCloud::at(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
        .column("radius", 1, Owned::F32(vec![2.0, 0.5]))
        .column("color", 3, Owned::U8(vec![255, 0, 128, 1, 2, 3]));
    let (file, lines) = write::<Spz>(cloud).unwrap();
    assert!(lines.len() == 1 && lines[0].contains("0.7 of their radii"), "{lines:?}");
    let found = read::<Spz>(&file).unwrap();
    assert_eq!(values(&found, "opacity"), [1.0, 1.0]);
    assert_eq!(values(&found, "splat_rotation")[..4], [0.0, 0.0, 0.0, 1.0]);
    let scales = values(&found, "splat_scale");
    // Steps are sixteenths of e.
    let off = [scales[0] / 1.4, scales[3] / 0.35].map(|ratio: f64| ratio.ln().abs());
    assert!(off.iter().all(|off| *off < 0.04), "{scales:?}");
    let color = values(&found, "sh_0");
    assert!((0.5 + 0.282_094_79 * color[0] - 1.0).abs() < 0.01, "{color:?}");
    let (file, _) = write::<Spz>(TestCloud::at(Vec::new())).unwrap();
    assert_eq!(read::<Spz>(&file).unwrap().clouds[0].header.rows, Some(0));
}

#[test]
fn flat_splats_become_thin() {
    let cloud = TestCloud::at(vec![0.0, 1.0, 2.0])
        .column("splat_scale", 2, Owned::F32(vec![2.0, 1.0]))
        .column("sh_0", 3, Owned::F32(vec![0.0; 3]));
    let (file, lines) = write::<Spz>(cloud).unwrap();
    assert!(lines.is_empty(), "{lines:?}");
    let found = read::<Spz>(&file).unwrap();
    let scales = values(&found, "splat_scale").iter().zip([2.0, 1.0, 1e-3]);
    // Steps are sixteenths of e.
    assert!(scales.into_iter().all(|(a, b): (_, f64)| (a / b).ln().abs() < 0.04));
}
