use super::*;
use crate::format::file_types::FileTypes;
use crate::need::NeedInfo;

const PACKAGE: PackageInfo = PackageInfo {
    id: "org.example.test",
    version: "1.2.3",
    authors: "A:B",
    license: "MIT",
    abi: (ABI_MAJOR, ABI_MINOR),
};
const UNITS: &[(UnitKind, UnitInfo)] =
    &[(UnitKind::Renderer, UnitInfo::new("one", "One", "The first."))];
const BYTES: [u8; encoded_len(&PACKAGE, UNITS)] = encode(&PACKAGE, UNITS);

#[test]
fn manifests_round_trip() {
    let manifest = decode(&BYTES).unwrap();
    assert_eq!(manifest.id, "org.example.test");
    assert_eq!(manifest.authors, "A:B");
    assert_eq!(manifest.units[0].summary, "The first.");
}

#[test]
fn files_of_formats_are_read_back_and_damaged_ones_recognise_nothing() {
    const FILES: FileTypes = FileTypes::new()
        .ending("las")
        .ending("laz")
        .magic(12, b"LAS\xff")
        .magic(0, b"x")
        .written()
        .beside("octree.bin")
        .beside("*.bin");
    const UNITS: &[(UnitKind, UnitInfo)] = &[
        (UnitKind::Format, UnitInfo::new("las", "LAS", "Reads LAS.").recognising(FILES)),
        (UnitKind::Tool, UnitInfo::new("other", "Other", "Does.")),
    ];
    const BYTES: [u8; encoded_len(&PACKAGE, UNITS)] = encode(&PACKAGE, UNITS);
    let units = decode(&BYTES).unwrap().units;
    let files = &units[0].files;
    assert_eq!(files.endings, ["las", "laz"]);
    assert_eq!(files.magics[0], Magic { offset: 12, bytes: b"LAS\xff".to_vec() });
    assert_eq!((files.magics.len(), files.written, files.several), (2, true, false));
    assert_eq!(files.beside, ["octree.bin", "*.bin"]);
    assert_eq!(units[1].files, Recognition::default());
    let mut damaged = Recognition::default();
    for (key, values) in [
        ("magic", ["99999999999", "41"]),
        ("magic", ["63", "4142"]),
        ("magic", ["0", "4x"]),
        ("ending", ["a b", ""]),
        ("beside", ["../octree.bin", ""]),
        ("beside", ["*", ""]),
        ("beside", ["", ""]),
        ("beside", ["*bin", ""]),
    ] {
        let mut values = values.into_iter();
        files_line(&mut damaged, key, || values.next().unwrap_or_default().to_owned());
    }
    assert_eq!(damaged, Recognition::default());
}

#[test]
fn needs_of_renderers_are_read_back() {
    const NEEDS: &[NeedInfo] =
        &[NeedInfo::column("splat_scale", 2), NeedInfo::column("sh_3", 21).optional()];
    const UNITS: &[(UnitKind, UnitInfo)] =
        &[(UnitKind::Renderer, UnitInfo::new("one", "One", "The first.").reading(NEEDS))];
    const BYTES: [u8; encoded_len(&PACKAGE, UNITS)] = encode(&PACKAGE, UNITS);
    let units = decode(&BYTES).unwrap().units;
    assert_eq!(units[0].needs, [Need::from(&NEEDS[0])]);
}

#[test]
fn how_tools_are_handled_is_read_back() {
    const TOOL: UnitInfo = UnitInfo::new("one", "One", "The first.");
    const UNITS: &[(UnitKind, UnitInfo)] = &[
        (UnitKind::Tool, TOOL.handled(crate::Handling::STROKE)),
        (UnitKind::Tool, TOOL.handled(crate::Handling::Cloud)),
    ];
    const BYTES: [u8; encoded_len(&PACKAGE, UNITS)] = encode(&PACKAGE, UNITS);
    let units = decode(&BYTES).unwrap().units;
    assert_eq!([&*units[0].handling, &*units[1].handling], ["stroke", ""]);
    assert_eq!(least_minor(&[11], UNITS), 11);
    assert!(std::panic::catch_unwind(|| least_minor(&[10], UNITS)).is_err());
}

#[test]
fn a_package_names_the_oldest_version_that_will_do() {
    assert_eq!(least_minor(&[], UNITS), ABI_MINOR);
    assert_eq!(least_minor(&[4], UNITS), 4);
    const FORMAT: &[(UnitKind, UnitInfo)] =
        &[(UnitKind::Format, UnitInfo::new("las", "LAS", "Reads LAS."))];
    assert_eq!(least_minor(&[8], FORMAT), 8);
    for (said, units) in [(ABI_MINOR + 1, UNITS), (7, FORMAT)] {
        assert!(std::panic::catch_unwind(|| least_minor(&[said], units)).is_err(), "{said}");
    }
    const PACKAGE_4: PackageInfo =
        PackageInfo { abi: (ABI_MAJOR, least_minor(&[4], UNITS)), ..PACKAGE };
    const BYTES_4: [u8; encoded_len(&PACKAGE_4, UNITS)] = encode(&PACKAGE_4, UNITS);
    assert_eq!(decode(&BYTES_4).unwrap().abi_minor, 4);
}

#[test]
fn every_truncation_is_refused() {
    for len in 0..BYTES.len() {
        assert!(matches!(decode(&BYTES[..len]), Err(Refusal::Malformed(_))), "{len}");
    }
}

#[test]
fn other_major_and_newer_minor_are_refused_with_both_versions() {
    let mut bytes = BYTES;
    bytes[16] = 9;
    let text = decode(&bytes).unwrap_err().to_string();
    let host = format!("speaks {ABI_MAJOR}.{ABI_MINOR}");
    assert!(text.contains(&format!("ABI 9.{ABI_MINOR}")) && text.contains(&host), "{text}");
    bytes[16] = ABI_MAJOR as u8;
    bytes[18] = 200;
    let plugin = (ABI_MAJOR, 200);
    let newer = Refusal::Incompatible { plugin, host: (ABI_MAJOR, ABI_MINOR) };
    assert_eq!(decode(&bytes), Err(newer));
}

#[test]
fn absurd_lengths_are_refused() {
    let mut bytes = BYTES;
    bytes[20..24].fill(0xff);
    assert!(matches!(decode(&bytes), Err(Refusal::Malformed(_))));
}
