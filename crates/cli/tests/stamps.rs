//! Time stamps on certificates, by an authority that OpenSSL plays.

use std::{io::ErrorKind, process::Command};

use crate::common::Folder;
use serde_json::{Value, json};

const CERTIFICATE: &str = "signed.ply.cert.json";
const VERIFY: &str =
    "verify signed.ply --original model.ply --certificate signed.ply.cert.json --public-key owner.pub.pem";

/// An authority's root, its certificate for stamps, and how it answers.
const AUTHORITY: &str = "\
[req]
distinguished_name = name
[name]
[root]
basicConstraints = critical, CA:TRUE
keyUsage = critical, keyCertSign
[tsa]
extendedKeyUsage = critical, timeStamping
[answers]
serial = ./serial
signer_digest = sha256
default_policy = 1.2.3.4
digests = sha256
";

/// Runs `openssl`; its arguments are words of a line.
fn openssl(folder: &Folder, line: &str) {
    let mut command = Command::new("openssl");
    let run = command
        .current_dir(folder.path(""))
        .env("OPENSSL_CONF", "authority.cnf");
    let output = match run.args(line.split_whitespace()).output() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            panic!(
                "these tests need the command `openssl`: install OpenSSL 3, in most systems the package openssl"
            )
        }
        output => output.expect("openssl runs"),
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "openssl {line}: {errors}");
}

/// A signed model, and an authority with the root certificate root.pem.
fn folder() -> Folder {
    let folder = Folder::with_signed_model();
    folder.write("authority.cnf", AUTHORITY);
    folder.write("serial", "4711\n");
    for line in [
        "genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out root.key",
        "genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out tsa.key",
        "req -x509 -new -key root.key -extensions root -subj /CN=Root -days 3650 -out root.pem",
        "req -x509 -new -key tsa.key -extensions root -subj /CN=Stranger -days 3650 -out stranger.pem",
        "req -new -key tsa.key -subj /O=Example/CN=Stamps -out tsa.csr",
        "x509 -req -in tsa.csr -CA root.pem -CAkey root.key -set_serial 2 -days 3650 -extfile authority.cnf -extensions tsa -out tsa.pem",
    ] {
        openssl(&folder, line);
    }
    folder
}

/// The authority answers a query.
fn answer(folder: &Folder, query: &str, reply: &str) {
    let who = "-config authority.cnf -section answers -signer tsa.pem -inkey tsa.key";
    openssl(
        folder,
        &format!("ts -reply {who} -queryfile {query} -out {reply}"),
    );
}

fn verified(folder: &Folder, options: &str) -> Value {
    folder.done(&format!("{VERIFY} {options} --json")).json()
}

#[test]
fn a_certificate_is_stamped_and_its_stamps_are_checked() {
    let folder = folder();
    assert_eq!(verified(&folder, "")["stamps"], Value::Null);
    assert_eq!(verified(&folder, "--stamp-roots root.pem")["stamps"], json!([]));

    let request = folder
        .done(&format!("stamp request {CERTIFICATE} -o query.tsq --json"))
        .json();
    assert_eq!(request["query"], "query.tsq");
    assert_eq!(request["digest"].as_str().map(str::len), Some(64));
    answer(&folder, "query.tsq", "reply.tsr");
    let attached = folder
        .done(&format!("stamp attach {CERTIFICATE} reply.tsr --json"))
        .json();
    assert_eq!(attached["stamps"], 1);

    assert_eq!(verified(&folder, "")["stamps"], Value::Null);
    let stamp = json!([{ "time": attached["time"], "authority": "CN=Stamps,O=Example", "serial": "4712" }]);
    assert_eq!(verified(&folder, "--stamp-roots root.pem")["stamps"], stamp);
    let text = folder.done(&format!("{VERIFY} --stamp-roots root.pem")).out;
    assert!(
        text.contains("time-stamped 20") && text.contains(" UTC by CN=Stamps,O=Example"),
        "{text}"
    );
    for (options, words) in [
        (
            "--stamp-roots root.pem",
            "UTC, by CN=Stamps,O=Example (serial number 4712)",
        ),
        ("", "1 time stamp, not checked"),
    ] {
        folder.done(&format!("{VERIFY} {options} --report report.html --force"));
        assert!(folder.text("report.html").contains(words), "{words}");
    }
    let text = folder.done(VERIFY).out;
    assert!(
        text.contains("1 time stamp, not checked") && text.contains("--stamp-roots"),
        "{text}"
    );

    // Stamped again, the certificate is the same, and so is what is stamped.
    let again = folder
        .done(&format!(
            "stamp request {CERTIFICATE} -o query.tsq --force --json"
        ))
        .json();
    assert_eq!(again["digest"], request["digest"]);
    answer(&folder, "query.tsq", "second.tsr");
    folder.done(&format!("stamp attach {CERTIFICATE} second.tsr"));
    let stamps = &verified(&folder, "--stamp-roots root.pem")["stamps"];
    assert_eq!(stamps.as_array().map(Vec::len), Some(2));
    openssl(
        &folder,
        &format!(
            "ts -verify -digest {} -in reply.tsr -CAfile root.pem",
            request["digest"].as_str().expect("a digest")
        ),
    );
}

