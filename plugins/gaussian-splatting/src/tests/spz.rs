//! SPZ files are read as they are packed.

use super::packed::Packed;
use super::*;
use surfelshop_api::format::UpAxis;
use surfelshop_api::glam::DVec3;

/// Two Gaussians with values that are known.
fn known(version: u32) -> Packed {
    let halves = [0x3c00u16, 0xc000, 0x3555, 0x0000, 0x7bff, 0x8001];
    let positions = match version {
        1 => halves.map(u16::to_le_bytes).concat(),
        _ => [0x00_1000i32, -0x00_2000, 1, 0x7f_ffff, -0x80_0000, -1]
            .map(|number| number.to_le_bytes()[..3].to_vec())
            .concat(),
    };
    let rotations = match version {
        1 | 2 => vec![255, 128, 127, 128, 0, 191],
        // The largest is w, then x: signs, and shares of √½ of 511.
        _ => {
            [(3 << 30) | (510 << 20) | (512 << 10) | (512 + 510), 255 << 20 | (512 + 255) << 10 | 7]
                .map(u32::to_le_bytes)
                .concat()
        }
    };
    let mut packed = Packed::noise(version, 2, 2);
    packed.attributes = [
        positions,
        vec![255, 51],
        vec![0, 255, 128, 127, 1, 254],
        vec![0, 160, 255, 16, 159, 161],
        rotations,
        (0..48).map(|i| 104 + i).collect(),
    ];
    packed
}

