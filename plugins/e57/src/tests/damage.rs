//! Damaged files end in a line or in other values, never in a panic, and soon.

use super::round_trip::two_scans;
use super::*;
use crate::read::pages::{PAGE, PAYLOAD};

/// Gives every page its checksum, so that what was changed is read.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    for page in bytes.chunks_exact_mut(PAGE as usize) {
        let (payload, checksum) = page.split_at_mut(PAYLOAD as usize);
        checksum.copy_from_slice(&crc32c::crc32c(payload).to_be_bytes());
    }
    bytes
}

/// A file of a few hundred points, with steps, so that all kinds of fields are in it.
fn small() -> Vec<u8> {
    let mut clouds = two_scans();
    for cloud in &mut clouds {
        let keep: Vec<bool> = (0..cloud.len()).map(|i| i < 300).collect();
        for (column, values) in cloud.header.columns.iter().zip(&mut cloud.columns) {
            values.retain(column.components as usize, &keep);
        }
    }
    clouds[1].header.step = Some(surfelshop_api::glam::DVec3::splat(0.01));
    written(&clouds).0
}

fn is_a_line(error: &Error) {
    let line = error.to_string();
    assert!(!line.is_empty() && !line.contains('\n'), "{line}");
}

#[test]
fn every_truncation_is_refused() {
    let bytes = small();
    let whole = read(bytes.clone()).unwrap();
    assert_eq!(whole.clouds.len(), 2);
    for len in (0..bytes.len()).filter(|len| len % 97 == 0 || len % 1024 == 0) {
        is_a_line(&read(bytes[..len].to_vec()).unwrap_err());
    }
}

#[test]
fn flipped_bytes_are_noticed() {
    let bytes = small();
    let mut random = Random(11);
    let mut n_refused = 0;
    for _ in 0..400 {
        let mut damaged = bytes.clone();
        let place = random.below(damaged.len());
        damaged[place] ^= 1 << random.below(8);
        match read(damaged) {
            Err(error) => {
                is_a_line(&error);
                n_refused += 1;
            }
            // The header's length or a page's fill: nobody reads them.
            Ok(found) => assert_eq!(found.clouds.len(), 2, "byte {place}"),
        }
    }
    assert!(n_refused > 380, "{n_refused}");
}

#[test]
fn bytes_flipped_under_right_checksums_never_panic() {
    let bytes = small();
    let mut random = Random(12);
    let (mut n_refused, mut n_read) = (0, 0);
    for round in 0..1000 {
        let mut damaged = bytes.clone();
        // Half of the rounds in the description, at the file's end.
        let first = if round % 2 == 0 { 0 } else { bytes.len() - 8 * PAGE as usize };
        for _ in 0..=random.below(4) {
            let place = first + random.below(bytes.len() - first);
            let by = if random.below(2) == 0 { 1 << random.below(8) } else { random.next() as u8 };
            damaged[place] ^= by;
        }
        match read(sealed(damaged)) {
            Err(error) => {
                is_a_line(&error);
                n_refused += 1;
            }
            Ok(_) => n_read += 1,
        }
    }
    assert!(n_refused > 50 && n_read > 50, "{n_refused} {n_read}");
}

/// The file with a part of its description, which is at the end, replaced.
fn described(bytes: &[u8], old: &str, new: &str) -> Vec<u8> {
    let pages = bytes.chunks(PAGE as usize);
    let mut plain: Vec<u8> = pages.flat_map(|page| &page[..PAYLOAD as usize]).copied().collect();
    let found = plain.windows(old.len()).rposition(|window| window == old.as_bytes());
    let place = found.unwrap_or_else(|| panic!("no {old}"));
    plain.splice(place..place + old.len(), new.bytes());
    let xml_length = u64::from_le_bytes(plain[32..40].try_into().unwrap());
    let xml_length = xml_length + new.len() as u64 - old.len() as u64;
    plain[32..40].copy_from_slice(&xml_length.to_le_bytes());
    let page = |payload: &[u8]| {
        let mut page = payload.to_vec();
        page.resize(PAGE as usize, 0);
        page
    };
    sealed(plain.chunks(PAYLOAD as usize).flat_map(page).collect())
}

#[test]
fn announced_numbers_are_not_believed() {
    let bytes = small();
    let found = read(described(&bytes, "recordCount=\"300\"", "recordCount=\"99999999\"")).unwrap();
    assert_eq!(column(&found, 1, "intensity").len(), 300);
    assert!(
        found.warnings.iter().any(|line| line.contains("expected 99999999 points, found 300")),
        "{:?}",
        found.warnings
    );
    let found = read(described(&bytes, "recordCount=\"300\"", "recordCount=\"7\"")).unwrap();
    assert_eq!(column(&found, 1, "intensity").len(), 7);
    let line =
        read(described(&bytes, "fileOffset=\"48\"", "fileOffset=\"99\"")).unwrap_err().to_string();
    assert!(line.starts_with("scan 1: expected a section"), "{line}");
}

#[test]
fn points_that_no_byte_stands_for_are_few() {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let one = RecordDataType::Integer { min: 7, max: 7 };
    let record = |name| Record { name, data_type: one.clone() };
    let with_bit = Record { name: RecordName::RowIndex, data_type: RecordDataType::U8 };
    let mut file = io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut file, "file").unwrap();
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let mut prototype: Vec<_> = names.map(record).to_vec();
    prototype.push(with_bit);
    let mut scan = writer.add_pointcloud("scan", prototype).unwrap();
    for row in 0..5 {
        let mut values = vec![RecordValue::Integer(7); 3];
        values.push(RecordValue::Integer(row));
        scan.add_point(values).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    let bytes = file.into_inner();
    let found = read(bytes.clone()).unwrap();
    assert_eq!(column(&found, 0, "position"), [7.0; 15]);
    assert_eq!(column(&found, 0, "row_index"), [0.0, 1.0, 2.0, 3.0, 4.0]);

    let constant = described(&bytes, "maximum=\"255\"", "maximum=\"0\"");
    assert_eq!(read(constant.clone()).unwrap().clouds[0].columns[0], [7.0; 15]);
    let many = described(&constant, "recordCount=\"5\"", "recordCount=\"9999999999\"");
    let line = read(many).unwrap_err().to_string();
    assert!(line.contains("9999999999 times the same"), "{line}");
}

/// Invariant: of a header that cannot be read the line says what was found
/// Cost: milliseconds
#[test]
fn headers_that_are_none_are_refused_with_what_was_found() {
    let line = |bytes: &[u8]| read(bytes.to_vec()).unwrap_err().to_string();
    let header = small()[..48].to_vec();
    let with = |at: usize, value: u8| {
        let mut changed = header.clone();
        changed[at] = value;
        line(&changed)
    };
    for (found, expected) in [
        (
            line(b"not an E57, but text"),
            "expected an E57 header of 48 bytes, found 20: no E57 file, or cut short",
        ),
        (
            line(&header[..19]),
            "expected an E57 header of 48 bytes, found 19: the file is cut short",
        ),
        (line(b""), "expected an E57 header of 48 bytes, found 0: no E57 file, or cut short"),
        (with(0, b'B'), "expected a file that begins with ASTM-E57, found another beginning"),
        (with(12, 7), "expected E57 1.0, found 1.7"),
        (with(41, 8), "expected pages of 1024 bytes, found 2048"),
    ] {
        assert_eq!(found, expected);
    }
}
