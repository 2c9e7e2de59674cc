use der::asn1::ObjectIdentifier;

use crate::{MOST_BYTES, Time, signature::Fault};

/// Why a stamp is not accepted, or a query or a list of roots could not be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StampError {
    /// More bytes than any stamp has.
    #[error("{bytes} bytes are more than the {MOST_BYTES} that are read; give the authority's reply alone")]
    TooLarge {
        /// How many there are.
        bytes: usize,
    },
    /// Not what RFC 3161 and RFC 5652 describe, or not in DER.
    #[error("the {part} can't be read ({reason}); give the reply as the authority sent it, in DER")]
    Malformed {
        /// What was being read.
        part: &'static str,
        /// What is wrong there.
        reason: String,
    },
    /// The authority did not stamp.
    #[error("the authority refused: {status}{reason}; ask again, or ask another authority")]
    Refused {
        /// Its status (RFC 3161 section 2.4.2).
        status: &'static str,
        /// A colon and its own words, and its failure information; or nothing.
        reason: String,
    },
    /// It says that it granted a stamp, but sends none.
    #[error("the reply says that a stamp was granted, but holds none; ask the authority again")]
    NoToken,
    /// A signed message about something else.
    #[error("the reply is signed, but is no time stamp: it holds {0}; ask the authority again")]
    AnotherContent(ObjectIdentifier),
    /// A stamp has one signature, its authority's (RFC 3161 section 2.4.2).
    #[error("the stamp has {0} signatures, not one; ask the authority again")]
    Signers(usize),
    /// The stamp is over another digest.
    #[error(
        "the stamp is of something else: it covers the SHA-256 digest {0}; attach it to what it was made for"
    )]
    AnotherDigest(String),
    /// The stamp is over a digest by another function.
    #[error("the stamp covers a digest by {0}, not by SHA-256; ask for one over SHA-256")]
    AnotherHash(ObjectIdentifier),
    /// The stamp was made for another query.
    #[error(
        "the stamp does not repeat the query's nonce, so it was made for another; ask the authority again"
    )]
    Nonce,
    /// The certificate that checks the signature is nowhere.
    #[error(
        "the stamp has no readable certificate of its signer; ask with certReq, \
         or add the authority's certificate to the file of roots"
    )]
    NoCertificate,
    /// An attribute that has to be signed is missing, or there twice.
    #[error("the stamp does not sign its {0} exactly once; ask the authority again")]
    Attribute(&'static str),
    /// What was signed is not what is there.
    #[error(
        "the stamp was changed after it was signed: its {0} is another; ask for the stamp as it was issued"
    )]
    Changed(&'static str),
    /// The stamp names another certificate as its signer's (RFC 5816), or another authority.
    #[error("the stamp names another {0} than the one that signed it; ask the authority again")]
    AnotherSigner(&'static str),
    /// A signature does not check.
    #[error("the signature of {of} does not check: it was changed or forged; ask for it as it was issued")]
    Signature {
        /// What is signed.
        of: String,
    },
    /// A signature of another kind than those that are checked here.
    #[error(
        "the signature of {of} is by {algorithm}, which is not checked here; \
         ask an authority that signs by RSA, or by ECDSA on P-256 or P-384, with SHA-256, SHA-384 or SHA-512"
    )]
    Algorithm {
        /// What is signed.
        of: String,
        /// The algorithm, or the kind of key.
        algorithm: ObjectIdentifier,
    },
    /// A key that nothing can be checked with.
    #[error("the signature of {of} counts for nothing: {reason}; ask another authority")]
    Key {
        /// What is signed.
        of: String,
        /// What is wrong with the key.
        reason: &'static str,
    },
    /// A certificate was not valid when the stamp was made.
    #[error(
        "the certificate of {subject} was valid from {from} until {until}, not at the stamp's time, {time}; \
         ask for another stamp"
    )]
    Expired {
        /// Whose certificate.
        subject: String,
        /// The beginning.
        from: String,
        /// The end.
        until: String,
        /// The stamp's time.
        time: Time,
    },
    /// A certificate is not for what it is used for here.
    #[error("the certificate of {subject} {reason}; ask another authority")]
    Use {
        /// Whose certificate.
        subject: String,
        /// What is wrong.
        reason: String,
    },
    /// No chain of certificates leads to a root.
    #[error(
        "the stamp does not lead to a root that you trust: none has issued for {issuer}; \
         if you trust that authority, add its root certificate"
    )]
    Untrusted {
        /// Who should be among the roots, or have a certificate that leads there.
        issuer: String,
    },
    /// More ways from certificate to certificate than any honest stamp has.
    #[error("the stamp's certificates can be combined in too many ways; ask another authority")]
    TooManyPaths,
    /// The text of roots holds no root.
    #[error("no root: {0}; give the authority's self-signed root certificate in PEM")]
    NoRoots(String),
}

impl StampError {
    /// For `map_err`: that some part can't be read.
    pub(crate) fn malformed(part: &'static str) -> impl Fn(der::Error) -> Self {
        move |error| Self::Malformed {
            part,
            reason: error.to_string(),
        }
    }

    /// For `map_err`: what is wrong with the signature of something.
    pub(crate) fn signature(of: &str) -> impl Fn(Fault) -> Self {
        let of = of.to_string();
        move |fault| {
            let of = of.clone();
            match fault {
                Fault::Wrong => Self::Signature { of },
                Fault::Algorithm(algorithm) => Self::Algorithm { of, algorithm },
                Fault::Key(reason) => Self::Key { of, reason },
            }
        }
    }
}
