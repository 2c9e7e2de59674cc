use der::{
    Any, Encode,
    asn1::{OctetString, Uint},
    oid::AssociatedOid,
};
use sha2::Sha256;
use x509_cert::spki::AlgorithmIdentifierOwned;

use crate::{
    StampError,
    message::{MessageImprint, TimeStampReq},
};

/// What is sent to an authority: a TimeStampReq (RFC 3161 section 2.4.1) over a SHA-256 digest. It asks for the authority's
/// certificates, which a check years later needs, and leaves the policy to the authority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Query {
    digest: [u8; 32],
    nonce: Option<u64>,
}

impl Query {
    /// Asks for a stamp over the SHA-256 digest of something.
    pub fn new(digest: [u8; 32]) -> Self {
        Self { digest, nonce: None }
    }

    /// A number that nobody can guess, which the authority repeats: it shows that the reply was made for this query.
    /// Draw it from the operating system's generator.
    #[must_use]
    pub fn nonce(self, nonce: u64) -> Self {
        Self {
            nonce: Some(nonce),
            ..self
        }
    }

    /// The query in DER: a `.tsq` file, or the body of an HTTP POST of type `application/timestamp-query` (RFC 3161 section 3.4).
    ///
    /// # Errors
    /// None that any digest or nonce can cause.
    pub fn to_der(&self) -> Result<Vec<u8>, StampError> {
        let encode = || {
            let algorithm = AlgorithmIdentifierOwned {
                oid: Sha256::OID,
                parameters: Some(Any::null()),
            };
            let digest = OctetString::new(self.digest)?;
            let nonce = self.nonce_bytes().map(|nonce| Uint::new(&nonce));
            TimeStampReq {
                version: 1,
                imprint: MessageImprint { algorithm, digest },
                nonce: nonce.transpose()?,
                cert_req: true,
            }
            .to_der()
        };
        encode().map_err(StampError::malformed("query"))
    }

    pub(crate) fn digest(&self) -> &[u8; 32] {
        &self.digest
    }

    pub(crate) fn nonce_bytes(&self) -> Option<[u8; 8]> {
        self.nonce.map(u64::to_be_bytes)
    }
}
