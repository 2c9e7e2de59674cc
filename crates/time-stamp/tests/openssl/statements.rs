//! Stamps that were signed as they are, and yet should not be believed.

use sha2::{Digest, Sha256};

use super::{
    authority::{Authority, der},
    comparison::{Comparison, Verdicts, chain, digest},
};

/// What a stamp says (RFC 3161 section 2.4.2): version, policy, imprint, number, time, and what else follows.
pub(crate) fn statement(version: u8, imprint: &[u8], time: &str, more: &[u8]) -> Vec<u8> {
    let policy = der(6, &[&[0x2a, 0x03, 0x04, 0x01]]);
    let (version, serial) = (der(2, &[&[version]]), der(2, &[&[7]]));
    let time = der(0x18, &[time.as_bytes()]);
    der(0x30, &[&version, &policy, imprint, &serial, &time, more])
}

/// MessageImprint by the hash function whose last arc under that of NIST is `hash`.
pub(crate) fn imprint(hash: u8, digest: &[u8]) -> Vec<u8> {
    let oid = der(6, &[&[0x60, 0x86, 0x48, 0x01, 0x65, 0x03, 0x04, 0x02, hash]]);
    der(0x30, &[&der(0x30, &[&oid, &[5, 0]]), &der(4, &[digest])])
}

/// Noon in the next summer: later than certificates that begin now.
pub(crate) fn next_summer(authority: &Authority) -> String {
    let dates = authority.make("x509 -in root.pem -noout -startdate");
    let year = dates
        .split_whitespace()
        .filter_map(|word| word.parse::<u16>().ok());
    let year = year.max().expect("a year");
    format!("{}0615120000Z", year + 1)
}

/// Extensions of a statement, with one that nobody knows.
fn extension(critical: bool) -> Vec<u8> {
    let oid = der(6, &[&[0x2a, 0x03, 0x04, 0x09]]);
    let critical: &[u8] = if critical { &[1, 1, 0xff] } else { &[] };
    der(0xa1, &[&der(0x30, &[&oid, critical, &der(4, &[&[5, 0]])])])
}

#[test]
fn statements_are_judged_as_openssl_does() {
    use Verdicts::{BothAccept, BothRefuse, WeRefuse};
    let authority = chain("P-256", "P-256", "P-256");
    let now = &next_summer(&authority);
    let year = |year: &str| year.to_string() + &now[4..];
    let right = &imprint(1, &digest());
    let other = &imprint(1, &Sha256::digest("another"));
    let longer = &imprint(1, &[&digest()[..], &[0]].concat());
    let sha512_256 = &imprint(6, &digest()); // of whose name OpenSSL is not asked
    #[rustfmt::skip] // a table
    let cases = [
        ("as it should be", statement(1, right, now, &[]), BothAccept, ""),
        ("with a fraction", statement(1, right, &now.replace('Z', ".25Z"), &[]), BothAccept, ""),
        ("version 2", statement(2, right, now, &[]), BothRefuse, "version 2"),
        ("before the certificate", statement(1, right, &year("1999"), &[]), BothRefuse, "was valid from"),
        ("after the certificate", statement(1, right, &year("2400"), &[]), BothRefuse, "was valid from"),
        ("a year alone", statement(1, right, "2026", &[]), WeRefuse, "date and time"),
        ("local time", statement(1, right, &now.replace('Z', "+0100"), &[]), WeRefuse, "date and time"),
        ("of something else", statement(1, other, now, &[]), BothRefuse, "of something else"),
        ("with a byte more", statement(1, longer, now, &[]), BothRefuse, "of something else"),
        ("by SHA-512/256", statement(1, sha512_256, now, &[]), WeRefuse, "not by SHA-256"),
        ("with an extension", statement(1, right, now, &extension(false)), BothAccept, ""),
        ("with a critical one", statement(1, right, now, &extension(true)), WeRefuse, "not understood"),
        ("with a byte behind it", [&statement(1, right, now, &[])[..], &[0]].concat(), WeRefuse, "can't be read"),
    ];
    let mut all = Comparison::new(&authority);
    for (case, info, expected, reason) in cases {
        let token = authority.token(&info, "tsa", "tsa", "-certfile inter.pem -cades");
        all.reply(case, &token, expected, reason);
    }
    all.end();
}

#[test]
fn signatures_are_judged_as_openssl_does() {
    use Verdicts::{BothAccept, BothRefuse, OpensslRefuses, WeRefuse};
    let authority = chain("P-256", "P-256", "P-256");
    let info = statement(1, &imprint(1, &digest()), &next_summer(&authority), &[]);
    #[rustfmt::skip] // a table
    let cases = [
        ("by SHA-512", "-certfile inter.pem -cades -md sha512", BothAccept, ""),
        ("by SHA-1", "-certfile inter.pem -cades -md sha1", WeRefuse, "not checked here"),
        ("without its certificate's digest", "-certfile inter.pem", BothRefuse, "sign its signer's certificate exactly once"),
        ("without attributes", "-certfile inter.pem -noattr", BothRefuse, "does not sign its content"),
        ("without certificates", "-cades -nocerts", BothRefuse, "no readable certificate"),
        ("without the intermediate certificate", "-cades", BothRefuse, "none has issued for CN=inter"),
        ("by two", "-cades -signer inter.pem -inkey inter.key", BothRefuse, "2 signatures"),
        // OpenSSL reads stamps as PKCS #7, which knows no key identifiers.
        ("by a key identifier", "-certfile inter.pem -cades -keyid", OpensslRefuses, ""),
    ];
    let mut all = Comparison::new(&authority);
    for (case, options, expected, reason) in cases {
        let token = authority.token(&info, "tsa", "tsa", options);
        all.reply(case, &token, expected, reason);
    }
    authority.make("cms -data_create -in info.der -outform DER -out data.der");
    all.reply(
        "not signed",
        &authority.read("data.der"),
        BothRefuse,
        "no time stamp",
    );
    authority.make(
        "cms -sign -nodetach -in info.der -signer tsa.pem -inkey tsa.key -cades -outform DER -out other.der",
    );
    all.reply(
        "of another type",
        &authority.read("other.der"),
        BothRefuse,
        "no time stamp",
    );
    all.end();
}
