//! Numbers of a few digits, which nearly all in such files are, by a shorter way.

/// Powers of ten that are exact in 64 bits.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// What so many more digits multiply a whole number by.
const SHIFTS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];

/// The decimal number at the beginning of a text and its length, exactly as all correct readers have it. `None`
/// where there is none, or it has an exponent or more digits than 53 bits hold: another reader takes these.
#[inline]
pub(super) fn short_decimal(text: &[u8]) -> Option<(f64, usize)> {
    let (is_negative, mut rest) = match text {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, text),
    };
    // More than 19 digits may run over; they are counted, and left to others.
    let mut whole = 0u64;
    let before = rest.len();
    (whole, rest) = digits(whole, rest);
    let mut n_digits = before - rest.len();
    let mut n_fraction = 0;
    if let [b'.', fraction @ ..] = rest {
        (whole, rest) = eight_digits(whole, fraction);
        (whole, rest) = digits(whole, rest);
        n_fraction = fraction.len() - rest.len();
        n_digits += n_fraction;
    }
    let is_exact = (1..=19).contains(&n_digits) && whole <= 1 << 53;
    if !is_exact || matches!(rest, [b'e' | b'E', ..]) {
        return None;
    }
    // Both are exact, so that the quotient is rounded once.
    let value = match n_fraction {
        0 => whole as f64,
        n => whole as f64 / POWERS[n],
    };
    Some((if is_negative { -value } else { value }, text.len() - rest.len()))
}

#[inline]
fn digits(mut whole: u64, mut text: &[u8]) -> (u64, &[u8]) {
    while let [byte, rest @ ..] = text {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        text = rest;
    }
    (whole, text)
}

/// Appends up to eight digits at once, where so many bytes are there.
///
/// Source: Lemire, "Number Parsing at a Gigabyte per Second", Software: Practice and Experience 51 (2021).
#[inline]
fn eight_digits(whole: u64, text: &[u8]) -> (u64, &[u8]) {
    const ZEROS: u64 = 0x3030_3030_3030_3030;
    const ABOVE_NINE: u64 = 0x4646_4646_4646_4646;
    const HIGH_BITS: u64 = 0x8080_8080_8080_8080;
    let Some(eight) = text.first_chunk::<8>() else { return (whole, text) };
    let bytes = u64::from_le_bytes(*eight);
    let values = bytes.wrapping_sub(ZEROS);
    let others = (bytes.wrapping_add(ABOVE_NINE) | values) & HIGH_BITS;
    // Sums carry only towards bytes behind the first that is no digit.
    let n = (others.trailing_zeros() / 8) as usize;
    if n == 0 {
        return (whole, text);
    }
    // Zeros before them make eight digits of fewer.
    let eight = values << (64 - 8 * n);
    let pairs = eight.wrapping_mul(10).wrapping_add(eight >> 8);
    const EVERY_FOURTH: u64 = 0x0000_00FF_0000_00FF;
    let high = (pairs & EVERY_FOURTH).wrapping_mul(0x000F_4240_0000_0064);
    let low = ((pairs >> 16) & EVERY_FOURTH).wrapping_mul(0x0000_2710_0000_0001);
    let number = high.wrapping_add(low) >> 32;
    (whole.wrapping_mul(SHIFTS[n]).wrapping_add(number), &text[n..])
}

/// A number rounded to 32 bits as if it had not been rounded to 64 before; `None` where that is not sure: half way
/// between two numbers of 32 bits, and where these have fewer digits.
#[inline]
pub(super) fn rounded_once(value: f64) -> Option<f32> {
    const HALF: u64 = 1 << 28;
    let below = value.to_bits() & (2 * HALF - 1);
    let is_plain = value == 0.0 || value.abs() > 1e-37;
    (below != HALF && is_plain).then_some(value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers_are_those_of_the_standard_library() {
        let mut texts: Vec<String> =
            ["0", "-0", "-0.0", "5.", ".5", "00012.50", "9007199254740992"]
                .map(str::to_owned)
                .to_vec();
        let mut state = 1u64;
        for _ in 0..20_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let digits = (state >> 3).to_string();
            let n = 1 + (state >> 59) as usize % 16;
            let point = (state >> 50) as usize % (n + 1);
            texts.push(format!("{}.{}", &digits[..point], &digits[point..n]));
        }
        for text in &texts {
            for behind in ["", " ", ",1234567890", "\n-1.5 7 8 9 0"] {
                let whole = format!("{text}{behind}");
                match short_decimal(whole.as_bytes()) {
                    Some((value, n)) => {
                        let expected: f64 = text.parse().unwrap();
                        assert_eq!(
                            (value.to_bits(), n),
                            (expected.to_bits(), text.len()),
                            "{whole}"
                        );
                        if let Some(short) = rounded_once(value) {
                            assert_eq!(short.to_bits(), text.parse::<f32>().unwrap().to_bits());
                        }
                    }
                    None => assert!(text.trim_matches('.').len() > 15, "{whole}"),
                }
            }
        }
    }

    #[test]
    fn what_is_no_short_number_is_left_to_others() {
        for text in [
            "",
            "-",
            ".",
            "-.",
            "x",
            "nan",
            "1e5",
            "1.5E3",
            "+1",
            "9007199254740993",
            "0.12345678901234567891",
        ] {
            assert_eq!(short_decimal(text.as_bytes()), None, "{text}");
        }
        assert_eq!(short_decimal(b"12:34"), Some((12.0, 2)));
        assert_eq!(short_decimal(b"1.2.3"), Some((1.2, 3)));
        assert_eq!(rounded_once(f64::from(1.0f32) + f64::from(f32::EPSILON) / 2.0), None);
    }
}
