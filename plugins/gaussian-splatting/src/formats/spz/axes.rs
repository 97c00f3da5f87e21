//! The axes that an extension names.

use surfelshop_api::format::UpAxis;

/// Where x, y and z point: right, left, up, down, back (towards the viewer) or front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axes(&'static [u8; 3]);

/// Axes by their numbers in files, from 1.
const NAMES: [&[u8; 3]; 16] = [
    b"LDB", b"RDB", b"LUB", b"RUB", b"LDF", b"RDF", b"LUF", b"RUF", b"LFD", b"RFD", b"LFU", b"RFU",
    b"LBD", b"RBD", b"LBU", b"RBU",
];

/// The number of the extension that names axes.
const EXTENSION: u32 = 0xadbe_0003;

impl Default for Axes {
    fn default() -> Self {
        Self(b"RUB")
    }
}

impl Axes {
    /// The axes that records of extensions name: each a number, a length and so many bytes.
    pub(super) fn of_extensions(mut records: &[u8]) -> Self {
        while let Some((head, rest)) = records.split_first_chunk::<8>() {
            let (words, _) = head.as_chunks::<4>();
            let [kind, len] = [0, 1].map(|i| u32::from_le_bytes(words[i]));
            let Some((value, rest)) = rest.split_at_checked(len as usize) else { break };
            if let (EXTENSION, Some((number, _))) = (kind, value.split_first_chunk::<4>()) {
                let number = u32::from_le_bytes(*number) as usize;
                let named = number.checked_sub(1).and_then(|i| NAMES.get(i));
                return named.map_or(Self::default(), |name| Self(name));
            }
            records = rest;
        }
        Self::default()
    }

    /// The axis that points up.
    pub(super) fn up(self) -> UpAxis {
        match self.0 {
            [_, b'U', _] => UpAxis::Y,
            [_, _, b'U'] => UpAxis::Z,
            _ => UpAxis::Unknown,
        }
    }

    /// Whether axes are those of a left hand, so that everything appears mirrored.
    pub(super) fn is_mirrored(self) -> bool {
        // Turning one round, or exchanging two, makes the other hand of right, up, back.
        let turned = [b"LDF".as_slice(), b"LFD"].concat();
        let n_turned = self.0.iter().filter(|letter| turned.contains(letter)).count();
        let exchanged = matches!(self.0, [_, b'F' | b'B', _]);
        (n_turned + usize::from(exchanged)) % 2 == 1
    }

    /// The letters.
    pub(super) fn name(self) -> String {
        String::from_utf8_lossy(self.0).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_a_hand_and_an_up() {
        let find = |name: &[u8; 3]| Axes(NAMES.into_iter().find(|known| *known == name).unwrap());
        for (name, up, mirrored) in [
            (b"RUB", UpAxis::Y, false),
            (b"RDF", UpAxis::Unknown, false),
            (b"LUF", UpAxis::Y, false),
            (b"RUF", UpAxis::Y, true),
            (b"RFU", UpAxis::Z, false),
            (b"RBU", UpAxis::Z, true),
        ] {
            let axes = find(name);
            assert_eq!((axes.up(), axes.is_mirrored()), (up, mirrored), "{}", axes.name());
        }
        assert_eq!(NAMES.iter().filter(|name| find(name).is_mirrored()).count(), 8);
    }

    #[test]
    fn records_are_stepped_over_and_may_be_damaged() {
        let record = |kind: u32, value: &[u8]| {
            [&kind.to_le_bytes(), &(value.len() as u32).to_le_bytes(), value].concat()
        };
        let other = record(0xadbe_0002, &[1; 12]);
        let named = [other.clone(), record(EXTENSION, &6u32.to_le_bytes())].concat();
        assert_eq!(Axes::of_extensions(&named).name(), "RDF");
        for len in 0..named.len() {
            assert_eq!(Axes::of_extensions(&named[..len]), Axes::default());
        }
        for number in [0, 17, u32::MAX] {
            let odd = record(EXTENSION, &number.to_le_bytes());
            assert_eq!(Axes::of_extensions(&odd), Axes::default());
        }
    }
}