#[test]
fn every_query_has_a_nonce_of_its_own() {
    let folder = Folder::with_signed_model();
    folder.done(&format!("stamp request {CERTIFICATE} -o first.tsq"));
    let text = folder
        .done(&format!("stamp request {CERTIFICATE} -o second.tsq"))
        .out;
    assert!(
        text.contains("curl") && text.contains("sigmark stamp attach"),
        "{text}"
    );
    assert_ne!(folder.read("first.tsq"), folder.read("second.tsq"));
    folder.refused(
        &format!("stamp request {CERTIFICATE} -o first.tsq"),
        &["first.tsq: exists already", "--force"],
    );
    folder.refused(
        &format!("stamp request {CERTIFICATE} -o {CERTIFICATE} --force"),
        &[CERTIFICATE, "the certificate"],
    );
}

#[test]
fn replies_that_are_no_stamps_of_this_certificate_are_refused() {
    let folder = folder();
    folder.done("stamp request theirs.ply.cert.json -o query.tsq");
    answer(&folder, "query.tsq", "theirs.tsr");
    folder.done(&format!("stamp request {CERTIFICATE} -o mine.tsq"));
    answer(&folder, "mine.tsq", "mine.tsr");
    // PKIStatusInfo with rejection(2), "closed" and badRequest(2).
    folder.write(
        "refusal.tsr",
        b"\x30\x13\x30\x11\x02\x01\x02\x30\x08\x0c\x06closed\x03\x02\x05\x20",
    );
    folder.write("page.tsr", "<html>502 Bad Gateway</html>");
    folder.write("empty.tsr", "");
    folder.write("large.tsr", vec![0; (1 << 20) + 1]);
    for (reply, words) in [
        (
            "theirs.tsr",
            [
                "theirs.tsr: the stamp is of something else",
                "attach it to what it was made for",
            ],
        ),
        (
            "refusal.tsr",
            [
                "refusal.tsr: the authority refused: rejection: closed",
                "ask again",
            ],
        ),
        (
            "page.tsr",
            ["page.tsr: the reply can't be read", "as the authority sent it"],
        ),
        ("empty.tsr", ["empty.tsr: is empty", "the authority sent"]),
        ("large.tsr", ["large.tsr: has 1 MiB", "the authority sent"]),
        ("mine.tsq", ["mine.tsq: ", "can't be read"]),
        (
            "missing.tsr",
            ["missing.tsr: can't be read", "check the spelling"],
        ),
        (".", [".: is a directory", "the authority sent"]),
    ] {
        folder.refused(&format!("stamp attach {CERTIFICATE} {reply}"), &words);
    }
    folder.done(&format!("stamp attach {CERTIFICATE} mine.tsr"));
    folder.refused(
        &format!("stamp attach {CERTIFICATE} mine.tsr"),
        &["already", "nothing was changed"],
    );
    folder.refused(
        "stamp attach model.ply mine.tsr",
        &["model.ply: ", "the .cert.json file"],
    );
}

#[test]
fn no_more_stamps_are_attached_than_are_read() {
    let folder = folder();
    folder.done(&format!("stamp request {CERTIFICATE} -o query.tsq"));
    answer(&folder, "query.tsq", "reply.tsr");
    let mut certificate: Value = serde_json::from_str(&folder.text(CERTIFICATE)).expect("JSON");
    certificate["stamps"] = vec!["AA=="; 99].into();
    folder.write(CERTIFICATE, certificate.to_string());
    folder.done(&format!("stamp attach {CERTIFICATE} reply.tsr"));
    answer(&folder, "query.tsq", "second.tsr");
    folder.refused(
        &format!("stamp attach {CERTIFICATE} second.tsr"),
        &[CERTIFICATE, "100 time stamps", "nothing was changed"],
    );
    folder.done(VERIFY);
}

