//! Time stamps on certificates.

use std::path::PathBuf;

use clap::{Args, Subcommand};

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark stamp request signed.obj.cert.json -o query.tsq
  curl -H 'Content-Type: application/timestamp-query' --data-binary @query.tsq \\
      https://… -o reply.tsr
  sigmark stamp attach signed.obj.cert.json reply.tsr
  sigmark verify found.obj --certificate signed.obj.cert.json --stamp-roots authority.pem …

A time stamp (RFC 3161) is an authority's signed word that the certificate existed at a time. Sigmark itself asks nobody: it \
writes what is to be sent and reads what comes back. The authority learns a digest, and nothing of the model or the message.")]
pub(crate) struct Stamp {
    #[command(subcommand)]
    pub(crate) step: Step,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Step {
    /// Write what a time stamping authority is asked
    Request(Request),
    /// Put an authority's reply into the certificate
    Attach(Attach),
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark stamp request signed.obj.cert.json -o query.tsq

Send the query to an authority that those trust whom you may have to convince, by HTTP POST of the type \
application/timestamp-query, or as the authority says. The query has a random number (nonce), which \
the authority repeats. Attach does not compare it: any stamp of the certificate's digest is good, and an older one says more.

--json prints: query (file name), certificate (file name), digest (SHA-256, in hexadecimal: what is stamped).")]
pub(crate) struct Request {
    /// The certificate that embed wrote
    pub(crate) certificate: PathBuf,
    /// Where to write the query
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark stamp attach signed.obj.cert.json reply.tsr

The certificate is written anew, with the stamp in it; its signature and seal stay as they are. The reply has to be a stamp \
of this very certificate. Whether its authority deserves trust is asked by `sigmark verify --stamp-roots`. A certificate may have several.

--json prints: certificate (file name), stamps (how many there are now), time (what the new one says, unchecked).")]
pub(crate) struct Attach {
    /// The certificate that was stamped
    pub(crate) certificate: PathBuf,
    /// The authority's reply
    pub(crate) reply: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}
