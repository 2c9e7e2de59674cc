//! Claims against claims.

use std::path::PathBuf;

use clap::Args;

use super::{Common, TimeLimit};

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark dispute mine.claim.json theirs.claim.json --suspect found.obj

A claim is a JSON file that names the files of a claimant, from its own folder:
  {\"original\": \"model.obj\", \"certificate\": \"signed.obj.cert.json\", \"public_key\": \"owner.pub.pem\"}
Take the keys from the people they belong to: anybody can make one.

Each claim's mark is looked for in the other's original. Who made his original from a model that the other had signed has the other's \
mark in it, and can't have his own in the other's: so the claim whose mark is in the other's original, and whose own original is clean, \
came first. Only marks count that are evidence against a stranger (p at most 2^-120). A claim whose mark can't be read proves nothing, and takes nothing from the other. \
Where an original was posed, a mark is found in it all the same, and what that does not say is told. In a suspect, if there is one, both are looked for.

Exit code 0 if one came first, 1 if that is undecided.

--json prints: outcome (first, second or undecided), reasons, first_in_second, second_in_first, first_in_suspect, second_in_suspect \
(each as `sigmark verify --json` prints it; error alone, why it can't be read; or null), stamps (of both, each a list of time, authority and serial, or null where \
--stamp-roots was not given), stamps_refused (of both, likewise, number and reason of those that do not check and count for nothing), seconds (of each stage).")]
pub(crate) struct Dispute {
    /// The first claim
    #[arg(value_name = "A")]
    pub(crate) first: PathBuf,
    /// The second claim
    #[arg(value_name = "B")]
    pub(crate) second: PathBuf,
    /// The model that both claim
    #[arg(long, value_name = "FILE")]
    pub(crate) suspect: Option<PathBuf>,
    /// Check the time stamps of both certificates against these root certificates
    #[arg(long, value_name = "PEM")]
    pub(crate) stamp_roots: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) time_limit: TimeLimit,
    #[command(flatten)]
    pub(crate) common: Common,
}
