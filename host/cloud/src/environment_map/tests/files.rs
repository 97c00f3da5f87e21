use super::*;
use std::path::PathBuf;
use tempfile::TempDir;

fn folder() -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    // Formats are told by content.
    let path = folder.path().join("probe.dat");
    (folder, path)
}

fn waves(d: DVec3) -> [f32; 3] {
    [d.x, d.y, d.z].map(|c| (1.3 + (3.0 * c).sin()) as f32)
}

fn hdr() -> Vec<u8> {
    let (_folder, path) = folder();
    write_hdr(&path, &painted(Mapping::LatLong, 64, waves)).unwrap();
    std::fs::read(path).unwrap()
}

fn exr_of(picture: &Picture, half: bool) -> Vec<u8> {
    let (_folder, path) = folder();
    let at = |x: usize, y: usize| picture.rgb[y * picture.width as usize + x];
    let (width, height) = (picture.width as usize, picture.height as usize);
    if half {
        exr::prelude::write_rgb_file(&path, width, height, |x, y| {
            let [r, g, b] = at(x, y).map(exr::prelude::f16::from_f32);
            (r, g, b)
        })
    } else {
        exr::prelude::write_rgba_file(&path, width, height, |x, y| {
            let [r, g, b] = at(x, y);
            (r, g, b, 1.0f32)
        })
    }
    .unwrap();
    std::fs::read(path).unwrap()
}

/// An `OpenEXR` file of channels of this name, each full of its value.
fn exr_with(channels: &[(&str, f32)]) -> Vec<u8> {
    use exr::prelude::*;
    let (_folder, path) = folder();
    let list: SmallVec<[AnyChannel<FlatSamples>; 4]> = channels
        .iter()
        .map(|&(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 32])))
        .collect();
    Image::from_channels((8, 4), AnyChannels::sort(list)).write().to_file(&path).unwrap();
    std::fs::read(path).unwrap()
}

fn load(bytes: &[u8]) -> Probe {
    let (_folder, path) = folder();
    std::fs::write(&path, bytes).unwrap();
    read(&path, None).unwrap_or_else(|error| panic!("{error}"))
}

/// The one line that a file is refused with, without its path.
fn refusal(bytes: &[u8]) -> String {
    let (_folder, path) = folder();
    std::fs::write(&path, bytes).unwrap();
    let error = read(&path, None).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.len() < 400, "{error}");
    error.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|window| window == from).unwrap();
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

fn assert_close(found: &Picture, expected: &Picture, tolerance: f32) {
    assert_eq!([found.width, found.height], [expected.width, expected.height]);
    for (a, b) in found.rgb.iter().zip(&expected.rgb) {
        let largest = b.iter().copied().fold(0.0, f32::max);
        let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off <= tolerance * largest, "{a:?} instead of {b:?}");
    }
}

#[test]
fn radiance_files_come_back() {
    let picture = painted(Mapping::LatLong, 64, waves);
    let probe = load(&hdr());
    assert_eq!(probe.name, "probe.dat");
    assert_eq!(probe.mapping, Mapping::LatLong);
    // 8 bits of mantissa for the largest channel, of which the first is set.
    assert_close(&probe.picture, &picture, 1.0 / 128.0);
    assert_eq!(load(&[&hdr()[..], b"\n"].concat()), probe);
    let rgbe = replaced(&hdr(), b"#?RADIANCE", b"#?RGBE");
    assert_eq!(load(&rgbe).picture, probe.picture);
}

#[test]
fn stated_exposure_is_undone() {
    let plain = load(&hdr());
    let bytes = replaced(&hdr(), b"FORMAT", b"EXPOSURE=4\nFORMAT");
    let exposed = load(&bytes);
    for (a, b) in plain.picture.rgb.as_flattened().iter().zip(exposed.picture.rgb.as_flattened()) {
        assert_eq!(*a, 4.0 * b);
    }
}

#[test]
fn open_exr_files_come_back() {
    let picture = painted(Mapping::Angular, 64, waves);
    let probe = load(&exr_of(&picture, false));
    assert_eq!(probe.mapping, Mapping::Angular);
    assert_close(&probe.picture, &picture, 0.0);
    // Half floats have 11 bits.
    assert_close(&load(&exr_of(&picture, true)).picture, &picture, 1.0 / 2048.0);
}

