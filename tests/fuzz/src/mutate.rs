//! Changes of good inputs, as chance and malice make them; the same for the same seed.

/// Numbers without pattern (splitmix64).
///
/// Source: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
#[derive(Clone, Copy, Debug)]
pub struct Chance(u64);

impl Chance {
    /// Numbers that follow from a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below `end`; 0 where that is 0.
    pub fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { (self.number() % end as u64) as usize }
    }
}

/// What readers of numbers stumble over.
const NUMBERS: [&str; 18] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e39",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "4294967295",
    "4294967296",
    "2147483648",
    "9223372036854775807",
    "18446744073709551615",
    "1e99999",
    "0x7f",
    ".5",
    "1.#IND",
];

/// Longest input that comes of it, bytes.
const LONGEST: usize = 1 << 17;

/// One of the seeds with a few changes, some of them taken from another one.
#[must_use]
pub fn mutated(seeds: &[Vec<u8>], chance: &mut Chance) -> Vec<u8> {
    let Some(seed) = seeds.get(chance.below(seeds.len())) else { return Vec::new() };
    let mut bytes = seed.clone();
    for _ in 0..1 + chance.below(4) {
        change(&mut bytes, seeds, chance);
    }
    bytes.truncate(LONGEST);
    bytes
}

fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], chance: &mut Chance) {
    let at = chance.below(bytes.len());
    let length = 1 + chance.below(64).min(bytes.len().saturating_sub(at + 1));
    let end = (at + length).min(bytes.len());
    match chance.below(11) {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << chance.below(8),
        1 if !bytes.is_empty() => bytes[at] = chance.number() as u8,
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..end)),
        4 => {
            let piece = bytes[at..end].to_vec();
            let times = 1 + chance.below(20);
            bytes.splice(at..at, piece.repeat(times));
        }
        5 => {
            // A piece of another seed in the place of one of this.
            let Some(other) = seeds.get(chance.below(seeds.len())) else { return };
            let from = chance.below(other.len());
            let to = (from + 1 + chance.below(256)).min(other.len());
            bytes.splice(at..end, other[from..to].iter().copied());
        }
        6 => number(bytes, chance),
        7 => {
            let words = [0u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x7f80_0000, 0x7fc0_0000];
            let word = words[chance.below(words.len())].to_le_bytes();
            let end = (at + 4).min(bytes.len());
            bytes.splice(at..end, word);
        }
        8 => line_again(bytes, at, chance),
        // A long run of one byte, rarely as long as the input may be: a line that does not end.
        9 => {
            let length = if chance.below(8) == 0 { LONGEST } else { 1 << chance.below(12) };
            let byte = [b'0', b' ', b'\0', b'a'][chance.below(4)];
            bytes.splice(at..at, std::iter::repeat_n(byte, length));
        }
        _ => {
            let what: &[u8] = [&b"\n"[..], b"\0", b" ", b"\xff", b"\x1b[31m", b"\r", b"#", b"\""]
                [chance.below(8)];
            bytes.splice(at..at, what.iter().copied());
        }
    }
}

/// The line around a place, some more times.
fn line_again(bytes: &mut Vec<u8>, at: usize, chance: &mut Chance) {
    let is_break = |byte: &u8| *byte == b'\n';
    let start = bytes[..at].iter().rposition(is_break).map_or(0, |before| before + 1);
    let end = bytes[at..].iter().position(is_break).map_or(bytes.len(), |length| at + length + 1);
    let line = bytes[start..end].to_vec();
    // Long ones once or twice, so that it stays a small file.
    let times = 1 << chance.below(if line.len() > 256 { 2 } else { 8 });
    bytes.splice(start..start, line.repeat(times));
}

/// Another number in the place of one that is written in digits.
fn number(bytes: &mut Vec<u8>, chance: &mut Chance) {
    let digits: Vec<usize> =
        (0..bytes.len().min(1 << 14)).filter(|&at| bytes[at].is_ascii_digit()).collect();
    let Some(&start) = digits.get(chance.below(digits.len())) else { return };
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || b".e+-".contains(byte);
    let end = bytes[start..].iter().position(|byte| !is_of_number(byte));
    let end = end.map_or(bytes.len(), |length| start + length);
    let new = NUMBERS[chance.below(NUMBERS.len())];
    bytes.splice(start..end, new.bytes());
}
