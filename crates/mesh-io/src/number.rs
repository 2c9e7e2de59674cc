//! Decimal numbers: how precise they are, and how new ones are written.

/// The most digits with which single precision is written, and those that it holds of any number.
const SINGLE_DIGITS: usize = 9;
const SURE_DIGITS: usize = 6;

/// From here on numbers are written with an exponent; plain ones would have more digits than their precision.
const LARGEST_PLAIN_SINGLE: f64 = 1e9;
const LARGEST_PLAIN_DOUBLE: f64 = 1e15;

/// Reads a decimal number; `nan` and `inf` are read too, so that their place can be reported if a face uses them.
pub(crate) fn parse(token: &[u8]) -> Option<f64> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// Whether `token`, which reads as `value`, may have been written from a single-precision number: one that is written so with as many digits, so that nothing is
/// lost of them.
pub(crate) fn fits_single(token: &[u8], value: f64) -> bool {
    let end = token.iter().position(|b| matches!(b, b'e' | b'E'));
    let (mantissa, exponent) = token.split_at(end.unwrap_or(token.len()));
    let digits = mantissa.iter().filter(|b| b.is_ascii_digit());
    let significant = digits.skip_while(|&&b| b == b'0').count();
    let single = value as f32;
    let in_range = value == 0.0 || (single.is_finite() && single.is_normal());
    // Half a unit of the last digit, and what rounding may add.
    let half = || 0.500_000_1 * 10_f64.powi(last_place(mantissa, exponent));
    let is_held = || significant <= SURE_DIGITS || (f64::from(single) - value).abs() <= half();
    significant <= SINGLE_DIGITS && (!value.is_finite() || in_range && is_held())
}

/// The power of ten that a mantissa's last digit counts. Zeros that only fill up a whole number are none.
fn last_place(mantissa: &[u8], exponent: &[u8]) -> i32 {
    let from_end = || mantissa.iter().rev();
    let decimals = match from_end().position(|&b| b == b'.') {
        Some(decimals) => decimals as i32,
        None => -(from_end().take_while(|&&b| b == b'0').count() as i32),
    };
    let exponent = exponent
        .get(1..)
        .and_then(|digits| std::str::from_utf8(digits).ok());
    let exponent: i32 = exponent.and_then(|digits| digits.parse().ok()).unwrap_or(0);
    exponent.saturating_sub(decimals)
}

/// Appends the shortest decimal that reads back, also by way of f64, to the same single-precision number.
pub(crate) fn write_single(value: f32, out: &mut Vec<u8>) {
    let start = out.len();
    write(value, f64::from(value), LARGEST_PLAIN_SINGLE, out);
    if parse(&out[start..]).map(|read| read as f32) != Some(value) {
        out.truncate(start);
        write_double(f64::from(value), out);
    }
}

/// Appends the shortest decimal that reads back to the same number.
pub(crate) fn write_double(value: f64, out: &mut Vec<u8>) {
    write(value, value, LARGEST_PLAIN_DOUBLE, out);
}

/// Without an exponent where that is short, as C's `%g` decides.
fn write(
    shown: impl std::fmt::Display + std::fmt::LowerExp,
    value: f64,
    largest_plain: f64,
    out: &mut Vec<u8>,
) {
    use std::io::Write;
    let plain = value == 0.0 || (1e-5..largest_plain).contains(&value.abs());
    let written = if plain {
        write!(out, "{shown}")
    } else {
        write!(out, "{shown:e}")
    };
    written.expect("a vector takes every byte");
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn single(value: f32) -> String {
        let mut out = Vec::new();
        write_single(value, &mut out);
        String::from_utf8(out).unwrap()
    }

    fn double(value: f64) -> String {
        let mut out = Vec::new();
        write_double(value, &mut out);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn short_numbers_are_written_without_an_exponent() {
        assert_eq!(single(0.1), "0.1");
        assert_eq!(single(-16_777_216.0), "-16777216");
        assert_eq!(single(1_315_859_240.0), "1.3158592e9");
        assert_eq!(double(0.1 + 0.2), "0.30000000000000004");
        assert_eq!(double(0.000_012), "0.000012");
        assert_eq!(double(-2.5e-9), "-2.5e-9");
        assert_eq!(double(1e300), "1e300");
        assert_eq!(double(0.0), "0");
    }

    #[test]
    fn digits_that_f32_does_not_hold_or_a_range_beyond_it_make_a_double() {
        for (token, expected) in [
            ("0.123456791", true),
            ("0.123456789", false),
            ("0.1234567910", false),
            ("-000123456787e-5", true),
            ("-000123456789e-5", false),
            // Metres of a country's grid, to the centimetre.
            ("5412345.67", false),
            ("523457.40", false),
            ("523457.375", true),
            ("16777217", false),
            ("58720350", true),
            ("1.6777216E+7", true),
            ("324.69", true),
            ("12.00000000", false),
            ("1e39", false),
            ("1e-45", false),
            ("0.0000000000000", true),
        ] {
            assert_eq!(
                fits_single(token.as_bytes(), token.parse().unwrap()),
                expected,
                "{token}"
            );
        }
    }

    proptest! {
        #[test]
        fn a_written_single_reads_back_to_itself_and_stays_single(bits in any::<u32>()) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            let token = single(value);
            prop_assert_eq!(token.parse::<f32>().unwrap().to_bits(), bits);
            let by_way_of_f64 = token.parse::<f64>().unwrap();
            prop_assert_eq!((by_way_of_f64 as f32).to_bits(), bits);
            prop_assert!(!value.is_normal() || fits_single(token.as_bytes(), by_way_of_f64));
        }

        #[test]
        fn a_written_double_reads_back_to_itself(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            prop_assert_eq!(double(value).parse::<f64>().unwrap().to_bits(), bits);
        }
    }
}
