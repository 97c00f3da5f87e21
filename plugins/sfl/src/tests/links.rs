//! The directories of written files, followed without the reader.

use super::clouds::{discs, write};

fn word(bytes: &[u8], place: usize) -> usize {
    u32::from_be_bytes(bytes[place..place + 4].try_into().unwrap()) as usize
}

fn short(bytes: &[u8], place: usize) -> u16 {
    u16::from_be_bytes(bytes[place..place + 2].try_into().unwrap())
}

/// What was found of a tree.
#[derive(Default)]
struct Found {
    n_directories: usize,
    /// Where data begins and ends.
    data: Vec<(usize, usize)>,
}

/// Follows siblings from a place on; how many there are, where the list ends, and what it says of the parent's next.
fn siblings(bytes: &[u8], mut place: usize, found: &mut Found) -> (usize, usize, usize) {
    for n in 0.. {
        let (mut entry, mut n_children) = (place, None);
        loop {
            let (tag, kind, count) =
                (short(bytes, entry), short(bytes, entry + 2), word(bytes, entry + 4));
            let value = word(bytes, entry + 8);
            match (tag, kind) {
                (0, 11) => {
                    assert_eq!((entry, count), (place, 1), "it only closes the list");
                    return (n, entry + 12, value);
                }
                (1, 11) => {
                    let end = found.data.last().unwrap().1;
                    assert_eq!(value, end.next_multiple_of(4), "resolutions end with their data");
                    place = value;
                    break;
                }
                (2, 12) => {
                    let (n, end, next) = siblings(bytes, value, found);
                    assert_eq!(n_children, Some(n + 1));
                    assert_eq!((end, next), (count, count), "what follows the children is next");
                    place = count;
                    break;
                }
                (3, 4) => n_children = Some(value),
                (_, 10) => found.data.push((value, value + count)),
                _ => {
                    let size = [1, 1, 2, 2, 4, 4, 4, 8, 1][usize::from(kind)];
                    assert!(tag >= 0x0100, "{tag:#06x}");
                    if size * count > 4 {
                        assert!(
                            value.is_multiple_of(4) && value + size * count <= bytes.len(),
                            "{tag:#06x}"
                        );
                    }
                }
            }
            entry += 12;
        }
        found.n_directories += 1;
    }
    unreachable!()
}

#[test]
fn links_of_written_files_lead_through_them() {
    for lens in [vec![1], vec![9, 4, 23]] {
        let clouds: Vec<_> = lens.iter().map(|&len| discs(len)).collect();
        let (bytes, _lines) = write(&clouds);
        assert_eq!(&bytes[..20], b"GFLF\0\0\0\0SFLF\0\0\0\0\0\0\0\x14");
        let mut found = Found::default();
        let (n, end, next) = siblings(&bytes, 20, &mut found);
        assert_eq!((n, end, next), (1, bytes.len(), 0), "one root, which closes the file");
        assert_eq!(found.n_directories, 2 + 2 * lens.len());
        let sizes: Vec<usize> = found.data.iter().map(|(start, end)| end - start).collect();
        // Position, normal, radius and colour.
        let expected: Vec<usize> = lens.iter().map(|len| len * 24).collect();
        assert_eq!(sizes, expected);
    }
}
