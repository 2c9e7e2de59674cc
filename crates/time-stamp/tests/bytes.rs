//! Whatever the bytes, there is an answer.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

use std::sync::LazyLock;

use base64::{Engine, engine::general_purpose::STANDARD as BASE64};
use proptest::prelude::*;
use sha2::{Digest, Sha256};
use time_stamp::{MOST_BYTES, Query, Roots, Stamp, StampError};

/// By ECDSA on P-256.
const REPLY: &[u8] = include_bytes!("data/reply.tsr");
const ROOT: &str = include_str!("data/root.pem");
/// By RSA; the certificate by RSA-PSS.
const RSA_REPLY: &[u8] = include_bytes!("data/rsa-reply.tsr");
const RSA_ROOT: &str = include_str!("data/rsa-root.pem");
static ROOTS: LazyLock<Roots> = LazyLock::new(|| Roots::from_pem(&[ROOT, RSA_ROOT].concat()).unwrap());

fn verdict(reply: &[u8]) -> Result<time_stamp::Stamped, StampError> {
    let digest = Sha256::digest("a model").into();
    let stamp = Stamp::from_reply(reply)?;
    let _ = stamp.check_answers(&Query::new(digest).nonce(7));
    stamp.verify(&digest, &ROOTS)
}

#[test]
fn the_examples_check() {
    let stamped = verdict(REPLY).unwrap();
    assert_eq!(stamped.serial, "4712");
    assert_eq!(stamped.policy, "1.2.3.4.1");
    let stamped = verdict(RSA_REPLY).unwrap();
    assert_eq!(stamped.authority, "CN=Example RSA Time Stamps,O=Example");
}

#[test]
fn nothing_larger_than_the_limit_is_read() {
    let large = [REPLY, &vec![0; MOST_BYTES]].concat();
    assert!(matches!(verdict(&large), Err(StampError::TooLarge { .. })));
    let text = ROOT.repeat(MOST_BYTES / ROOT.len() + 1);
    assert!(matches!(Roots::from_pem(&text), Err(StampError::TooLarge { .. })));
}

#[test]
fn roots_are_read_whatever_stands_between_them() {
    let text = format!(
        "Some authority\r\n{}\n# another\n{ROOT}",
        ROOT.replace('\n', "\r\n")
    );
    assert!(Roots::from_pem(&text).is_ok());
    for none in [
        "",
        "-----BEGIN CERTIFICATE-----",
        "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----",
    ] {
        assert!(matches!(Roots::from_pem(none), Err(StampError::NoRoots(_))));
    }
}

#[test]
fn many_roots_of_one_name_end_soon() {
    let body: String = ROOT.lines().filter(|line| !line.starts_with('-')).collect();
    let root = BASE64.decode(body).unwrap();
    let key = root
        .windows(4)
        .position(|bytes| bytes == [0x03, 0x42, 0x00, 0x04])
        .unwrap();
    let forged = (0..1000).map(|i| {
        let mut root = root.clone();
        root[key + 4 + i % 64] ^= 1 + (i / 64) as u8;
        let body = BASE64.encode(root);
        format!("-----BEGIN CERTIFICATE-----\n{body}\n-----END CERTIFICATE-----\n")
    });
    let roots = Roots::from_pem(&forged.collect::<String>()).unwrap();
    let digest = Sha256::digest("a model").into();
    assert!(Stamp::from_reply(REPLY).unwrap().verify(&digest, &roots).is_err());
}

/// A tag, a length and a value of DER.
fn der(tag: u8, value: &[u8]) -> Vec<u8> {
    let length = value.len().to_be_bytes();
    let zeros = length.iter().take_while(|&&byte| byte == 0).count();
    let length = &length[zeros..];
    match value.len() {
        short @ ..0x80 => [&[tag, short as u8], value].concat(),
        _ => [&[tag, 0x80 | length.len() as u8], length, value].concat(),
    }
}

/// Readers sort what is a set. Its elements come last to first, which takes some algorithms the square of their number.
#[test]
fn a_large_set_in_the_wrong_order_is_read_in_no_time() {
    let algorithm = |number: u32| {
        let [a, b, c] = [number >> 14, number >> 7 & 0x7F, number & 0x7F].map(|digit| digit as u8);
        [0x30, 6, 6, 4, 0x2A, 0x80 | a, 0x80 | b, c]
    };
    let count = (MOST_BYTES as u32 - 200) / 8;
    let algorithms: Vec<u8> = (1 << 14..(1 << 14) + count).rev().flat_map(algorithm).collect();
    let data = der(0x30, &[vec![2, 1, 3], der(0x31, &algorithms)].concat());
    let signed_data = [6, 9, 0x2A, 0x86, 0x48, 0x86, 0xF7, 0x0D, 1, 7, 2];
    let token = der(0x30, &[signed_data.to_vec(), der(0xA0, &data)].concat());
    assert!(token.len() <= MOST_BYTES);
    let refused = Stamp::from_reply(&token).unwrap_err();
    assert!(
        matches!(
            refused,
            StampError::Malformed {
                part: "signed message",
                ..
            }
        ),
        "{refused}"
    );
}

#[test]
fn one_bit_changes_the_answer_or_nothing_that_is_signed() {
    for reply in [REPLY, RSA_REPLY] {
        let good = verdict(reply).unwrap();
        for at in 0..reply.len() {
            let mut changed = reply.to_vec();
            changed[at] ^= 1 << (at % 8);
            if let Ok(stamped) = verdict(&changed) {
                assert_eq!(stamped, good, "byte {at}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn random_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400), text in any::<String>()) {
        prop_assert!(verdict(&bytes).is_err());
        prop_assert!(Roots::from_pem(&text).is_err());
    }

    #[test]
    fn mangled_replies_are_answered(
        reply in prop_oneof![Just(REPLY), Just(RSA_REPLY)],
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        length in 0..40usize,
    ) {
        let mut reply = reply.to_vec();
        for (at, byte) in changes {
            let at = at.index(reply.len());
            reply[at] = byte;
        }
        let _ = verdict(&reply);
        let cut = cut.index(reply.len());
        reply.drain(cut..(cut + length).min(reply.len()));
        let _ = verdict(&reply);
    }

    #[test]
    fn mangled_roots_are_answered(at in 0..ROOT.len(), byte in 32u8..127) {
        let mut text = ROOT.as_bytes().to_vec();
        text[at] = byte;
        let roots = Roots::from_pem(std::str::from_utf8(&text).unwrap());
        let digest = Sha256::digest("a model").into();
        if let Ok(roots) = roots {
            let _ = Stamp::from_reply(REPLY).unwrap().verify(&digest, &roots);
        }
    }
}
