//! Time stamps: replies of authorities, and lists of the roots that are trusted. Nobody but the authority says what checks.

use std::sync::LazyLock;

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use sha2::{Digest, Sha256};
use time_stamp::{Query, Roots, Stamp, StampError, Stamped};

/// A reply and its root by ECDSA, and both by RSA.
const REPLIES: [&[u8]; 2] = [
    include_bytes!("../../time-stamp/tests/data/reply.tsr"),
    include_bytes!("../../time-stamp/tests/data/rsa-reply.tsr"),
];
const ROOTS: [&str; 2] = [
    include_str!("../../time-stamp/tests/data/root.pem"),
    include_str!("../../time-stamp/tests/data/rsa-root.pem"),
];

static TRUSTED: LazyLock<Roots> =
    LazyLock::new(|| Roots::from_pem(&ROOTS.concat()).expect("the roots of the tests"));

/// What the two replies say.
static GENUINE: LazyLock<Vec<Stamped>> = LazyLock::new(|| {
    let verdicts = REPLIES.iter().map(|reply| verdict(reply, &TRUSTED));
    verdicts
        .map(|verdict| verdict.expect("a reply of the tests"))
        .collect()
});

fn verdict(reply: &[u8], roots: &Roots) -> Result<Stamped, StampError> {
    let digest = Sha256::digest("a model").into();
    let stamp = Stamp::from_reply(reply)?;
    // Whether it answers a query decides nothing here, but is asked of strangers' replies.
    let _ = stamp.check_answers(&Query::new(digest).nonce(7));
    stamp.verify(&digest, roots)
}

/// Reads a reply. Only what the authority said can check, however it is wrapped.
pub(crate) fn check_reply(bytes: &[u8]) {
    if let Ok(stamped) = verdict(bytes, &TRUSTED) {
        assert!(GENUINE.contains(&stamped), "{stamped:?}");
    }
}

/// Reads a list of roots, as text and as the bytes of one certificate, and judges the two replies by it.
pub(crate) fn check_roots(bytes: &[u8]) {
    let body = BASE64.encode(bytes);
    let block = format!("-----BEGIN CERTIFICATE-----\n{body}\n-----END CERTIFICATE-----\n");
    let texts = [std::str::from_utf8(bytes).unwrap_or_default(), &block];
    for roots in texts.iter().filter_map(|text| Roots::from_pem(text).ok()) {
        for reply in REPLIES {
            if let Ok(stamped) = verdict(reply, &roots) {
                assert!(GENUINE.contains(&stamped), "{stamped:?}");
            }
        }
    }
}

pub(crate) fn replies() -> Vec<Vec<u8>> {
    REPLIES.map(<[u8]>::to_vec).to_vec()
}

/// Roots as text, and as bytes.
pub(crate) fn roots() -> Vec<Vec<u8>> {
    let der = |text: &&str| {
        let body: String = text.lines().filter(|line| !line.starts_with('-')).collect();
        BASE64.decode(body).expect("a root of the tests")
    };
    let texts = ROOTS.iter().map(|text| text.as_bytes().to_vec());
    texts.chain(ROOTS.iter().map(der)).collect()
}
