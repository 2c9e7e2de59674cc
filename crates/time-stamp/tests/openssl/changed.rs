//! Replies that somebody changed on their way.

use sha2::{Digest, Sha256};

use super::{
    authority::Authority,
    comparison::{Comparison, Verdicts, chain, digest, ours, query, theirs},
};

/// A chain and a reply without the root's certificate, which nobody needs there: we pass over damaged ones that are not used.
fn good() -> (Authority, Vec<u8>) {
    let authority = chain("P-256", "P-256", "P-256");
    let reply = authority.reply(&query(), "tsa", "tsa", "inter", "answers");
    (authority, reply)
}

/// Where `part` lies in `whole`, for the first time from `from` on.
fn find(whole: &[u8], part: &[u8], from: usize) -> usize {
    let found = whole[from..]
        .windows(part.len())
        .position(|window| window == part);
    from + found.expect("the part is there")
}

/// The parts of a reply: a name, a byte in it, and how our error begins to say what is wrong.
#[rustfmt::skip] // a table
fn places(reply: &[u8]) -> Vec<(&'static str, usize, &'static str)> {
    let pkcs9 = |number: u8| [0x2a, 0x86, 0x48, 0x86, 0xf7, 0x0d, 0x01, 0x09, number];
    let ecdsa = [0x2a, 0x86, 0x48, 0xce, 0x3d, 0x04, 0x03, 0x02];
    let after = |part: &[u8], from| find(reply, part, from) + part.len();

    let policy = after(&[0x06, 0x04, 0x2a, 0x03, 0x04, 0x01], 0);
    let imprint = find(reply, &digest(), 0);
    let time = after(&[0x18, 0x0f], imprint);
    let nonce = find(reply, &[0x02, 0x09, 0x00, 0x80], time);
    let authority = find(reply, b"Test", nonce);
    let certificate = after(&[0xa0, 0x03, 0x02, 0x01], nonce);
    let its_signature = after(&ecdsa, after(&ecdsa, certificate));
    let content_type = after(&pkcs9(3), certificate);
    let message_digest = after(&pkcs9(4), content_type);
    let signing_time = after(&pkcs9(5), content_type);
    let signing_certificate = after(&[0x09, 0x10, 0x02, 0x2f], content_type);
    let changed = "was changed after it was signed";
    vec![
        ("status", 6, "can't be read"),
        ("message's type", 12, ""),
        ("statement's version", policy - 7, "version"),
        ("policy", policy - 1, changed),
        ("imprint's hash", imprint - 5, "not by SHA-256"),
        ("imprint's first byte", imprint, "of something else"),
        ("imprint's last byte", imprint + 31, "of something else"),
        ("serial number", time - 3, changed),
        ("year", time + 3, changed),
        ("second", time + 13, changed),
        ("accuracy", time + 19, changed),
        ("ordering", nonce - 1, "can't be read"),
        ("nonce", nonce + 10, changed),
        ("authority's name", authority + 3, changed),
        ("certificate's version", certificate, ""),
        ("certificate's issuer", find(reply, b"inter", certificate), ""),
        ("certificate's signature", its_signature + 30, "names another certificate"),
        ("content's type", content_type + 14, ""),
        ("signed digest", message_digest + 8, changed),
        ("signed time", signing_time + 8, "the signature of the stamp does not check"),
        ("signed certificate's digest", signing_certificate + 20, "names another certificate"),
        ("signature's beginning", reply.len() - 40, "the signature of the stamp does not check"),
        ("signature's end", reply.len() - 1, "the signature of the stamp does not check"),
    ]
}

#[test]
fn every_part_is_protected() {
    let (authority, good) = good();
    let mut all = Comparison::new(&authority);
    all.reply("nothing", &good, Verdicts::BothAccept, "");
    for (place, at, reason) in places(&good) {
        let mut changed = good.clone();
        changed[at] ^= if place == "status" { 4 } else { 1 };
        all.reply(
            &format!("1 bit of the {place}"),
            &changed,
            Verdicts::BothRefuse,
            reason,
        );
    }
    all.end();
}

/// OpenSSL accepts more: issuers in other letters, any name of the stamp's algorithm, and encodings that are not DER.
#[test]
fn with_one_bit_changed_we_accept_nothing_that_openssl_refuses() {
    let (authority, good) = good();
    let root = authority.pem("root");
    for at in 0..good.len() {
        let mut changed = good.clone();
        changed[at] ^= 1 << (at % 8);
        if ours(&changed, &digest(), &root).is_ok() {
            let theirs = theirs(&authority, &changed, &digest(), "root");
            assert_eq!(theirs, Ok(()), "1 bit of byte {at}");
        }
    }
}

#[test]
fn what_is_cut_off_or_put_behind_is_seen() {
    let (authority, good) = good();
    let mut all = Comparison::new(&authority);
    for length in [0, 1, 9, good.len() / 2, good.len() - 1] {
        let case = format!("the first {length} bytes");
        all.reply(&case, &good[..length], Verdicts::BothRefuse, "can't be read");
    }
    let longer = [&good[..], b"\0"].concat();
    all.reply(
        "a byte behind the end",
        &longer,
        Verdicts::WeRefuse,
        "can't be read",
    );
    all.end();
}

#[test]
fn other_digests_and_other_roots_are_told_apart() {
    use Verdicts::{BothAccept, BothRefuse};
    let (authority, good) = good();
    authority.key("other", "P-256");
    authority.root("other", "other", "ca");
    // Of the true root's name, with another key. The stamp must be younger.
    authority.make("req -x509 -new -key other.key -extensions ca -subj /O=Test/CN=root -out false.pem");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let younger = authority.reply(&query(), "tsa", "tsa", "inter", "answers");
    let another = Sha256::digest("another").into();
    #[rustfmt::skip] // a table
    let cases = [
        ("another digest", &good, another, "root", BothRefuse, "of something else"),
        ("another root", &younger, digest(), "other", BothRefuse, "a root that you trust"),
        ("a root of the same name", &younger, digest(), "false", BothRefuse, "the certificate of CN=inter,O=Test does not check"),
        ("the intermediate authority as root", &good, digest(), "inter", BothRefuse, "self-signed"),
        ("both as roots", &good, digest(), "chain", BothAccept, ""),
    ];
    let mut all = Comparison::new(&authority);
    for (case, reply, digest, roots, expected, reason) in cases {
        all.with(case, reply, digest, roots, expected, reason);
    }
    all.end();
}