#[test]
fn every_field_of_every_version_is_what_it_stands_for() {
    for version in 1..=4 {
        let found = read::<Spz>(&known(version).file()).unwrap();
        let header = &found.clouds[0].header;
        assert_eq!((header.rows, header.up), (Some(2), UpAxis::Y));
        assert_eq!(header.format, format!("SPZ {version}, spherical harmonics of degree 2"));
        assert!(found.warnings.is_empty());
        if version == 1 {
            let tiny = -(2f64.powi(-24));
            near(&found, "position", &[1.0, -2.0, 0.333_251_953, 0.0, 65504.0, tiny]);
            assert_eq!(header.step, None);
        } else {
            let step = 1.0 / 4096.0;
            assert_eq!(header.step, Some(DVec3::splat(step)));
            let expected = [1.0, -2.0, step, 2048.0 - step, -2048.0, -step];
            assert_eq!(values(&found, "position"), expected);
        }
        near(&found, "opacity", &[1.0, 0.2]);
        let color = [0.0, 255.0, 128.0, 127.0, 1.0, 254.0].map(|c| (c / 255.0 - 0.5) / 0.15);
        near(&found, "sh_0", &color);
        let scale = [0.0, 160.0, 255.0, 16.0, 159.0, 161.0].map(|s: f64| (s / 16.0 - 10.0).exp());
        near(&found, "splat_scale", &scale);
        let (root, part) = (0.5f64.sqrt(), 255.0 / 511.0 * 0.5f64.sqrt());
        let rotations = match version {
            1 | 2 => {
                let [a, b] = [0.5, 63.5].map(|number| number / 127.5);
                let third = |x: f64, y: f64, z: f64| (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
                let long = (1.0f64 + 2.0 * (a * a)).sqrt();
                let second = [a, -1.0, b, third(a, -1.0, b)];
                let length = second.iter().map(|c| c * c).sum::<f64>().sqrt();
                let first = [1.0 / long, a / long, -a / long, 0.0];
                [first, second.map(|c| c / length)].concat()
            }
            _ => {
                let large = 510.0 / 511.0 * root;
                let rest = (1.0 - 2.0 * large * large).sqrt();
                let small = 7.0 / 511.0 * root;
                let x = (1.0 - 2.0 * part * part - small * small).sqrt();
                vec![large, 0.0, -large, rest, x, part, -part, small]
            }
        };
        near(&found, "splat_rotation", &rotations);
        let value = |i: usize| (f64::from(104 + i as u32) - 128.0) / 128.0;
        // Odd m have the other sign.
        let signs = [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0];
        let of = |gaussian: usize, range: std::ops::Range<usize>| -> Vec<f64> {
            let each = range.flat_map(|k| [3 * k, 3 * k + 1, 3 * k + 2].map(|i| (k, i)));
            each.map(|(k, i)| signs[k] * value(24 * gaussian + i)).collect()
        };
        near(&found, "sh_1", &[of(0, 0..3), of(1, 0..3)].concat());
        near(&found, "sh_2", &[of(0, 3..8), of(1, 3..8)].concat());
        assert!(header.column("sh_3").is_none());
    }
}

#[test]
fn degrees_are_columns() {
    for version in 1..=4 {
        for degree in 0..=4u8 {
            let found = read::<Spz>(&Packed::noise(version, degree, 7).file()).unwrap();
            let kept = usize::from(degree.min(3));
            let header = &found.clouds[0].header;
            let names = ["position", "opacity", "splat_scale", "splat_rotation"];
            let sh = (0..=kept).map(|order| format!("sh_{order}"));
            let expected: Vec<String> = names.map(str::to_owned).into_iter().chain(sh).collect();
            let found_names: Vec<&String> = header.columns.iter().map(|c| &c.name).collect();
            assert_eq!(found_names, expected.iter().collect::<Vec<_>>());
            for order in 0..=kept {
                let n = values(&found, &format!("sh_{order}")).len();
                assert_eq!(n, 7 * 3 * (2 * order + 1));
            }
            assert_eq!(found.warnings.len(), usize::from(degree == 4));
        }
        for degree in [5, 255] {
            let mut odd = Packed::noise(version, 0, 3);
            odd.degree = degree;
            assert!(refusal::<Spz>(&odd.file()).contains("degree 0 to 4"));
        }
    }
}

#[test]
fn files_of_several_batches_are_read_in_order() {
    const POINTS: u32 = 70_000;
    let files = [3, 4].map(|version| {
        let mut packed = Packed::noise(version, 0, POINTS);
        let number = |i: u32| (i * 31 % 65_521).to_le_bytes();
        packed.attributes[0] = (0..3 * POINTS).flat_map(|i| number(i)[..3].to_vec()).collect();
        packed.file()
    });
    for file in files {
        let found = read_columns::<Spz>(&file, &["position"]).unwrap();
        let positions = values(&found, "position");
        assert_eq!((positions.len(), found.clouds[0].columns.len()), (3 * 70_000, 1));
        let same = positions.iter().enumerate();
        let place = |i: usize| f64::from(i as u32 * 31 % 65_521) / 4096.0;
        assert!(same.into_iter().all(|(i, found)| *found == place(i)));
    }
}

#[test]
fn columns_that_nobody_wants_are_not_unpacked() {
    for version in 1..=4 {
        let packed = Packed::noise(version, 3, 9);
        let (all, mut file) = (read::<Spz>(&packed.file()).unwrap(), packed.file());
        for wanted in [&["opacity"][..], &["sh_2", "splat_scale"], &["sh_0", "splat_rotation"]] {
            let found = read_columns::<Spz>(&packed.file(), wanted).unwrap();
            assert_eq!(found.clouds[0].columns.len(), 1 + wanted.len());
            for name in wanted {
                assert_eq!(values(&found, name), values(&all, name), "{name}");
            }
        }
        if version == 4 {
            // The last stream, of spherical harmonics, which the last entry of six tells the length of.
            let packed = u64::from_le_bytes(file[32 + 80..][..8].try_into().unwrap());
            let start = file.len() - packed as usize;
            file[start..].fill(0);
            assert!(read::<Spz>(&file).is_err());
            assert!(read_columns::<Spz>(&file, &["opacity", "sh_0"]).is_ok());
        }
    }
}

#[test]
fn flags_and_extensions_are_told() {
    let mut packed = Packed::noise(2, 0, 2);
    packed.flags = 1;
    let found = read::<Spz>(&packed.file()).unwrap();
    assert_eq!(found.clouds[0].header.comments, ["trained with antialiasing"]);
    let record = |number: u32| [0xadbe_0003u32, 4, number].map(u32::to_le_bytes).concat();
    for (version, number, up, n_warnings) in [
        (4, 4, UpAxis::Y, 0),
        (4, 12, UpAxis::Z, 0),
        (4, 6, UpAxis::Unknown, 0),
        (4, 8, UpAxis::Y, 1),
        (4, 99, UpAxis::Y, 0),
        (3, 6, UpAxis::Unknown, 1),
    ] {
        let mut packed = Packed::noise(version, 1, 2);
        (packed.flags, packed.extensions) = (2, record(number));
        let found = read::<Spz>(&packed.file()).unwrap();
        assert_eq!((found.clouds[0].header.up, found.warnings.len()), (up, n_warnings));
    }
}

#[test]
fn empty_files_are_empty_clouds() {
    for version in 1..=4 {
        let found = read::<Spz>(&Packed::noise(version, 3, 0).file()).unwrap();
        assert_eq!((found.clouds[0].header.rows, values(&found, "sh_3").len()), (Some(0), 0));
    }
}
