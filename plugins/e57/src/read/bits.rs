//! Numbers of any number of bits, packed one behind the other, lowest bits first.

/// Calls `put` with the place and value of `n` numbers of `bits` bits, from bit `first` on.
///
/// Bits behind the end of `bytes` are 0.
pub(crate) fn unpack(
    bytes: &[u8],
    first: usize,
    bits: u32,
    n: usize,
    mut put: impl FnMut(usize, u64),
) {
    match bits {
        0 => (0..n).for_each(|i| put(i, 0)),
        8 if first.is_multiple_of(8) => whole_bytes::<1>(bytes, first / 8, n, put),
        16 if first.is_multiple_of(8) => whole_bytes::<2>(bytes, first / 8, n, put),
        32 if first.is_multiple_of(8) => whole_bytes::<4>(bytes, first / 8, n, put),
        64 if first.is_multiple_of(8) => whole_bytes::<8>(bytes, first / 8, n, put),
        1..=56 => short(bytes, first, bits, n, put),
        _ => long(bytes, first, bits, n, put),
    }
}

/// Numbers of whole bytes that begin at a byte.
fn whole_bytes<const N: usize>(
    bytes: &[u8],
    first: usize,
    n: usize,
    mut put: impl FnMut(usize, u64),
) {
    let (words, _) = bytes.get(first..).unwrap_or_default().as_chunks::<N>();
    let n_there = words.len().min(n);
    for (i, word) in words[..n_there].iter().enumerate() {
        let mut value = [0; 8];
        value[..N].copy_from_slice(word);
        put(i, u64::from_le_bytes(value));
    }
    (n_there..n).for_each(|i| put(i, 0));
}

/// Numbers that lie, with up to 7 bits before them, in one word of 64 bits.
fn short(bytes: &[u8], first: usize, bits: u32, n: usize, mut put: impl FnMut(usize, u64)) {
    let mask = (1u64 << bits) - 1;
    let mut bit = first;
    for i in 0..n {
        let word = match bytes.get(bit / 8..).and_then(<[u8]>::first_chunk::<8>) {
            Some(word) => *word,
            None => padded::<8>(bytes, bit / 8),
        };
        put(i, u64::from_le_bytes(word) >> (bit % 8) & mask);
        bit += bits as usize;
    }
}

/// Numbers of up to 64 bits.
fn long(bytes: &[u8], first: usize, bits: u32, n: usize, mut put: impl FnMut(usize, u64)) {
    let mask = u64::MAX >> (64 - bits.min(64));
    for i in 0..n {
        let bit = first + i * bits as usize;
        let word = u128::from_le_bytes(padded::<16>(bytes, bit / 8)) >> (bit % 8);
        // What the mask leaves has no more than 64 bits.
        put(i, word as u64 & mask);
    }
}

/// The bytes from a place, and zeros behind their end.
fn padded<const N: usize>(bytes: &[u8], first: usize) -> [u8; N] {
    let rest = bytes.get(first..).unwrap_or_default();
    let (mut word, len) = ([0; N], rest.len().min(N));
    word[..len].copy_from_slice(&rest[..len]);
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_width_come_back() {
        for bits in 0..=64u32 {
            for lead in 0..9usize {
                let mask = if bits == 0 { 0 } else { u64::MAX >> (64 - bits) };
                let mut values = Vec::new();
                let mut packed = vec![0u8; (lead + 100 * bits as usize).div_ceil(8)];
                let mut state = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(u64::from(bits) + 1);
                for i in 0..100 {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let value = (state ^ state >> 31) & mask;
                    values.push(value);
                    for bit in 0..bits as usize {
                        let place = lead + i * bits as usize + bit;
                        packed[place / 8] |= ((value >> bit & 1) as u8) << (place % 8);
                    }
                }
                let mut found = Vec::new();
                unpack(&packed, lead, bits, 100, |i, value| {
                    assert_eq!(i, found.len());
                    found.push(value);
                });
                assert_eq!(found, values, "{bits} bits from bit {lead}");
            }
        }
    }

    #[test]
    fn behind_the_end_are_zeros() {
        for bits in [1, 8, 13, 16, 32, 60, 64] {
            let mut found = Vec::new();
            unpack(&[0xff; 3], 0, bits, 40, |_, value| found.push(value));
            assert_eq!((found.len(), found[39]), (40, 0));
        }
        unpack(&[], 1 << 40, 5, 3, |_, value| assert_eq!(value, 0));
    }
}
