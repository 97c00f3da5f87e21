//! Directories: sets, resolutions, what the root says, and files whose counts or offsets are not what they should be.

use super::clouds::{column, read};
use super::files::{Made, bytes_of, file_behind, file_of, resolution, root_of, set};

/// A set of positions (x, 0, 0) without resolutions.
fn positions() -> Made {
    set(1, 12, &[1], &[(0, 0)])
}

/// A resolution of surfels at these x.
fn at(xs: &[f32]) -> Made {
    let records: Vec<u8> = xs.iter().flat_map(|&x| bytes_of(&[x, 0.0, 0.0])).collect();
    resolution(xs.len() as u32, &records)
}

/// The x of all surfels, set by set.
fn xs(bytes: &[u8]) -> Vec<Vec<f64>> {
    let clouds = read(bytes).unwrap().clouds;
    clouds.iter().map(|cloud| column(cloud, "position").into_iter().step_by(3).collect()).collect()
}

#[test]
fn every_set_is_a_cloud_in_its_full_resolution() {
    let first = positions().text(0x0162, "first").words(0x0140, &[3]);
    let first = first.child(at(&[1.0])).child(at(&[2.0, 3.0])).child(at(&[4.0, 5.0, 6.0]));
    let second = positions().words(0x0140, &[2]).words(0x0141, &[0]);
    let second = second.child(at(&[7.0, 8.0])).child(at(&[9.0]));
    let bytes = file_of(vec![first, second]);
    assert_eq!(xs(&bytes), [vec![4.0, 5.0, 6.0], vec![7.0, 8.0]]);
    let found = read(&bytes).unwrap();
    let headers: Vec<_> = found.clouds.iter().map(|cloud| &cloud.header).collect();
    assert_eq!((headers[0].name.as_str(), headers[1].name.as_str()), ("first", "surfelSet01"));
    assert_eq!(headers[0].comments, ["2 other resolutions of the set are not read"]);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let beyond = positions().words(0x0140, &[2]).words(0x0141, &[7]);
    let bytes = file_of(vec![beyond.child(at(&[1.0])).child(at(&[2.0]))]);
    assert_eq!(xs(&bytes), [[2.0]]);
    assert!(read(&bytes).unwrap().warnings[0].contains("number 7 of 2"));
}

#[test]
fn the_scene_is_told_in_comments() {
    let root = root_of(vec![positions().shorts(0x0163, &[1, 2, 3]).child(at(&[1.0]))])
        .text(0x0100, "A\n title")
        .text(0x0101, "au")
        .text(0x0102, "program")
        .with(0x0103, 8, 8, b"caf\xe9\0xyz".to_vec())
        .text(0x0105, "1 May 2004")
        .words(0x0104, &[7])
        .doubles(0x0113, &[0.001])
        .with(0x7777, 99, 1, vec![0; 4]);
    let found = read(&file_behind(&[], &root)).unwrap();
    let header = &found.clouds[0].header;
    let expected = [
        "title: A title",
        "author: au",
        "application: program",
        "description: caf\u{e9}",
        "date: 1 May 2004",
        "version: 7",
        "markers of surfels are not read: 3 numbers",
    ];
    assert_eq!(header.comments, expected);
    assert_eq!((header.time.as_str(), header.metres_per_unit), ("1 May 2004", 0.001));
    assert!(header.format.starts_with("SFL, surfel format 1"), "{}", header.format);
}

/// A file whose only resolution has no count, and a length and a link that wrapped.
fn streamed(xs: &[f32]) -> Vec<u8> {
    let mut bytes = file_of(vec![positions().child(at(xs))]);
    let count = bytes.windows(4).position(|w| w == [0x01, 0x70, 0, 4]).unwrap();
    bytes[count + 8..count + 12].fill(0xff);
    bytes[count + 16..count + 20].copy_from_slice(&0xffff_fff4_u32.to_be_bytes());
    bytes[count + 32..count + 36].copy_from_slice(&0x1234_u32.to_be_bytes());
    bytes
}

#[test]
fn counts_that_were_not_known_are_found() {
    let bytes = streamed(&[1.0, 2.0, 3.0]);
    assert_eq!(xs(&bytes), [[1.0, 2.0, 3.0]]);
    assert!(read(&bytes).unwrap().warnings[0].contains("without a count"));
    // The set does not know its next one: what closes the file tells the end.
    let mut lost = bytes.clone();
    let downlink = lost.windows(4).enumerate().filter(|(_, w)| *w == [0, 2, 0, 12]);
    let set = downlink.map(|(place, _)| place).nth(2).unwrap();
    lost[set + 4..set + 8].fill(0xff);
    assert_eq!(xs(&lost), [[1.0, 2.0, 3.0]]);
    // A file that is cut short has the surfels that are whole.
    let cut = &bytes[..bytes.len() - 48 - 5];
    assert_eq!(xs(cut), [[1.0, 2.0]]);
}

