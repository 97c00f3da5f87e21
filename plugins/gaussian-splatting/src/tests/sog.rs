//! SOG archives made pixel by pixel.

use super::sog_file::{BANDS, Pixels, Zip, codebook, image};
use super::*;
use surfelshop_api::format::UpAxis;

/// What a file of these pixels holds, by the words of its specification.
struct Expected {
    position: Vec<f64>,
    scale: Vec<f64>,
    rotation: Vec<f64>,
    color: Vec<f64>,
    rest: Vec<[f64; 3]>,
}

impl Expected {
    fn of(pixels: &Pixels, is_first: bool) -> Self {
        let share = |byte: u8| f64::from(byte) / 255.0;
        let between = |[least, most]: [f64; 2], share: f64| least + (most - least) * share;
        let bounds = [[-2.0, 1.0], [-1.0, 3.0], [0.5, 4.0]];
        let sizes = match is_first {
            true => [[-9.0, 2.0], [-8.0, 1.0], [-7.0, 0.0]],
            false => [[-9.0, 2.0]; 3],
        };
        let colors = match is_first {
            true => [[-2.0, 2.5], [-1.0, 1.0], [-3.0, 3.0]],
            false => [[-2.0, 2.5]; 3],
        };
        let mut made = Self {
            position: Vec::new(),
            scale: Vec::new(),
            rotation: Vec::new(),
            color: Vec::new(),
            rest: Vec::new(),
        };
        for i in 0..pixels.lower.len() {
            for axis in 0..3 {
                let word = u16::from_le_bytes([pixels.lower[i][axis], pixels.upper[i][axis]]);
                let number = between(bounds[axis], f64::from(word) / 65535.0);
                made.position.push(number.signum() * (number.abs().exp_m1()));
                made.scale.push(between(sizes[axis], share(pixels.scales[i][axis])).exp());
                made.color.push(between(colors[axis], share(pixels.sh0[i][axis])));
            }
            let [a, b, c, tag] = pixels.quats[i];
            let [a, b, c] = [a, b, c].map(|byte| (2.0 * share(byte) - 1.0) * 0.5f64.sqrt());
            let largest = (1.0 - a * a - b * b - c * c).max(0.0).sqrt();
            let length = (a * a + b * b + c * c + largest * largest).sqrt();
            let [w, x, y, z] = match tag {
                252 => [largest, a, b, c],
                253 => [a, largest, b, c],
                254 => [a, b, largest, c],
                _ => [a, b, c, largest],
            };
            made.rotation.extend([x, y, z, w].map(|part| part / length));
            if let Some(entry) = pixels.entries.get(usize::from(pixels.labels[i])) {
                let value = |code: u8| between([-1.0, 1.0], share(code));
                made.rest.extend(entry.iter().map(|codes| codes.map(value)));
            }
        }
        made
    }

    /// That a file was read so.
    fn check(&self, found: &Collected, degree: usize) {
        near(found, "position", &self.position);
        near(found, "splat_scale", &self.scale);
        near(found, "splat_rotation", &self.rotation);
        near(found, "sh_0", &self.color);
        assert_eq!(found.clouds[0].header.columns.len(), 5 + degree);
        for order in 1..=degree {
            let n = 2 * order + 1;
            let rows = self.rest.chunks_exact(BANDS[degree]);
            let expected = rows.flat_map(|entry| {
                (0..n).flat_map(move |k| {
                    // The sign of odd m.
                    let sign = if (k + order) % 2 == 1 { -1.0 } else { 1.0 };
                    entry[order * order - 1 + k].map(|value| sign * value)
                })
            });
            near(found, ["", "sh_1", "sh_2", "sh_3"][order], &expected.collect::<Vec<_>>());
        }
    }
}

#[test]
fn every_pixel_is_what_it_stands_for() {
    for degree in 0..=3 {
        let pixels = Pixels::noise(70, degree);
        let found = read::<Sog>(&pixels.file()).unwrap();
        Expected::of(&pixels, false).check(&found, degree);
        let opacity: Vec<f64> = pixels.sh0.iter().map(|p| f64::from(p[3]) / 255.0).collect();
        near(&found, "opacity", &opacity);
        let header = &found.clouds[0].header;
        assert_eq!(header.format, format!("SOG 2, spherical harmonics of degree {degree}"));
        assert_eq!((header.rows, header.up), (Some(70), UpAxis::Unknown));
        assert_eq!(header.comments, ["trained with antialiasing"]);
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }
}

#[test]
fn version_1_has_bounds_and_logits() {
    for degree in 0..=3 {
        let pixels = Pixels::noise(9, degree);
        let found = read::<Sog>(&pixels.zip(&pixels.meta_of_1()).bytes()).unwrap();
        Expected::of(&pixels, true).check(&found, degree);
        let logit = |p: &[u8; 4]| -6.0 + 14.0 * f64::from(p[3]) / 255.0;
        let opacity = pixels.sh0.iter().map(|p| 1.0 / (1.0 + (-logit(p)).exp()));
        near(&found, "opacity", &opacity.collect::<Vec<_>>());
        let format = &found.clouds[0].header.format;
        assert_eq!(*format, format!("SOG 1, spherical harmonics of degree {degree}"));
    }
}

