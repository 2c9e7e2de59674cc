//! Our verdict and OpenSSL's on the same bytes.

use sha2::{Digest, Sha256};
use time_stamp::{Query, Roots, Stamp, StampError, Stamped};

use super::authority::Authority;

/// What each says to a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdicts {
    BothAccept,
    BothRefuse,
    /// We refuse what OpenSSL accepts.
    WeRefuse,
    /// OpenSSL refuses what we accept.
    OpensslRefuses,
}

/// What is stamped.
pub(crate) fn digest() -> [u8; 32] {
    Sha256::digest("a model").into()
}

/// A nonce whose first bit is set, which DER puts a zero before.
pub(crate) const NONCE: u64 = 0x8000_0000_0000_0001;

pub(crate) fn query() -> Vec<u8> {
    Query::new(digest()).nonce(NONCE).to_der().unwrap()
}

/// An authority with a root, an intermediate one and one that stamps, of three kinds of keys.
pub(crate) fn chain(root: &str, intermediate: &str, tsa: &str) -> Authority {
    let authority = Authority::new();
    authority.key("root", root);
    authority.key("inter", intermediate);
    authority.key("tsa", tsa);
    authority.root("root", "root", "ca");
    authority.issue("inter", "inter", ("root", "root"), "ca_shallow", "");
    authority.issue("tsa", "tsa", ("inter", "inter"), "tsa", "");
    let both = authority.pem("inter") + &authority.pem("root");
    authority.write("chain.pem", both.as_bytes());
    authority
}

/// Our verdict.
pub(crate) fn ours(reply: &[u8], digest: &[u8; 32], roots: &str) -> Result<Stamped, StampError> {
    Stamp::from_reply(reply)?.verify(digest, &Roots::from_pem(roots)?)
}

/// OpenSSL's verdict, of certificates at the stamp's time, as ours is.
pub(crate) fn theirs(
    authority: &Authority,
    reply: &[u8],
    digest: &[u8; 32],
    roots: &str,
) -> Result<(), String> {
    let time = Stamp::from_reply(reply).map(|stamp| stamp.claimed_time().since_1970().as_secs());
    let digest = format!("-digest {}", hex(digest));
    authority.verifies(reply, &digest, roots, time.ok())
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Compares verdicts over `digest` and the root `root`, and collects where they are not as expected.
pub(crate) struct Comparison<'a> {
    authority: &'a Authority,
    failures: Vec<String>,
}

impl<'a> Comparison<'a> {
    pub(crate) fn new(authority: &'a Authority) -> Self {
        let failures = Vec::new();
        Self { authority, failures }
    }

    /// `reason` is a part of our error.
    pub(crate) fn reply(&mut self, case: &str, reply: &[u8], expected: Verdicts, reason: &str) {
        self.with(case, reply, digest(), "root", expected, reason);
    }

    pub(crate) fn with(
        &mut self,
        case: &str,
        reply: &[u8],
        digest: [u8; 32],
        roots: &str,
        expected: Verdicts,
        reason: &str,
    ) {
        let ours = ours(reply, &digest, &self.authority.pem(roots)).map_err(|error| error.to_string());
        let theirs = theirs(self.authority, reply, &digest, roots);
        let found = match (ours.is_ok(), theirs.is_ok()) {
            (true, true) => Verdicts::BothAccept,
            (false, false) => Verdicts::BothRefuse,
            (false, true) => Verdicts::WeRefuse,
            (true, false) => Verdicts::OpensslRefuses,
        };
        let said = ours.as_ref().err().map_or("", String::as_str);
        if found != expected || !said.contains(reason) {
            self.failures.push(format!(
                "{case}: {found:?}, not {expected:?} with {reason:?}\n  ours: {ours:?}\n  OpenSSL: {theirs:?}"
            ));
        }
    }

    pub(crate) fn end(self) {
        assert!(self.failures.is_empty(), "{}", self.failures.join("\n"));
    }
}
