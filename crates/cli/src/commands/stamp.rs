use anyhow::{Context, Result, bail};
use rand_core::TryRng;
use serde_json::json;
use time_stamp::{Query, Stamp};

use crate::{
    Answer,
    args::{Attach, Request, Stamp as Arguments, Step},
    claims,
    files::{self, Output, Text},
    report,
};

pub(crate) fn run(arguments: &Arguments) -> Result<Answer> {
    match &arguments.step {
        Step::Request(arguments) => request(arguments),
        Step::Attach(arguments) => attach(arguments),
    }
}

fn request(arguments: &Request) -> Result<Answer> {
    let (certificate_path, query_path) = (&arguments.certificate, &arguments.output);
    let certificate = claims::read_certificate(certificate_path)?;
    files::check_apart(query_path, certificate_path, "the certificate")?;
    files::check_free(query_path, arguments.force)?;

    let nonce = getrandom::SysRng.try_next_u64();
    let nonce = nonce.context("the operating system gives no random number; try again")?;
    let query = Query::new(certificate.digest()).nonce(nonce).to_der()?;
    let private = false;
    files::write_together(
        &[Output {
            path: query_path,
            bytes: &query,
            private,
        }],
        arguments.force,
    )?;

    let digest: String = certificate
        .digest()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    if arguments.json {
        report::json(&json!({
            "query": query_path,
            "certificate": certificate_path,
            "digest": digest,
        }))?;
    } else {
        let (certificate, query) = (certificate_path.display(), query_path.display());
        let next = format!(
            "curl -H 'Content-Type: application/timestamp-query' --data-binary @{query} AUTHORITY -o reply.tsr, \
             then sigmark stamp attach {certificate} reply.tsr"
        );
        report::lines(&[
            format!("Wrote {query}, which asks for a time stamp on {certificate}"),
            report::field("digest", format!("{digest}  (SHA-256; this is what is stamped)")),
            report::field("next", next),
        ])?;
    }
    Ok(Answer::Yes)
}

fn attach(arguments: &Attach) -> Result<Answer> {
    let path = &arguments.certificate;
    let certificate = claims::read_certificate(path)?;
    let reply = files::read_bytes(&arguments.reply, Text::Reply)?;
    let blamed = || arguments.reply.display().to_string();
    let stamp = Stamp::from_reply(&reply).with_context(blamed)?;
    stamp.check_covers(&certificate.digest()).with_context(blamed)?;
    if certificate.stamps().contains(&reply) {
        bail!(
            "{}: is in {} already; nothing was changed",
            blamed(),
            path.display()
        );
    }
    let certificate = certificate.with_stamp(reply);
    let text = certificate
        .to_json()
        .with_context(|| path.display().to_string())?;
    let (bytes, private) = (text.as_bytes(), false);
    files::write_together(&[Output { path, bytes, private }], true)?;

    let (count, time) = (certificate.stamps().len(), stamp.claimed_time());
    if arguments.json {
        report::json(&json!({
            "certificate": path,
            "stamps": count,
            "time": time.to_rfc3339(),
        }))?;
    } else {
        report::lines(&[
            format!("Put {} into {}", blamed(), path.display()),
            report::field("time", format!("{time}, as the reply says; not checked yet")),
            report::field("stamps", count),
            report::field(
                "next",
                "check it with `sigmark verify --stamp-roots`, and keep the root certificates",
            ),
        ])?;
    }
    Ok(Answer::Yes)
}
