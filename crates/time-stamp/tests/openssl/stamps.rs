//! Queries, good stamps, and what authorities say when they refuse.

use std::time::Duration;

use time_stamp::{Query, Stamp};

use super::{
    authority::{Authority, der},
    comparison::{Comparison, NONCE, Verdicts, chain, digest, hex, ours, query},
};

#[test]
fn openssl_reads_our_query() {
    let authority = Authority::new();
    authority.write("query.tsq", &query());
    let text = authority.make("ts -query -in query.tsq -text");
    let digest = hex(&digest());
    for part in [
        "Version: 1",
        "Hash Algorithm: sha256",
        &format!("{} {}", &digest[..2], &digest[2..4]),
        "Policy OID: unspecified",
        "Nonce: 0x8000000000000001",
        "Certificate required: yes",
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    authority.write("query.tsq", &Query::new([0; 32]).to_der().unwrap());
    let text = authority.make("ts -query -in query.tsq -text");
    assert!(text.contains("Nonce: unspecified"));
}

#[test]
fn stamps_of_every_kind_of_key_and_answer_check() {
    let kinds = [
        (["rsa", "rsa", "rsa"], "answers"),
        (["P-256", "P-256", "P-256"], "answers_chain"),
        (["P-384", "P-384", "P-384"], "answers_v1"),
        (["rsa", "P-384", "P-256"], "answers_v1"),
        (["P-384", "rsa", "rsa"], "answers_chain"),
        (["P-256", "rsa", "P-384"], "answers"),
    ];
    for ([root, intermediate, tsa], answers) in kinds {
        let authority = chain(root, intermediate, tsa);
        let reply = authority.reply(&query(), "tsa", "tsa", "chain", answers);
        assert_eq!(
            authority.verifies(&reply, "-queryfile query.tsq", "root", None),
            Ok(())
        );
        let stamped = ours(&reply, &digest(), &authority.pem("root")).unwrap();
        assert_eq!(stamped.authority, "CN=tsa,O=Test");
        assert_eq!(stamped.policy, "1.2.3.4.1");
        assert_eq!(stamped.serial, authority.last_serial());

        authority.make("ts -reply -in reply.tsr -token_out -out token.der");
        let token = authority.read("token.der");
        assert_eq!(ours(&token, &digest(), &authority.pem("root")), Ok(stamped));
    }
}

/// Who asks for no certificates gets none; then the signer's has to be at hand.
#[test]
fn an_authority_that_is_a_root_itself_needs_to_send_no_certificate() {
    let authority = Authority::new();
    authority.key("self", "P-256");
    authority.root("self", "self", "tsa");
    authority.key("other", "P-256");
    authority.root("other", "other", "ca");
    authority.make(&format!(
        "ts -query -digest {} -sha256 -no_nonce -out bare.tsq",
        hex(&digest())
    ));
    let query = authority.read("bare.tsq");
    let reply = authority.reply(&query, "self", "self", "self", "answers");
    let stamped = ours(&reply, &digest(), &authority.pem("self"));
    assert_eq!(
        stamped.map(|stamped| stamped.authority),
        Ok("CN=self,O=Test".into())
    );
    assert_eq!(
        ours(&reply, &digest(), &authority.pem("other")),
        Err(time_stamp::StampError::NoCertificate)
    );
}

#[test]
fn what_the_authority_says_is_kept() {
    let authority = chain("P-256", "P-256", "P-256");
    let reply = authority.reply(&query(), "tsa", "tsa", "chain", "answers");
    let stamped = ours(&reply, &digest(), &authority.pem("root")).unwrap();
    assert_eq!(stamped.accuracy, Some(Duration::from_micros(1_500_100)));
    let text = authority.make("ts -reply -in reply.tsr -text");
    let time = stamped.time.to_string();
    assert!(text.contains(&time[11..19]), "{time} is not in {text}");
}

#[test]
fn nonces_are_judged_as_openssl_does() {
    let authority = chain("P-256", "P-256", "P-256");
    let good = authority.reply(&query(), "tsa", "tsa", "chain", "answers");
    let stamp = Stamp::from_reply(&good).unwrap();
    let queries = [
        (Query::new(digest()).nonce(NONCE), true),
        (Query::new(digest()).nonce(NONCE - 1), false),
        (Query::new(digest()).nonce(1), false),
        (Query::new(digest()), true),
        (Query::new([0; 32]), false),
    ];
    for (query, expected) in queries {
        authority.write("asked.tsq", &query.to_der().unwrap());
        let theirs = authority.verifies(&good, "-queryfile asked.tsq", "root", None);
        assert_eq!(theirs.is_ok(), expected, "{query:?}: {theirs:?}");
        assert_eq!(stamp.check_answers(&query).is_ok(), expected, "{query:?}");
    }
}

#[test]
fn a_refusal_is_told_with_its_reason() {
    use Verdicts::{BothAccept, BothRefuse};
    let authority = chain("P-256", "P-256", "P-256");
    let good = authority.reply(&query(), "tsa", "tsa", "chain", "answers");
    let digest = hex(&digest());
    authority.make(&format!(
        "ts -query -digest {digest} -sha256 -cert -tspolicy 1.2.3.4.99 -out unknown.tsq"
    ));
    let query = authority.read("unknown.tsq");
    let refusal = authority.reply(&query, "tsa", "tsa", "chain", "answers");

    let token = &good[9..];
    let response = |status: u8, token: &[u8]| der(0x30, &[&der(0x30, &[&[2, 1, status]]), token]);
    #[rustfmt::skip] // a table
    let cases = [
        ("policy", refusal.clone(), BothRefuse, "the authority refused: rejection: "),
        ("policy's name", refusal, BothRefuse, "unknown policy"),
        ("granted", response(0, token), BothAccept, ""),
        ("granted with modifications", response(1, token), BothAccept, ""),
        ("rejected, with a stamp", response(2, token), BothRefuse, "rejection"),
        ("waiting, with a stamp", response(3, token), BothRefuse, "waiting"),
        ("revoked", response(5, &[]), BothRefuse, "revocation notification"),
        ("status 6", response(6, &[]), BothRefuse, "unknown status"),
        ("status -1", response(255, token), BothRefuse, "unknown status"),
        ("granted, without a stamp", response(0, &[]), BothRefuse, "holds none"),
    ];
    let mut all = Comparison::new(&authority);
    for (case, reply, expected, reason) in cases {
        all.reply(case, &reply, expected, reason);
    }
    all.end();
}