/// Stamps are no part of what is sealed: who has the certificate in his hands can add some.
#[test]
fn stamps_that_do_not_check_are_told_and_never_count() {
    let folder = folder();
    folder.done(&format!("stamp request {CERTIFICATE} -o query.tsq"));
    answer(&folder, "query.tsq", "reply.tsr");
    let mut forged = folder.read("reply.tsr");
    let last = forged.len() - 1;
    forged[last] ^= 1;
    folder.write("forged.tsr", &forged);
    folder.done(&format!("stamp attach {CERTIFICATE} forged.tsr"));
    folder.done(&format!("stamp attach {CERTIFICATE} reply.tsr"));
    let report = verified(&folder, "--stamp-roots root.pem");
    assert_eq!(report["stamps"].as_array().map(Vec::len), Some(1));
    assert_eq!(report["stamps"][0]["serial"], "4712");
    let refused = &report["stamps_refused"];
    assert_eq!(refused.as_array().map(Vec::len), Some(1));
    assert_eq!(refused[0]["number"], 1);
    let why = "the signature of the stamp does not check";
    assert!(
        refused[0]["reason"]
            .as_str()
            .is_some_and(|reason| reason.contains(why))
    );
    assert_eq!(verified(&folder, "")["stamps_refused"], Value::Null);

    let run = folder.done(&format!("{VERIFY} --stamp-roots root.pem --report report.html"));
    assert!(run.out.contains("time-stamped 20"), "{}", run.out);
    let told = "time stamp 1 of the certificate does not check, and counts for nothing";
    for text in [run.out, folder.text("report.html")] {
        assert!(text.contains(told) && text.contains(why), "{text}");
    }
    let claim = |signed: &str, key: &str| {
        format!(
            r#"{{"original": "model.ply", "certificate": "{signed}.cert.json", "public_key": "{key}.pub.pem"}}"#
        )
    };
    folder.write("mine.json", claim("signed.ply", "owner"));
    folder.write("theirs.json", claim("theirs.ply", "other"));
    let dispute = "dispute mine.json theirs.json --stamp-roots root.pem";
    let report = folder.run(&format!("{dispute} --json")).json();
    assert_eq!(report["stamps"][0].as_array().map(Vec::len), Some(1));
    assert_eq!(report["stamps_refused"][0][0]["number"], 1);
    assert_eq!(report["stamps_refused"][1], json!([]));
    let text = folder.run(dispute).out;
    assert!(text.contains(told), "{text}");
    // By roots that know none of them both claims are as good as without stamps.
    let by_strangers = folder.run(&dispute.replace("root.pem", "stranger.pem")).out;
    assert!(
        by_strangers.contains("no time stamp says since when"),
        "{by_strangers}"
    );
    let outcome = |text: &str| text.split(':').next().map(str::to_owned);
    assert_eq!(outcome(&by_strangers), outcome(&text));
}

#[test]
fn where_no_stamp_checks_the_claim_is_judged_as_if_it_had_none() {
    let folder = folder();
    folder.done(&format!("stamp request {CERTIFICATE} -o query.tsq"));
    answer(&folder, "query.tsq", "reply.tsr");
    folder.done(&format!("stamp attach {CERTIFICATE} reply.tsr"));
    let mut reply = folder.read("reply.tsr");
    let last = reply.len() - 1;
    reply[last] ^= 1;
    folder.write("forged.tsr", &reply);
    folder.done(&format!("stamp attach {CERTIFICATE} forged.tsr"));
    let verify = format!("{VERIFY} --stamp-roots stranger.pem --report report.html");
    let run = folder.done(&verify);
    assert!(run.out.starts_with("VERIFIED"), "{}", run.out);
    let told = [
        "no time stamp says since when",
        "time stamp 1 of the certificate does not check",
        "none has issued for CN=Root",
        "time stamp 2",
        "the signature of the stamp does not check",
    ];
    for text in [run.out, folder.text("report.html")] {
        assert!(told.iter().all(|words| text.contains(words)), "{text}");
    }
    let report = verified(&folder, "--stamp-roots stranger.pem");
    assert_eq!(report["stamps"], json!([]));
    assert_eq!(report["stamps_refused"].as_array().map(Vec::len), Some(2));

    for (roots, words) in [
        ("tsa.pem", ["tsa.pem: no root", "self-signed"]),
        ("owner.pub.pem", ["owner.pub.pem: is a key", "root certificate"]),
        ("model.ply", ["model.ply: ", "root certificate"]),
        (
            "missing.pem",
            ["missing.pem: can't be read", "check the spelling"],
        ),
    ] {
        folder.refused(&format!("{VERIFY} --stamp-roots {roots}"), &words);
    }
}

#[cfg(unix)]
#[test]
fn a_certificate_keeps_its_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let permissions = std::fs::Permissions::from_mode(0o640);
    std::fs::set_permissions(folder.path(CERTIFICATE), permissions).expect("permissions");
    folder.done(&format!("stamp request {CERTIFICATE} -o query.tsq"));
    answer(&folder, "query.tsq", "reply.tsr");
    folder.done(&format!("stamp attach {CERTIFICATE} reply.tsr"));
    let metadata = std::fs::metadata(folder.path(CERTIFICATE)).expect("the certificate");
    assert_eq!(metadata.permissions().mode() & 0o777, 0o640);
}
