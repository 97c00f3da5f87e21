//! Files that are refused before any of their code runs.

use crate::plugins::fixture::{
    PluginFolder, assert_good_plugin_works, assert_refused, assert_says, entry, faulty,
    faulty_bytes, find, replaced,
};
use surfelshop_api::manifest::{self, ABI_MAJOR, ABI_MINOR, HEADER_LEN};
use surfelshop_runtime::plugins::{Origin, Place, Registry, inspect, inspect_bytes};

#[test]
fn the_library_itself_is_accepted() {
    let (manifest, _) = inspect(&faulty()).unwrap();
    assert_eq!(manifest.id, crate::plugins::fixture::FAULTY);
    assert_eq!((manifest.abi_major, manifest.abi_minor), (ABI_MAJOR, ABI_MINOR));
    assert!(manifest.units.iter().any(|unit| unit.id == "fine"));
}

#[test]
fn empty_file() {
    assert_refused(b"", &["is empty"]);
}

#[test]
fn garbage() {
    let bytes: Vec<u8> =
        (0..10_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    assert_refused(&bytes, &["is not a shared library (first bytes \"\\x00\\x9e"]);
}

#[test]
fn text_file_with_the_name_of_a_library() {
    assert_refused(b"hi", &["is not a shared library (first bytes \"hi\")"]);
    assert_refused(b"\x1b[2J this is a text\n", &["is not a shared library", "\\x1b[2J this"]);
}

#[test]
fn first_half_of_a_library() {
    let bytes = faulty_bytes();
    assert_refused(&bytes[..bytes.len() / 2], &["is cut off: its headers need", "build or copy"]);
}

#[test]
fn library_without_its_last_bytes() {
    let bytes = faulty_bytes();
    let found = format!("the file has {}", bytes.len() - 100);
    assert_refused(&bytes[..bytes.len() - 100], &["is cut off", &found]);
}

/// Invariant: damaged plugin files are refused before they are loaded
#[test]
fn every_shorter_file_is_refused() {
    let bytes = faulty_bytes();
    // The headers at the front, byte by byte, then the rest in steps that share no factor with
    // any alignment.
    for len in (0..512).chain((512..bytes.len() - 1).step_by(104_729)) {
        let refused = inspect_bytes(&bytes[..len]);
        assert!(refused.is_err(), "accepted with {len} of {} bytes", bytes.len());
    }
}

#[test]
fn damaged_headers_never_panic() {
    let whole = faulty_bytes();
    let mut bytes = whole.clone();
    let tables = (0..1024).chain(whole.len() - 2048..whole.len());
    for i in tables.step_by(3) {
        for value in [0, 0x7f, 0xff] {
            bytes[i] = value;
            if let Err(refused) = inspect_bytes(&bytes) {
                assert_says(&refused.to_string(), &[]);
            }
        }
        bytes[i] = whole[i];
    }
}

#[test]
fn other_abi_major() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + 16..at + 18].copy_from_slice(&(ABI_MAJOR + 6).to_le_bytes());
    let speaks = format!("speaks ABI {}.{ABI_MINOR}", ABI_MAJOR + 6);
    assert_refused(&bytes, &[&speaks, "this host speaks", "update Surfelshop"]);
}

#[test]
fn older_abi_major() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + 16..at + 18].copy_from_slice(&0u16.to_le_bytes());
    assert_refused(&bytes, &["speaks ABI 0.", "rebuild the plugin"]);
}

#[test]
fn newer_abi_minor() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + 18..at + 20].copy_from_slice(&(ABI_MINOR + 3).to_le_bytes());
    let speaks = format!("speaks ABI {ABI_MAJOR}.{}", ABI_MINOR + 3);
    assert_refused(&bytes, &[&speaks, "update Surfelshop"]);
}

#[test]
fn damaged_manifest_magic() {
    let bytes = replaced(faulty_bytes(), &manifest::MAGIC, b"surfelshop-plug\n");
    assert_refused(&bytes, &["manifest is damaged", "magic bytes are wrong"]);
}

#[test]
fn absurd_manifest_length() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + 20..at + 24].fill(0xff);
    assert_refused(&bytes, &["manifest is damaged", "its text has 4294967295 bytes"]);
}

#[test]
fn manifest_length_that_takes_in_other_bytes() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    let len = u32::from_le_bytes(bytes[at + 20..at + 24].try_into().unwrap());
    // The text then ends in the middle of the line that names the first unit's summary.
    bytes[at + 20..at + 24].copy_from_slice(&(len / 64).to_le_bytes());
    assert_refused(&bytes, &["manifest is damaged"]);
}

#[test]
fn manifest_without_text() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + 20..at + 24].fill(0);
    assert_refused(&bytes, &["manifest is damaged", "it names no package id"]);
}

#[test]
fn manifest_that_writes_to_the_terminal() {
    let bytes = replaced(faulty_bytes(), b"Shows the albedo.", b"Shows \x1b[31mlbedo.");
    assert_refused(&bytes, &["manifest is damaged", "do not show", "\\u{1b}[31m"]);
}

#[test]
fn manifest_whose_text_is_not_what_it_shows() {
    // Written from right to left from there on.
    let bytes = replaced(faulty_bytes(), b"Shows the albedo.", "Shows \u{202e} albedo.".as_bytes());
    assert_refused(&bytes, &["manifest is damaged", "do not show", "\\u{202e}"]);
}

