use anyhow::{Context, Result, bail};
use rand_core::TryRng;
use serde_json::json;
use time_stamp::{Query, Stamp};

use crate::{
    Answer,
    args::{Attach, Request, Stamp as Arguments, Step},
    claims,
    files::{self, Output, Text},
    report::{self, Lines},
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
    files::write_together(&[Output::public((query_path, &query))], arguments.force)?;

    let digest = hex(&certificate.digest());
    let object = json!({
        "query": query_path,
        "certificate": certificate_path,
        "digest": digest,
    });
    let (certificate, query) = (certificate_path.display(), query_path.display());
    let mut lines = Lines::new(format!(
        "Wrote {query}, which asks for a time stamp on {certificate}"
    ));
    lines.field("digest", format!("{digest}  (SHA-256; this is what is stamped)"));
    let post = "curl -H 'Content-Type: application/timestamp-query' --data-binary";
    lines.field(
        "next",
        format!("{post} @{query} AUTHORITY -o reply.tsr, then sigmark stamp attach {certificate} reply.tsr"),
    );
    report::print(arguments.json, &object, &lines)?;
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
    let certificate = certificate
        .with_stamp(reply)
        .with_context(|| format!("{}: nothing was changed", path.display()))?;
    let text = certificate
        .to_json()
        .with_context(|| path.display().to_string())?;
    files::write_together(&[Output::public((path, text.as_bytes()))], true)?;

    let (count, time) = (certificate.stamps().len(), stamp.claimed_time());
    let object = json!({
        "certificate": path,
        "stamps": count,
        "time": time.to_rfc3339(),
    });
    let mut lines = Lines::new(format!("Put {} into {}", blamed(), path.display()));
    lines.field("time", format!("{time}, as the reply says; not checked yet"));
    lines.field("stamps", count);
    let next = "check it with `sigmark verify --stamp-roots`, and keep the root certificates";
    lines.field("next", next);
    report::print(arguments.json, &object, &lines)?;
    Ok(Answer::Yes)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
