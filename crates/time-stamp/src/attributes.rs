//! The attributes that a stamp's signature covers (RFC 5652 section 11), and the certificates that they name.

use der::{
    Any,
    asn1::{ObjectIdentifier, SetOfVec},
};

use crate::{
    StampError,
    certificate::{Certificate, is_directory_name},
    message::{
        Attribute, CertificateId, IssuerSerial, SIGNING_CERTIFICATE, SIGNING_CERTIFICATE_V2,
        SigningCertificate,
    },
    signature::{self, Hash},
};

/// More certificates than this are not heeded: no chain is so long.
const MOST_NAMED: usize = 20;

/// The attributes that are signed.
pub(crate) struct Attributes<'a>(pub(crate) &'a SetOfVec<Attribute>);

impl<'a> Attributes<'a> {
    /// The one value of an attribute that has to be there once (RFC 5652 section 5.3).
    pub(crate) fn needed(&self, name: ObjectIdentifier, shown: &'static str) -> Result<&'a Any, StampError> {
        self.single(name, shown)?.ok_or(StampError::Attribute(shown))
    }

    fn single(&self, name: ObjectIdentifier, shown: &'static str) -> Result<Option<&'a Any>, StampError> {
        let mut found = self.0.iter().filter(|attribute| attribute.name == name);
        let (first, second) = (found.next(), found.next());
        match (first.map(|attribute| attribute.values.as_ref()), second) {
            (None, _) => Ok(None),
            (Some([value]), None) => Ok(Some(value)),
            _ => Err(StampError::Attribute(shown)),
        }
    }

    /// The certificates that the signer names. A stamp has to say that (RFC 3161 section 2.4.2, RFC 5816), in one way or in both.
    pub(crate) fn certificates(&self) -> Result<NamedCertificates, StampError> {
        let shown = "signer's certificate";
        let mut lists = Vec::new();
        for attribute in [SIGNING_CERTIFICATE, SIGNING_CERTIFICATE_V2] {
            if let Some(value) = self.single(attribute, shown)? {
                lists.push(listed(value, attribute == SIGNING_CERTIFICATE_V2)?);
            }
        }
        match lists.is_empty() {
            true => Err(StampError::Attribute(shown)),
            false => Ok(NamedCertificates(lists)),
        }
    }
}

/// The certificates of an attribute; its second version has SHA-256 where it names no hash function, the first has SHA-1.
fn listed(value: &Any, second: bool) -> Result<Vec<Named>, StampError> {
    let malformed = StampError::malformed("signed attributes");
    let list: SigningCertificate = value.decode_as().map_err(malformed)?;
    if list.certificates.len() > MOST_NAMED {
        return Err(StampError::TooManyPaths);
    }
    let hash = |id: &CertificateId| match &id.algorithm {
        Some(algorithm) => Hash::named(algorithm).map(Some),
        None => Ok(second.then_some(Hash::Sha256)),
    };
    let named = list.certificates.into_iter();
    let named: Result<_, _> = named.map(|id| Ok(Named { hash: hash(&id)?, id })).collect();
    named.map_err(StampError::signature("the stamp"))
}

/// Lists of certificates: first the signer's, then perhaps all that may be between it and the root.
pub(crate) struct NamedCertificates(Vec<Vec<Named>>);

/// A certificate by its digest.
struct Named {
    /// SHA-1 if there is none. To put another certificate in the place of one that exists takes more than its collisions.
    hash: Option<Hash>,
    id: CertificateId,
}

impl NamedCertificates {
    /// Whether this is the signer's certificate.
    pub(crate) fn begin_with(&self, certificate: &Certificate) -> bool {
        let first = |list: &Vec<Named>| list.first().is_some_and(|named| named.is(certificate));
        self.0.iter().all(first)
    }

    /// Whether this may be a certificate of the chain: where only the signer's is named, any (RFC 2634 section 5.4).
    pub(crate) fn allow(&self, certificate: &Certificate) -> bool {
        let allows = |list: &Vec<Named>| list.len() == 1 || list.iter().any(|named| named.is(certificate));
        self.0.iter().all(allows)
    }
}

impl Named {
    /// RFC 2634 section 5.4.1 and RFC 5035 section 4.
    fn is(&self, certificate: &Certificate) -> bool {
        let digest = match self.hash {
            None => signature::sha1(certificate.der()),
            Some(hash) => hash.digest(certificate.der()),
        };
        let issued = |issuer: &IssuerSerial| match issuer.names.as_slice() {
            [name] => {
                is_directory_name(name, certificate.issuer())
                    && issuer.serial.as_bytes() == certificate.serial()
            }
            _ => false,
        };
        digest == self.id.digest.as_bytes() && self.id.issuer.as_ref().is_none_or(issued)
    }
}
