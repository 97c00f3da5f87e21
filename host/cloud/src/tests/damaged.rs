use super::*;

fn binary() -> Vec<u8> {
    Ply::new("binary_little_endian").element("vertex", &XYZ, &cube()).bytes()
}

fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn a_file_that_is_cut_short_says_what_it_holds() {
    let bytes = binary();
    let message = refusal(&bytes[..bytes.len() - 30]);
    assert!(message.contains("expected 8 records of 12 bytes"), "{message}");
    assert!(message.contains("found 66 bytes, which hold 5"), "{message}");
    let text = Ply::new("ascii").element("vertex", &XYZ, &cube()).bytes();
    let message = refusal(&text[..text.len() - 7]);
    assert!(message.contains("expected 8 lines"), "{message}");
}

#[test]
fn counts_beyond_the_file_are_refused_before_memory_is_taken() {
    for encoding in ENCODINGS {
        let bytes = Ply::new(encoding).element("vertex", &XYZ, &cube()).bytes();
        for count in ["9", "4294967295", "9223372036854775808", "18446744073709551615"] {
            let message = refusal(&replaced(&bytes, "vertex 8", &format!("vertex {count}")));
            assert!(message.contains(&format!("expected {count} ")), "{message}");
        }
        for count in ["-1", "18446744073709551616", "many", "8.0", ""] {
            let message = refusal(&replaced(&bytes, "vertex 8", &format!("vertex {count}")));
            assert!(message.starts_with("header line 3: expected"), "{message}");
        }
    }
}

#[test]
fn lists_beyond_the_file_or_of_negative_length_are_refused() {
    for (kind, length) in [("int", 2e9), ("uint", 4e9), ("int", -1.0), ("char", -128.0)] {
        for encoding in ENCODINGS {
            let mut ply = Ply::new(encoding)
                .line("element vertex 2")
                .line(&format!("property list {kind} float near"));
            for property in XYZ {
                ply = ply.line(&format!("property {property}"));
            }
            for _ in 0..2 {
                ply.value(kind, length);
                for _ in 0..3 {
                    ply.value("float", 1.0);
                }
                ply.end_row();
            }
            let message = refusal(&ply.bytes());
            assert!(message.contains("expected"), "{message}");
        }
    }
}