#[test]
fn manifest_with_two_units_of_one_name() {
    let bytes = replaced(faulty_bytes(), b"renderer\tpanics-in-drop", b"renderer\tpanics-in-new\t");
    assert_refused(&bytes, &["manifest is damaged", "it exports two renderers `panics-in-new`"]);
}

#[test]
fn manifest_with_a_package_id_that_is_a_path() {
    let bytes = replaced(faulty_bytes(), b"id\torg.surfelshop", b"id\t../surfelshops");
    assert_refused(&bytes, &["manifest is damaged", "is no package id"]);
}

#[test]
fn manifest_that_is_not_utf8() {
    let mut bytes = faulty_bytes();
    let at = find(&bytes, &manifest::MAGIC);
    bytes[at + HEADER_LEN + 5] = 0xff;
    assert_refused(&bytes, &["manifest is damaged", "not UTF-8"]);
}

#[test]
fn manifest_and_no_function_table() {
    let bytes = replaced(faulty_bytes(), b"SURFELSHOP_PLUGIN\0", b"SURFELSHOP_PLUGGG\0");
    assert_refused(&bytes, &["has a plugin manifest", "does not export `SURFELSHOP_PLUGIN`"]);
}

#[test]
fn library_without_manifest() {
    let bytes = replaced(faulty_bytes(), b"SURFELSHOP_MANIFEST\0", b"SURFELSHOP_MANIFOLD\0");
    assert_refused(&bytes, &["is a shared library but no Surfelshop plugin", "export_plugin!"]);
}

#[test]
#[cfg(target_os = "linux")]
fn system_library() {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let libc = maps.split_whitespace().find(|word| word.contains("/libc.so")).unwrap();
    assert_refused(
        &std::fs::read(libc).unwrap(),
        &["is a shared library but no Surfelshop plugin", "SURFELSHOP_MANIFEST"],
    );
}

#[test]
#[cfg(unix)]
fn program_instead_of_library() {
    // Programs that may be moved in memory look like libraries; both answers are right.
    let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
    assert_refused(&bytes, &["is a"]);
}

#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn other_processor() {
    let mut bytes = faulty_bytes();
    // Bytes 18 and 19 of an ELF file name the CPU; 183 is 64-bit Arm.
    bytes[18..20].copy_from_slice(&183u16.to_le_bytes());
    assert_refused(&bytes, &["is built for aarch64 64-bit Linux", "this host is x86_64 64-bit"]);
    bytes[18..20].copy_from_slice(&0xfff0u16.to_le_bytes());
    assert_refused(&bytes, &["an unknown processor"]);
}

#[test]
#[cfg(target_os = "linux")]
fn other_system() {
    let mut bytes = faulty_bytes();
    // Byte 7 of an ELF file names the system; 9 is FreeBSD.
    bytes[7] = 9;
    assert_refused(&bytes, &["64-bit FreeBSD", "64-bit Linux: build it for this machine"]);
}

#[test]
#[cfg(target_os = "linux")]
fn object_file() {
    let mut bytes = faulty_bytes();
    // Bytes 16 and 17 of an ELF file name its type; 1 is a relocatable object.
    bytes[16..18].copy_from_slice(&1u16.to_le_bytes());
    assert_refused(&bytes, &["is an object file, expected a shared library"]);
}

#[test]
fn folder_with_the_name_of_a_library() {
    let shelf = PluginFolder::with_good_plugin();
    let path = shelf.at("hostile");
    std::fs::create_dir(&path).unwrap();
    let registry = shelf.scan();
    assert_says(&entry(&registry, &path).refusal().unwrap(), &["is a folder, expected a shared"]);
    assert_good_plugin_works(&registry);
}

#[test]
fn missing_file_of_the_command_line() {
    let shelf = PluginFolder::with_good_plugin();
    let mut search = shelf.search();
    search.files.push(Place::new(shelf.at("missing"), Origin::CommandLine));
    search.folders.push(Place::new(shelf.path().join("missing"), Origin::UserFolder));
    let registry = Registry::scan(&search);
    let refusal = entry(&registry, &shelf.at("missing")).refusal().unwrap();
    assert_says(&refusal, &["missing", "does not exist"]);
    assert_eq!(registry.entries().len(), 2, "a missing folder is fine");
    assert_good_plugin_works(&registry);
}

#[test]
#[cfg(unix)]
fn pipe_with_the_name_of_a_library() {
    let shelf = PluginFolder::with_good_plugin();
    let path = shelf.at("hostile");
    let made = std::process::Command::new("mkfifo").arg(&path).status().unwrap();
    assert!(made.success());
    let registry = shelf.scan();
    assert_says(&entry(&registry, &path).refusal().unwrap(), &["is no regular file"]);
    assert_good_plugin_works(&registry);
}

#[test]
#[cfg(unix)]
fn huge_file() {
    let shelf = PluginFolder::with_good_plugin();
    let path = shelf.put("hostile", &faulty_bytes());
    // Two terabytes, none of them on the disk.
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    if file.set_len(2 << 40).is_err() {
        return; // The file system has a lower limit, so such a file cannot appear here.
    }
    let registry = shelf.scan();
    assert_says(&entry(&registry, &path).refusal().unwrap(), &["at most 1073741824"]);
    assert_good_plugin_works(&registry);
}