#[test]
fn archives_may_be_deflated_have_a_folder_and_a_comment() {
    let pixels = Pixels::noise(9, 1);
    let plain = read::<Sog>(&pixels.file()).unwrap();
    let mut zip = pixels.zip(&pixels.meta());
    zip.deflated = true;
    zip.comment = b"PK\x05\x06 is how the end begins".to_vec();
    let found = read::<Sog>(&zip.bytes()).unwrap();
    assert_eq!(found.clouds[0].columns, plain.clouds[0].columns);
    let inside = Zip::default().with("scene/", Vec::new()).with("scene/notes.txt", vec![1]);
    let names = [
        "means_l.webp",
        "means_u.webp",
        "scales.webp",
        "quats.webp",
        "sh0.webp",
        "shN_centroids.webp",
        "shN_labels.webp",
        "meta.json",
    ];
    let inside = names.iter().fold(inside, |inside, name| {
        inside.with(&format!("scene/{name}"), zip.file_mut(name).clone())
    });
    let found = read::<Sog>(&inside.bytes()).unwrap();
    assert_eq!(found.clouds[0].columns, plain.clouds[0].columns);
}

#[test]
fn columns_that_nobody_wants_are_not_unpacked() {
    let pixels = Pixels::noise(9, 3);
    let whole = read::<Sog>(&pixels.file()).unwrap();
    let mut zip = pixels.zip(&pixels.meta());
    for name in ["scales.webp", "quats.webp", "shN_centroids.webp", "shN_labels.webp"] {
        zip.file_mut(name).clear();
    }
    let found = read_columns::<Sog>(&zip.bytes(), &["opacity", "sh_0"]).unwrap();
    let names = found.clouds[0].header.columns.iter().map(|column| column.name.as_str());
    assert_eq!(names.collect::<Vec<_>>(), ["position", "opacity", "sh_0"]);
    for name in ["position", "opacity", "sh_0"] {
        assert_eq!(values(&found, name), values(&whole, name));
    }
}

#[test]
fn what_points_nowhere_is_mended_and_told() {
    let mut pixels = Pixels::noise(9, 2);
    pixels.quats[4] = [1, 2, 3, 251];
    pixels.labels[7] = 70;
    let found = read::<Sog>(&pixels.file()).unwrap();
    assert_eq!(values(&found, "splat_rotation")[16..20], [0.0, 0.0, 0.0, 1.0]);
    assert!(values(&found, "sh_2")[15 * 7..15 * 8].iter().all(|value| *value == 0.0));
    assert!(
        found.warnings[0].starts_with("1 rotations")
            && found.warnings[1].starts_with("1 Gaussians")
    );
    // A first number that some writers leave out.
    let book = codebook(-9.0, 2.0);
    let meta = pixels.meta().replace(r#""codebook":[-9.0,"#, r#""codebook":[null,"#);
    assert_ne!(meta, pixels.meta());
    pixels.scales[0] = [0; 3];
    let found = read::<Sog>(&pixels.zip(&meta).bytes()).unwrap();
    let first = (book[1] + (book[1] - book[255]) / 255.0).exp();
    assert!((values(&found, "splat_scale")[0] - first).abs() < 1e-6 * first);
}

#[test]
fn what_cannot_be_is_refused_in_a_line() {
    let pixels = Pixels::noise(9, 1);
    let meta = pixels.meta();
    for (from, to, word) in [
        (r#""version":2"#, r#""version":3"#, "found 3"),
        (r#""count":9"#, r#""count":17"#, "expected 17 pixels, found 12"),
        (r#""count":9"#, r#""count":4000000000"#, "cannot hold them"),
        (r#""count":9"#, r#""count":5000000000"#, "at most 4294967295"),
        (r#""count":9"#, r#""other":9"#, "how many Gaussians"),
        (r#""bands":1"#, r#""bands":4"#, "shN.bands"),
        (r#""bands":1"#, r#""bands":2"#, "512 pixels wide, found 192"),
        (r#""codebook":[-9.0,"#, r#""codebook":["#, "scales.codebook: expected 256"),
        (r#""maxs":[1,3,4]"#, r#""maxs":[1,3]"#, "means"),
        (r#"["quats.webp"]"#, r#"["../quats.webp"]"#, "`../quats.webp`"),
        (r#"["sh0.webp"]"#, "[]", "sh0.files"),
        (r#""quats""#, r#""quads""#, "quats"),
    ] {
        assert!(meta.contains(from), "{from}");
        let line = refusal::<Sog>(&pixels.zip(&meta.replace(from, to)).bytes());
        assert!(line.contains(word), "{word}: {line}");
    }
    let with = |name: &str, contents: Vec<u8>| {
        let mut zip = pixels.zip(&meta);
        *zip.file_mut(name) = contents;
        refusal::<Sog>(&zip.bytes())
    };
    assert!(with("sh0.webp", b"\x89PNG".to_vec()).contains("expected a WebP image"));
    assert!(with("sh0.webp", image(2000, &vec![[0; 4]; 1 << 18])).contains("2000 x 132"));
    assert!(
        refusal::<Sog>(&Zip::default().with("a.txt", vec![1]).bytes())
            .contains("found a.txt: unpack")
    );
    assert!(refusal::<Sog>(b"ply\n").contains("zip archive"));
    assert!(refusal::<Sog>(b"PK\x03\x04 and no more").contains("table of a zip archive"));
}

#[test]
fn damaged_files_do_no_harm() {
    let pixels = Pixels::noise(5, 1);
    let short = |meta: &str| meta.replace("        ", "");
    let file = pixels.zip(&short(&pixels.meta_of_1())).bytes();
    let cut = (0..file.len()).filter(|len| survives::<Sog>(&file[..*len])).count();
    assert_eq!(cut, 0);
    let mut n_read = 0;
    for i in 0..file.len() {
        let mut damaged = file.clone();
        damaged[i] ^= 0x11;
        n_read += usize::from(survives::<Sog>(&damaged));
    }
    // Times and versions of files in the archive say nothing; what is in them has a checksum.
    assert!(n_read > 50 && n_read < file.len() / 2, "{n_read} of {}", file.len());
}
