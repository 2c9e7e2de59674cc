//! Whether an authority stamped, and in what words it refused (RFC 3161 section 2.4.2).

use crate::{StampError, message::StatusInfo};

/// PKIStatus by its number; the first two come with a stamp.
const STATUSES: [&str; 6] = [
    "granted",
    "granted with modifications",
    "rejection",
    "waiting",
    "revocation warning",
    "revocation notification",
];

/// PKIFailureInfo by its bits.
const FAILURES: [(usize, &str); 8] = [
    (0, "unrecognised or unsupported algorithm"),
    (2, "transaction not permitted or supported"),
    (5, "the query has the wrong format"),
    (14, "no time is available"),
    (15, "unknown policy"),
    (16, "unknown extension"),
    (17, "the further information can't be had"),
    (25, "system failure"),
];

/// That a stamp was granted.
pub(crate) fn check_granted(info: &StatusInfo) -> Result<(), StampError> {
    let number = match info.status.as_bytes() {
        [number] => usize::from(*number),
        _ => STATUSES.len(),
    };
    if number < 2 {
        return Ok(());
    }
    let text = info
        .text
        .iter()
        .flatten()
        .map(|text| String::from_utf8_lossy(text.value()).into_owned());
    let failures = FAILURES.iter().filter(|(bit, _)| has_bit(info, *bit));
    let reasons = text.chain(failures.map(|(_, name)| name.to_string()));
    Err(StampError::Refused {
        status: STATUSES.get(number).unwrap_or(&"an unknown status"),
        reason: reasons.map(|reason| format!(": {reason}")).collect(),
    })
}

fn has_bit(info: &StatusInfo, bit: usize) -> bool {
    let mut bits = info.failure.iter().flat_map(|failure| failure.bits());
    bits.nth(bit).unwrap_or(false)
}
