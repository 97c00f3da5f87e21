//! Coordinate systems as `GeoTIFF` keys.

use crate::numbers::{f64_at, part, text, u16_at};

/// The US survey foot, in metres.
const US_FOOT: f64 = 1200.0 / 3937.0;

/// What the keys say.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Keys {
    /// The EPSG code of a projected system.
    pub(super) projected: Option<u16>,
    /// The EPSG code of a geographic system.
    pub(super) geographic: Option<u16>,
    /// Metres of a unit of the plane; 0 where unknown.
    pub(super) metres_per_unit: f64,
    /// Metres of a unit of heights; 0 where unknown.
    pub(super) metres_per_height: f64,
    /// Citations.
    pub(super) comments: Vec<String>,
}

/// A code of a register; 0 and 32767 say that there is none.
fn registered(code: u16) -> Option<u16> {
    (code != 0 && code != 32767).then_some(code)
}

fn metres(code: u16) -> f64 {
    match code {
        9001 => 1.0,
        9002 => 0.3048,
        9003 => US_FOOT,
        _ => 0.0,
    }
}

impl Keys {
    /// The keys of a directory, whose long values lie in lists of floats and of texts.
    pub(super) fn of(directory: &[u8], floats: &[u8], texts: &[u8]) -> Self {
        let mut keys = Self::default();
        let n_keys = usize::from(u16_at(directory, 6));
        for entry in part(directory, 8, n_keys * 8).chunks_exact(8) {
            let [key, location, count, value] = [0, 2, 4, 6].map(|at| u16_at(entry, at));
            let float = || match location {
                34736 => f64_at(floats, usize::from(value) * 8),
                _ => 0.0,
            };
            let size = || Some(float()).filter(|size| size.is_finite() && *size > 0.0);
            match (key, location) {
                (2048, 0) => keys.geographic = registered(value),
                (3072, 0) => keys.projected = registered(value),
                (3076, 0) if value != 32767 => keys.metres_per_unit = metres(value),
                (3077, _) => keys.metres_per_unit = size().unwrap_or(keys.metres_per_unit),
                (4099, 0) => keys.metres_per_height = metres(value),
                (1026 | 3073 | 4097, 34737) => {
                    let citation = part(texts, usize::from(value), usize::from(count));
                    let citation = text(citation);
                    let citation = citation.trim_end_matches('|').trim();
                    if !citation.is_empty() {
                        keys.comments.push(format!("coordinate system: {citation}"));
                    }
                }
                _ => {}
            }
        }
        keys
    }
}

/// The directory of keys of an EPSG code, with a unit of lengths where it is one that has a code.
pub(crate) fn keys_of(code: u16, metres_per_unit: f64) -> Vec<u8> {
    // Codes of geographic systems lie together in the register.
    let is_geographic = (4000..5000).contains(&code);
    let (model, key) = if is_geographic { (2, 2048) } else { (1, 3072) };
    let mut keys: Vec<[u16; 4]> = vec![[1024, 0, 1, model], [1025, 0, 1, 1], [key, 0, 1, code]];
    let unit = [9001, 9002, 9003]
        .into_iter()
        .find(|&unit| metres_per_unit > 0.0 && (metres(unit) / metres_per_unit - 1.0).abs() < 1e-7);
    if let Some(unit) = unit.filter(|_| !is_geographic) {
        keys.push([3076, 0, 1, unit]);
    }
    let n_keys = keys.len() as u16;
    let all = std::iter::once([1, 1, 0, n_keys]).chain(keys);
    all.flatten().flat_map(u16::to_le_bytes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_units_come_back() {
        for (code, unit, expected) in
            [(26912, 1.0, 1.0), (2992, 0.3048, 0.3048), (2225, US_FOOT, US_FOOT), (3857, 0.7, 0.0)]
        {
            let keys = Keys::of(&keys_of(code, unit), &[], &[]);
            assert_eq!((keys.projected, keys.metres_per_unit), (Some(code), expected));
        }
        assert_eq!(Keys::of(&keys_of(4326, 0.0), &[], &[]).geographic, Some(4326));
    }

    #[test]
    fn lists_that_end_early_and_values_of_nobody_are_passed_over() {
        let mut directory = keys_of(32767, 1.0);
        directory[6] = 200;
        directory.extend([3073u16, 34737, 5, 2].into_iter().flat_map(u16::to_le_bytes));
        directory.extend([3077u16, 34736, 1, 9].into_iter().flat_map(u16::to_le_bytes));
        directory.pop();
        let keys = Keys::of(&directory, &[], b"a|NAD|");
        assert_eq!(keys.projected, None);
        assert_eq!(keys.metres_per_unit, 1.0);
        assert_eq!(keys.comments, ["coordinate system: NAD"]);
    }
}
