//! Stamps whose certificates are not what they should be.

use super::{
    authority::Authority,
    comparison::{Comparison, Verdicts, chain, digest},
    statements::{imprint, next_summer, statement},
};
use Verdicts::{BothAccept, BothRefuse, WeRefuse};

/// A stamp of next summer by the key `tsa`, whose certificate is called `name`, with the certificates of a file.
fn signed(authority: &Authority, name: &str, others: &str) -> Vec<u8> {
    let info = statement(1, &imprint(1, &digest()), &next_summer(authority), &[]);
    authority.token(&info, name, "tsa", &format!("-certfile {others}.pem -cades"))
}

#[test]
fn certificates_for_time_stamps_are_judged_as_openssl_does() {
    let authority = chain("P-256", "P-256", "P-256");
    let mut all = Comparison::new(&authority);
    for (section, expected, reason) in [
        ("tsa_no_usage", BothAccept, ""),
        ("tsa_unknown", BothAccept, ""),
        ("tsa_not", BothRefuse, "not one for time stamps alone"),
        ("tsa_other_purpose", BothRefuse, "not one for time stamps alone"),
        ("tsa_two_purposes", BothRefuse, "not one for time stamps alone"),
        ("tsa_not_critical", BothRefuse, "does not say so critically"),
        ("tsa_other_usage", BothRefuse, "other uses"),
        ("tsa_more_usage", BothRefuse, "other uses"),
        ("tsa_unknown_critical", BothRefuse, "not understood"),
    ] {
        authority.issue(section, "tsa", ("inter", "inter"), section, "");
        all.reply(section, &signed(&authority, section, "chain"), expected, reason);
    }
    all.end();
}

#[test]
fn issuers_are_judged_as_openssl_does() {
    let authority = chain("rsa", "P-384", "P-256");
    authority.key("short", "rsa1024");
    let pss = "-sigopt rsa_padding_mode:pss -sigopt rsa_pss_saltlen:32 -sha256";
    let mut all = Comparison::new(&authority);
    #[rustfmt::skip] // a table
    let cases = [
        ("ca", "inter", "", BothAccept, ""),
        ("ca_shallow", "inter", "", BothAccept, ""),
        ("ca_no_signing", "inter", "", BothRefuse, "may not sign certificates"),
        ("ca_not", "inter", "", BothRefuse, "not one of an authority"),
        ("ca_silent", "inter", "", BothRefuse, "not one of an authority"),
        ("tsa", "inter", "", BothRefuse, "not one of an authority"),
        ("ca_names", "inter", "", WeRefuse, "not understood"),
        ("ca_web", "inter", "", WeRefuse, "may not issue certificates for time stamps"),
        ("ca", "inter", "-days 1", BothRefuse, "of CN=issuer,O=Test was valid from"),
        ("ca", "inter", "-sha512", BothAccept, ""),
        ("ca", "inter", pss, BothAccept, ""),
        ("ca", "inter", "-sha1", WeRefuse, "not checked here"),
        ("ca", "short", "", WeRefuse, "fewer than 2048 bits"),
    ];
    for (section, key, options, expected, reason) in cases {
        authority.issue("issuer", key, ("root", "root"), section, options);
        authority.issue("below", "tsa", ("issuer", key), "tsa", "");
        let case = format!("{section} {key} {options}");
        all.reply(&case, &signed(&authority, "below", "issuer"), expected, reason);
    }
    all.end();
}

#[test]
fn chains_are_judged_as_openssl_does() {
    let authority = chain("rsa", "P-256", "P-256");
    let mut all = Comparison::new(&authority);
    authority.issue("deep", "inter", ("inter", "inter"), "ca", "");
    authority.issue("below_deep", "tsa", ("deep", "inter"), "tsa", "");
    let both = authority.pem("inter") + &authority.pem("deep");
    authority.write("both.pem", both.as_bytes());
    let deep = signed(&authority, "below_deep", "both");
    all.reply(
        "below one that may have none below it",
        &deep,
        BothRefuse,
        "allows fewer",
    );

    // One of the intermediate authority's name.
    authority.key("other", "rsa");
    authority.make(
        "req -x509 -new -key other.key -extensions ca -subj /O=Test/CN=inter -days 36500 -out forged.pem",
    );
    authority.issue("forger", "tsa", ("forged", "other"), "tsa", "");
    all.reply(
        "by a forger",
        &signed(&authority, "forger", "forged"),
        BothRefuse,
        "",
    );
    let with_true = signed(&authority, "forger", "chain");
    all.reply(
        "by a forger, with the true chain",
        &with_true,
        BothRefuse,
        "does not check",
    );
    all.end();
}

#[test]
fn roots_are_judged_as_openssl_does() {
    let authority = chain("P-256", "P-256", "P-256");
    let mut all = Comparison::new(&authority);
    authority.root("self", "tsa", "tsa");
    let info = statement(1, &imprint(1, &digest()), &next_summer(&authority), &[]);
    let own = authority.token(&info, "self", "tsa", "-cades");
    all.with("self-signed", &own, digest(), "self", BothAccept, "");
    all.reply(
        "self-signed, not trusted",
        &own,
        BothRefuse,
        "a root that you trust",
    );

    let reason = [
        ("ca", ""),
        ("ca_shallow", ""),
        ("ca_not", "not one of"),
        ("ca_no_signing", "may not sign"),
        ("tsa", "not one of"),
    ];
    for (section, reason) in reason {
        authority.root("above", "inter", section);
        authority.issue("below", "tsa", ("above", "inter"), "tsa", "");
        let expected = if reason.is_empty() { BothAccept } else { BothRefuse };
        all.with(
            section,
            &signed(&authority, "below", "above"),
            digest(),
            "above",
            expected,
            reason,
        );
    }
    all.end();
}