#[test]
fn channels_are_taken_by_name() {
    let rgb = load(&exr_with(&[("A", 0.0), ("B", 3.0), ("G", 2.0), ("R", 1.0), ("Z", 9.0)]));
    assert!(rgb.picture.rgb.iter().all(|&texel| texel == [1.0, 2.0, 3.0]));
    let grey = load(&exr_with(&[("Y", 0.7)]));
    assert!(grey.picture.rgb.iter().all(|&texel| texel == [0.7; 3]));
    let line = refusal(&exr_with(&[("Z", 1.0), ("depth", 2.0)]));
    assert!(line.contains("channels R, G and B") && line.contains("`Z`, `depth`"), "{line}");
    assert!(refusal(&exr_with(&[("BY", 1.0), ("RY", 1.0), ("Y", 1.0)])).contains("`BY`"));
}

#[test]
fn other_files_are_refused_by_what_they_are() {
    for (bytes, words) in [
        (&b"\x89PNG\r\n\x1a\n0000"[..], "found PNG"),
        (b"\xff\xd8\xff\xe0 JFIF", "found JPEG"),
        (b"hello there", "found `hello there`"),
        (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
        (b"", "found an empty file"),
        (b"PF\n4 4\n", "portable float map"),
    ] {
        let line = refusal(bytes);
        assert!(line.contains(words) && line.contains("expected a light probe"), "{line}");
    }
    let folder = TempDir::new().unwrap();
    assert!(read(folder.path(), None).unwrap_err().to_string().contains("found a folder"));
    let line = read(folder.path().join("none.hdr"), None).unwrap_err().to_string();
    assert!(line.contains("none.hdr: cannot be read"), "{line}");
}

#[test]
fn files_that_are_cut_short_are_refused() {
    let bytes = hdr();
    for left in [11, 30, 60, 200, bytes.len() / 2, bytes.len() - 1] {
        let line = refusal(&bytes[..left]);
        assert!(line.contains("expected") && line.contains("found"), "{line}");
    }
    assert!(refusal(&bytes[..bytes.len() / 2]).contains("expected 64 x 32 pixels, found the end"));
    let bytes = exr_of(&painted(Mapping::LatLong, 64, waves), false);
    for left in [4, 8, 100, 300, bytes.len() / 2, bytes.len() - 1] {
        let line = refusal(&bytes[..left]);
        assert!(line.contains("expected") && line.contains("found"), "{left}: {line}");
    }
    assert!(refusal(&bytes[..bytes.len() / 2]).contains("expected 64 x 32 pixels, found the end"));
}

#[test]
fn sizes_beyond_the_file_are_refused_before_memory_is_taken() {
    let bytes = hdr();
    for (size, words) in [
        ("-Y 16000 +X 16000", "16000 x 16000"),
        ("-Y 16385 +X 2", "1 to 16384 pixels"),
        ("-Y 4294967295 +X 4294967295", "4294967295"),
        ("-Y 0 +X 0", "0 x 0"),
        ("-Y 99999999999 +X 1", "found damage"),
        ("nothing", "found damage"),
    ] {
        let line = refusal(&replaced(&bytes, b"-Y 32 +X 64", size.as_bytes()));
        assert!(line.contains(words), "{line}");
    }
    // Both windows of an OpenEXR file, as their last pixel.
    let window = [0i32, 0, 63, 31].map(i32::to_le_bytes).concat();
    let huge = [0i32, 0, 15_999, 15_999].map(i32::to_le_bytes).concat();
    let bytes = exr_of(&painted(Mapping::LatLong, 64, waves), false);
    let line = refusal(&replaced(&replaced(&bytes, &window, &huge), &window, &huge));
    assert!(line.contains("16000 x 16000"), "{line}");
    let part = [0i32, 0, 127, 31].map(i32::to_le_bytes).concat();
    let at = bytes.windows(13).position(|w| w == b"displayWindow").unwrap();
    let cropped = [&bytes[..at], &replaced(&bytes[at..], &window, &part)].concat();
    assert!(refusal(&cropped).contains("picture's 128 x 32, found 64 x 32 from 0, 0"));
}

#[test]
fn damage_anywhere_is_one_line_or_a_probe() {
    for bytes in [hdr(), exr_of(&painted(Mapping::LatLong, 16, waves), false)] {
        for i in 0..600.min(bytes.len()) {
            let mut bytes = bytes.clone();
            bytes[i] ^= 0x55;
            let (_folder, path) = folder();
            std::fs::write(&path, &bytes).unwrap();
            if let Err(error) = read::picture(&path) {
                assert!(!error.to_string().contains('\n'), "{i}: {error}");
            }
        }
    }
}

#[test]
fn a_failure_to_write_leaves_the_old_file() {
    let (_folder, path) = folder();
    std::fs::write(&path, b"old").unwrap();
    let wrong = Picture { width: 2, height: 2, rgb: vec![[0.0; 3]; 3] };
    let line = write_hdr(&path, &wrong).unwrap_err().to_string();
    assert!(line.contains("expected 4 pixels, found 3"), "{line}");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
}