#[test]
fn counts_that_are_not_known_before_other_resolutions_are_refused() {
    let mut coarse = at(&[1.0]).without(0x0170);
    coarse = coarse.words(0x0170, &[u32::MAX]);
    let made = positions().words(0x0140, &[2]).words(0x0141, &[0]);
    let line = read(&file_of(vec![made.child(coarse).child(at(&[2.0]))])).unwrap_err().to_string();
    assert!(line.contains("other resolutions follow"), "{line}");
}

#[test]
fn a_stray_byte_behind_the_header_is_skipped() {
    let root = root_of(vec![positions().child(at(&[1.0, 2.0]))]);
    // Offsets that count the byte, and such that do not.
    let counted = file_behind(&[0x5a], &root);
    let mut shifted = file_behind(&[], &root);
    shifted.insert(20, 0x5a);
    for bytes in [counted, shifted] {
        assert_eq!(xs(&bytes), [[1.0, 2.0]]);
        assert!(read(&bytes).unwrap().warnings[0].contains("stray byte"));
    }
    // Without a count, too.
    let mut bytes = streamed(&[1.0, 2.0, 3.0]);
    bytes.insert(20, 0);
    assert_eq!(xs(&bytes), [[1.0, 2.0, 3.0]]);
}

/// Where directories begin whose first entry has a tag.
fn places(bytes: &[u8], tag: u16) -> Vec<usize> {
    let tag = tag.to_be_bytes();
    let found = (20..bytes.len() - 1).step_by(4).filter(|&place| bytes[place..place + 2] == tag);
    found.collect()
}

#[test]
fn circles_of_links_end() {
    let set = |x: f32| positions().words(0x0140, &[1]).child(at(&[x]));
    let bytes = file_of(vec![set(1.0), set(2.0)]);
    let first = places(&bytes, 0x0150)[0];
    let links: Vec<usize> = places(&bytes, 2);
    // The links of the root, the list, the first set, the second set.
    assert_eq!(links.len(), 4);
    let with_next = |link: usize, next: usize| {
        let mut bytes = bytes.clone();
        bytes[link + 4..link + 8].copy_from_slice(&(next as u32).to_be_bytes());
        bytes
    };
    // Both sets lead back to the first.
    for link in [links[2], links[3]] {
        let bytes = with_next(link, first);
        let found = read(&bytes).unwrap();
        assert!(found.clouds.len() <= 2, "{}", found.clouds.len());
        assert!(found.warnings[0].contains("circle"), "{:?}", found.warnings);
    }
    // The list is its own child, and a set the list's.
    for child in [20, first] {
        let mut bytes = bytes.clone();
        bytes[links[0] + 8..links[0] + 12].copy_from_slice(&(child as u32).to_be_bytes());
        let line = read(&bytes).unwrap_err().to_string();
        assert!(!line.is_empty());
    }
    // A resolution that leads to itself is the only one.
    let made = positions().words(0x0140, &[2]).child(at(&[1.0])).child(at(&[2.0]));
    let mut bytes = file_of(vec![made]);
    let resolution = places(&bytes, 0x0170)[0];
    bytes[resolution + 32..resolution + 36].copy_from_slice(&(resolution as u32).to_be_bytes());
    assert!(read(&bytes).unwrap_err().to_string().contains("circle"));
}

#[test]
fn sets_that_share_data_are_refused() {
    let set = |x: f32| positions().child(at(&[x; 40]));
    let mut bytes = file_of(vec![set(1.0), set(2.0), set(3.0)]);
    let data = places(&bytes, 0x0171);
    assert_eq!(data.len(), 3);
    // All three begin with the data of the first and go on to the file's end.
    let start = bytes[data[0] + 8..data[0] + 12].to_vec();
    for data in data {
        bytes[data + 8..data + 12].copy_from_slice(&start);
        bytes[data + 4..data + 8].copy_from_slice(&1_200_u32.to_be_bytes());
        bytes[data - 4..data].copy_from_slice(&100_u32.to_be_bytes());
    }
    let line = read(&bytes).unwrap_err().to_string();
    assert!(line.contains("share"), "{line}");
}
