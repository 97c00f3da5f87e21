//! What of a file's header and records becomes comments, by what these begin with.

/// What made the points.
pub(crate) const SYSTEM: &str = "system: ";
/// What wrote the file.
pub(crate) const SOFTWARE: &str = "software: ";
/// Number of the flight line or mission.
pub(crate) const SOURCE_ID: &str = "file source id: ";
/// Number of the project, as 32 hexadecimal digits.
pub(crate) const PROJECT_ID: &str = "project id: ";
/// A record that is not read.
pub(crate) const NOT_READ: &str = "record not read: ";

/// All that the writer gives a place of its own.
pub(crate) const ALL: [&str; 5] = [SYSTEM, SOFTWARE, SOURCE_ID, PROJECT_ID, NOT_READ];

/// What the first comment says that begins so.
pub(crate) fn find<'a>(comments: &'a [String], beginning: &str) -> Option<&'a str> {
    comments.iter().find_map(|comment| comment.strip_prefix(beginning))
}

/// Sixteen bytes of their hexadecimal digits.
pub(crate) fn project_id(digits: &str) -> Option<[u8; 16]> {
    let mut bytes = [0; 16];
    if digits.len() != 32 || !digits.is_ascii() {
        return None;
    }
    for (byte, pair) in bytes.iter_mut().zip(digits.as_bytes().chunks_exact(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(bytes)
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
    }
}