#[test]
fn headers_that_break_the_rules_are_refused_with_their_line() {
    let bytes = binary();
    for (from, to, expected) in [
        ("format binary_little_endian 1.0", "format binary_little_endian 2.0", "header line 2"),
        ("format binary_little_endian 1.0", "format", "header line 2"),
        ("float x", "float128 x", "header line 4: expected a type"),
        ("float x", "float", "header line 4: expected a property"),
        ("float y", "float X", "header line 5: expected a name"),
        ("float x", "list float int x", "header line 4: expected an integer type"),
        ("element vertex 8", "Created by hand", "header line 3: expected comment"),
        ("element vertex 8\n", "", "header line 3: expected an element first"),
        ("element vertex", "element splat", "expected an element `vertex`"),
        ("float x", "float u", "found `u`, `y`, `z`"),
        ("float x", "list uchar int x", "expected properties x, y and z"),
        ("end_header", "comment", "header line 8"),
        ("ply\n", "plx\n", "expected a PLY, OBJ or OFF file, found `plx"),
        ("format binary_little_endian 1.0\n", "", "expected a line `format`"),
    ] {
        let message = refusal(&replaced(&bytes, from, to));
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_header_without_end_is_not_taken_into_memory_whole() {
    let endless = [b"ply\nformat ascii 1.0\ncomment ".to_vec(), vec![b'x'; 17 << 20]].concat();
    assert!(refusal(&endless).contains("expected `end_header`, found 16 MiB without it"));
    let lines = [b"ply\nformat ascii 1.0\n".to_vec(), b"comment\n".repeat(3 << 20)].concat();
    assert!(refusal(&lines).contains("expected `end_header`"));
}

#[test]
fn what_is_no_point_cloud_says_so() {
    assert!(refusal(b"").contains("found an empty file"));
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    assert!(refusal(pointer).contains("git lfs pull"));
    assert!(refusal(b"\x89PNG\r\n\x1a\n").contains("found `\u{fffd}PNG"));
    assert!(refusal(&[0; 100]).contains("expected a PLY, OBJ or OFF file"));
    let folder = TempDir::new().unwrap();
    let message = read(folder.path(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("found a folder"), "{message}");
    let missing = folder.path().join("missing.ply");
    let message = read(&missing, &ReadOptions::default()).unwrap_err().to_string();
    assert!(message.contains("missing.ply: cannot be read"), "{message}");
}

#[test]
fn values_that_cannot_be_read_name_their_line() {
    let text = Ply::new("ascii").element(
        "vertex",
        &also(&XYZ, &["uchar n"]),
        &with(cube(), |_| vec![3.0]),
    );
    let bytes = text.bytes();
    for (to, expected) in [
        ("1 -1 -1", "line 9: expected 4 values of element `vertex`, found 3"),
        ("1,5 0 0 3", "line 9: expected a number of type f32 for `x`, found `1,5`"),
        ("1 0 0 256", "line 9: expected a number of type u8 for `n`, found `256`"),
        ("1 0 0 0.5", "line 9: expected a number of type u8 for `n`, found `0.5`"),
        ("1 0 zero 3", "line 9: expected a number of type f32 for `z`, found `zero`"),
    ] {
        let message = refusal(&replaced(&bytes, "-1 -1 -1 3 ", to));
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn every_beginning_of_a_file_loads_or_is_refused_in_one_line() {
    for encoding in ENCODINGS {
        let rows = with(cube(), |_| vec![0.0, 1.0, 0.0, 0.5]);
        let properties = also(&XYZ, &["float nx", "float ny", "float nz", "float radius"]);
        let bytes = Ply::new(encoding).element("vertex", &properties, &rows).bytes();
        for length in 0..bytes.len() {
            if let Err(error) = try_load(&bytes[..length]) {
                assert!(!error.to_string().contains('\n'));
            }
        }
    }
}

/// Invariant: a damaged cloud loads or is refused in one line
#[test]
fn every_changed_byte_loads_or_is_refused_in_one_line() {
    for encoding in ENCODINGS {
        let mut ply = Ply::new(encoding)
            .line("element face 1")
            .line("property list uchar int vertex_indices");
        ply.value("uchar", 1.0);
        ply.value("int", 0.0);
        ply.end_row();
        let bytes = ply.element("vertex", &XYZ, &cube()).bytes();
        for place in 0..bytes.len() {
            for change in [0x01, 0x10, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[place] ^= change;
                match try_load(&damaged) {
                    Ok(loaded) => assert!(loaded.cloud.len() <= 9),
                    Err(error) => assert!(!error.to_string().contains('\n')),
                }
            }
        }
    }
}

#[test]
fn a_header_full_of_notes_takes_no_longer_than_its_size() {
    let mut header = "ply\nformat ascii 1.0\n".to_owned();
    for i in 0..40_000 {
        header += &format!("comment surfelshop column c{} 40000\n", i % 20_000);
    }
    header += "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    for i in 0..40_000 {
        header += &format!("property char c_{i}\n");
    }
    let bytes = format!("{header}end_header\n0 0 0{}\n", " 1".repeat(40_000));
    assert_eq!(load(bytes.as_bytes()).cloud.columns().len(), 40_003);
}

#[test]
fn text_without_line_ends_is_refused_before_it_is_taken_into_memory() {
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n";
    let long = crate::formats::lines::MAX_LINE as u64 + 10;
    for (name, start) in [("a.ply", header), ("a.obj", "v 0 0 0\n"), ("a.off", "OFF\n2 0 0\n")] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, start).unwrap();
        // Zeros that take no room on the disk.
        let file = std::fs::File::options().append(true).open(&path).unwrap();
        file.set_len(start.len() as u64 + long).unwrap();
        let line = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        assert!(line.contains("expected at most 16777216 bytes in a line"), "{line}");
    }
    // Lines that are joined by a backslash are one.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let part = format!("f {}\\\n", "1 ".repeat(1 << 20));
    std::fs::write(&path, format!("v 0 0 0\n{}", part.repeat(9))).unwrap();
    let line = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(line.contains("line 9: expected at most 16777216 bytes in a line"), "{line}");
}

#[test]
fn a_record_whose_lists_have_no_end_is_refused_before_it_is_taken_into_memory() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty list uint uchar \
                  a\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend((100u32 << 20).to_le_bytes());
    std::fs::write(&path, &bytes).unwrap();
    let file = std::fs::File::options().append(true).open(&path).unwrap();
    file.set_len(bytes.len() as u64 + (200 << 20)).unwrap();
    let line = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(line.contains("record 0 of element `vertex`: expected at most 67108864"), "{line}");
}

#[test]
fn a_cloud_that_does_not_fit_into_memory_is_refused_before_it_is_read() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 8000000000\nproperty float \
                  x\nproperty float y\nproperty float z\nend_header\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, header).unwrap();
    let file = std::fs::File::options().append(true).open(&path).unwrap();
    // As many bytes as the header says, none of them on the disk.
    file.set_len(header.len() as u64 + 12 * 8_000_000_000).unwrap();
    let line = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(line.contains("8000000000 points are too many for this machine: 1"), "{line}");
    assert!(line.ends_with("; thin or split the file"), "{line}");
}
