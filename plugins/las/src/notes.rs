//! What of a file's header and records becomes comments, by what these begin with.

/// What made the points.
pub(crate) const SYSTEM: &str = "system: ";
/// What wrote the file.
pub(crate) const SOFTWARE: &str = "software: ";
/// Number of the flight line or mission.
pub(crate) const SOURCE_ID: &str = "file source id: ";
/// Number of the project, as 32 hexadecimal digits.
pub(crate) const PROJECT_ID: &str = "project id: ";
/// The three lists of `GeoTIFF` keys of a system that has no code, as hexadecimal digits.
pub(crate) const GEO_KEYS: &str = "GeoTIFF keys: ";
/// A record that is not read.
pub(crate) const NOT_READ: &str = "record not read: ";

/// All that the writer gives a place of its own.
pub(crate) const ALL: [&str; 6] = [SYSTEM, SOFTWARE, SOURCE_ID, PROJECT_ID, GEO_KEYS, NOT_READ];

/// What the first comment says that begins so.
pub(crate) fn find<'a>(comments: &'a [String], beginning: &str) -> Option<&'a str> {
    comments.iter().find_map(|comment| comment.strip_prefix(beginning))
}

/// Bytes as hexadecimal digits.
pub(crate) fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The bytes of hexadecimal digits.
fn bytes(digits: &str) -> Option<Vec<u8>> {
    if !digits.len().is_multiple_of(2) || !digits.is_ascii() {
        return None;
    }
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    digits.as_bytes().chunks_exact(2).map(byte).collect()
}

/// Sixteen bytes of their hexadecimal digits.
pub(crate) fn project_id(digits: &str) -> Option<[u8; 16]> {
    bytes(digits)?.try_into().ok()
}

/// The lists of keys as a comment; `None` where they are longer than any system needs.
pub(crate) fn of_keys(lists: &[Vec<u8>; 3]) -> Option<String> {
    const MOST: usize = 4096;
    let len: usize = lists.iter().map(Vec::len).sum();
    let texts = lists.each_ref().map(|list| digits(list));
    (len <= MOST).then(|| format!("{GEO_KEYS}{}", texts.join("/")))
}

/// The lists of keys that comments have.
pub(crate) fn keys(comments: &[String]) -> Option<[Vec<u8>; 3]> {
    let lists = find(comments, GEO_KEYS)?.split('/').map(bytes).collect::<Option<Vec<_>>>()?;
    lists.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_become_bytes_or_nothing() {
        let digits = "000102030405060708090a0b0c0d0eff";
        assert_eq!(project_id(digits).unwrap()[14..], [14, 255]);
        for wrong in
            ["", "00", "zz0102030405060708090a0b0c0d0eff", "ä00102030405060708090a0b0c0d0ef"]
        {
            assert_eq!(project_id(wrong), None, "{wrong}");
        }
        let lists = [vec![1, 0, 255], Vec::new(), b"NAD83|".to_vec()];
        let comment = of_keys(&lists).unwrap();
        assert_eq!(keys(&["other".to_owned(), comment]), Some(lists));
        for wrong in ["0100", "01/02", "1/2/3", "01/02/03/04", "//zz"] {
            assert_eq!(keys(&[format!("{GEO_KEYS}{wrong}")]), None, "{wrong}");
        }
        assert_eq!(of_keys(&[vec![0; 5000], Vec::new(), Vec::new()]), None);
    }
}
