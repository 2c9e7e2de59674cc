use std::{fmt, time::Duration};

use der::{Any, DateTime, Tag, Tagged};

use crate::StampError;

/// A time in UTC, to the nanosecond: what an authority says. Shown as `2026-11-22 15:00:00 UTC`, with a fraction if there is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Time {
    seconds: DateTime,
    nanoseconds: u32,
}

impl Time {
    /// Reads a GeneralizedTime as RFC 3161 section 2.4.2 has it: `YYYYMMDDhhmmss[.s…]Z`. Digits behind the ninth are dropped.
    pub(crate) fn from_asn1(value: &Any) -> Result<Self, StampError> {
        let text = (value.tag() == Tag::GeneralizedTime).then(|| value.value());
        text.and_then(Self::parse).ok_or_else(|| StampError::Malformed {
            part: "time",
            reason: "not a date and time in UTC after 1969, as YYYYMMDDhhmmssZ".into(),
        })
    }

    fn parse(text: &[u8]) -> Option<Self> {
        let text = text.strip_suffix(b"Z")?;
        let (whole, fraction) = text.split_at_checked(14)?;
        if !whole.iter().all(u8::is_ascii_digit) {
            return None;
        }
        let number = |digits: &[u8]| digits.iter().fold(0, |n, digit| 10 * n + u16::from(digit - b'0'));
        let two = |at: usize| number(&whole[at..at + 2]) as u8;
        let seconds = DateTime::new(number(&whole[..4]), two(4), two(6), two(8), two(10), two(12)).ok()?;
        let nanoseconds = nanoseconds(fraction)?;
        Some(Self { seconds, nanoseconds })
    }

    /// Seconds since 1970-01-01 00:00:00 UTC, leap seconds not counted, as everywhere; and the fraction.
    pub fn since_1970(&self) -> Duration {
        self.seconds.unix_duration() + Duration::from_nanos(self.nanoseconds.into())
    }

    /// Without the fraction.
    pub(crate) fn whole_seconds(&self) -> DateTime {
        self.seconds
    }

    /// As RFC 3339 writes it: `2026-11-22T15:00:00Z`.
    pub fn to_rfc3339(&self) -> String {
        format!("{}T{}Z", self.date(), self.clock())
    }

    fn date(&self) -> String {
        let day = &self.seconds;
        format!("{:04}-{:02}-{:02}", day.year(), day.month(), day.day())
    }

    fn clock(&self) -> String {
        let time = &self.seconds;
        let fraction = match self.nanoseconds {
            0 => String::new(),
            nanoseconds => format!(".{nanoseconds:09}").trim_end_matches('0').into(),
        };
        format!(
            "{:02}:{:02}:{:02}{fraction}",
            time.hour(),
            time.minutes(),
            time.seconds()
        )
    }
}

/// Of `.5`, 500 million; of nothing, 0.
fn nanoseconds(fraction: &[u8]) -> Option<u32> {
    if fraction.is_empty() {
        return Some(0);
    }
    let digits = fraction.strip_prefix(b".").filter(|digits| !digits.is_empty())?;
    if !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let places = digits.iter().map(|digit| u32::from(digit - b'0'));
    Some(places.chain([0; 9]).take(9).fold(0, |n, digit| 10 * n + digit))
}

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} UTC", self.date(), self.clock())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn times_are_read_as_the_rfc_writes_them() {
        let shown = |text: &str| Time::parse(text.as_bytes()).map(|time| time.to_string());
        assert_eq!(shown("20261122150000Z").unwrap(), "2026-11-22 15:00:00 UTC");
        assert_eq!(
            shown("19990609001326.34352Z").unwrap(),
            "1999-06-09 00:13:26.34352 UTC"
        );
        assert_eq!(
            shown("20240229235959.1234567891Z").unwrap(),
            "2024-02-29 23:59:59.123456789 UTC"
        );
        let half = Time::parse(b"19700101000001.5Z").unwrap();
        assert_eq!(half.since_1970(), Duration::from_millis(1500));
        assert_eq!(half.to_rfc3339(), "1970-01-01T00:00:01.5Z");
        let refused = [
            "20261122150000",
            "20261122150000+0100",
            "202611221500Z",
            "20261122150060Z",
            "20260229000000Z",
            "20261122150000.Z",
            "20261122150000.5x",
            "2026112215000 Z",
            "-0261122150000Z",
            "",
            "Z",
        ];
        assert!(refused.iter().all(|text| shown(text).is_none()));
    }

    proptest! {
        #[test]
        fn no_text_is_too_strange(text in proptest::collection::vec(any::<u8>(), 0..24)) {
            let _ = Time::parse(&text);
        }
    }
}
