use std::collections::BTreeSet;

use der::{
    Any, AnyRef, Decode, Encode, Sequence, Tag, TagNumber, Tagged,
    asn1::{BitString, ObjectIdentifier},
    oid::AssociatedOid,
};
use x509_cert::{
    TbsCertificate, Version,
    ext::pkix::{
        BasicConstraints, CertificatePolicies, ExtendedKeyUsage, KeyUsage, KeyUsages, NameConstraints,
        SubjectAltName, SubjectKeyIdentifier,
    },
    name::Name,
    spki::{AlgorithmIdentifierOwned, SubjectPublicKeyInfoOwned},
};

use crate::{StampError, Time, message::oids, signature};

oids! {
    /// id-kp-timeStamping, RFC 5280 section 4.2.1.12.
    TIME_STAMPING = "1.3.6.1.5.5.7.3.8";
    /// anyExtendedKeyUsage, in the same place.
    ANY_USAGE = "2.5.29.37.0";
}

/// The extensions that are heeded here; any other that is critical is refused (RFC 5280 section 4.2). Where every policy
/// will do, policies need nothing more (section 6.1.1 c), nor do the names of somebody who is known by his subject.
const HEEDED: [ObjectIdentifier; 5] = [
    BasicConstraints::OID,
    KeyUsage::OID,
    ExtendedKeyUsage::OID,
    CertificatePolicies::OID,
    SubjectAltName::OID,
];

/// A certificate (RFC 5280 section 4.1) with the bytes that its issuer signed.
#[derive(Clone, Debug)]
pub(crate) struct Certificate {
    der: Vec<u8>,
    /// The part that is signed, as it came.
    signed: Vec<u8>,
    content: TbsCertificate,
    algorithm: AlgorithmIdentifierOwned,
    signature: Vec<u8>,
}

/// Certificate, RFC 5280 section 4.1.
#[derive(Sequence)]
struct Outer<'a> {
    content: AnyRef<'a>,
    algorithm: AlgorithmIdentifierOwned,
    signature: BitString,
}

impl Certificate {
    pub(crate) fn from_der(der: &[u8]) -> Result<Self, der::Error> {
        let outer = Outer::from_der(der)?;
        let whole_bytes = outer
            .signature
            .as_bytes()
            .ok_or_else(|| Tag::BitString.value_error())?;
        Ok(Self {
            der: der.to_vec(),
            signed: outer.content.to_der()?,
            content: outer.content.decode_as()?,
            algorithm: outer.algorithm,
            signature: whole_bytes.to_vec(),
        })
    }

    pub(crate) fn der(&self) -> &[u8] {
        &self.der
    }

    pub(crate) fn subject(&self) -> &Name {
        self.content.subject()
    }

    pub(crate) fn issuer(&self) -> &Name {
        self.content.issuer()
    }

    /// The serial number, as the INTEGER's bytes.
    pub(crate) fn serial(&self) -> &[u8] {
        self.content.serial_number().as_bytes()
    }

    pub(crate) fn key(&self) -> &SubjectPublicKeyInfoOwned {
        self.content.subject_public_key_info()
    }

    /// Whose it is, for people.
    pub(crate) fn name(&self) -> String {
        shown(self.subject())
    }

    /// RFC 5280 section 3.2: by the same entity for itself, if perhaps with another key.
    pub(crate) fn is_self_issued(&self) -> bool {
        self.subject() == self.issuer()
    }

    pub(crate) fn has_key_identifier(&self, identifier: &[u8]) -> bool {
        let own = self.content.get_extension::<SubjectKeyIdentifier>();
        own.is_ok_and(|own| own.is_some_and(|(_, own)| own.0.as_bytes() == identifier))
    }

    /// The subject's other names, each as a GeneralName.
    pub(crate) fn other_names(&self) -> Vec<Any> {
        let extensions = self.content.extensions().into_iter().flatten();
        extensions
            .filter(|extension| extension.extn_id == SubjectAltName::OID)
            .flat_map(|extension| Vec::from_der(extension.extn_value.as_bytes()).unwrap_or_default())
            .collect()
    }

    /// That the certificate can be relied on at `time`: then it was valid (RFC 5280 section 4.1.2.5), and all of it that has to be
    /// understood is.
    pub(crate) fn check(&self, time: Time) -> Result<(), StampError> {
        self.check_extensions()?;
        let validity = self.content.validity();
        let (from, until) = (
            validity.not_before.to_date_time(),
            validity.not_after.to_date_time(),
        );
        if (from..=until).contains(&time.whole_seconds()) {
            return Ok(());
        }
        Err(StampError::Expired {
            subject: self.name(),
            from: from.to_string(),
            until: until.to_string(),
            time,
        })
    }

    /// RFC 5280 section 4.2: none twice, and none that is critical and unknown. Name constraints would have to be heeded
    /// (section 4.2.1.10), and are not.
    fn check_extensions(&self) -> Result<(), StampError> {
        let mut seen = BTreeSet::new();
        for extension in self.content.extensions().into_iter().flatten() {
            let oid = extension.extn_id;
            if !seen.insert(oid) {
                return Err(self.misused(format!("has the extension {oid} twice")));
            }
            if oid == NameConstraints::OID || extension.critical && !HEEDED.contains(&oid) {
                return Err(self.misused(format!("has the extension {oid}, which is not understood here")));
            }
        }
        Ok(())
    }

    /// RFC 3161 section 2.3: for time stamps and nothing else, and critically so. RFC 5280 section 4.2.1.12 adds which uses
    /// of the key are consistent with that.
    pub(crate) fn check_stamps(&self) -> Result<(), StampError> {
        match self.extension::<ExtendedKeyUsage>()? {
            Some((true, usage)) if usage.0 == [TIME_STAMPING] => {}
            Some((false, usage)) if usage.0 == [TIME_STAMPING] => {
                return Err(self.misused("is for time stamps, but does not say so critically"));
            }
            _ => return Err(self.misused("is not one for time stamps alone")),
        }
        let consistent = KeyUsages::DigitalSignature | KeyUsages::NonRepudiation;
        match self.extension::<KeyUsage>()? {
            Some((_, usage)) if usage.0.is_empty() || !(usage.0 - consistent).is_empty() => {
                Err(self.misused("has a key for other uses than signatures"))
            }
            _ => Ok(()),
        }
    }

    /// That it may issue certificates, with so many others that may between it and the signer's (RFC 5280 section 6.1.4 k to n).
    /// Where it says what they may be used for, time stamps have to be among it.
    pub(crate) fn check_issues(&self, between: usize) -> Result<(), StampError> {
        let constraints = self
            .extension::<BasicConstraints>()?
            .map(|(_, constraints)| constraints);
        let constraints =
            constraints.filter(|constraints| constraints.ca && self.content.version() == Version::V3);
        let Some(constraints) = constraints else {
            return Err(self.misused("is not one of an authority that issues certificates"));
        };
        if constraints
            .path_len_constraint
            .is_some_and(|most| between > most.into())
        {
            return Err(self.misused("allows fewer certificates between it and the stamp"));
        }
        if self
            .extension::<KeyUsage>()?
            .is_some_and(|(_, usage)| !usage.key_cert_sign())
        {
            return Err(self.misused("has a key that may not sign certificates"));
        }
        let fits =
            |usage: &ExtendedKeyUsage| [TIME_STAMPING, ANY_USAGE].iter().any(|one| usage.0.contains(one));
        match self.extension::<ExtendedKeyUsage>()? {
            Some((_, usage)) if !fits(&usage) => {
                Err(self.misused("may not issue certificates for time stamps"))
            }
            _ => Ok(()),
        }
    }

    /// RFC 5280 section 6.1.3 a 1, and section 4.1.1.2: the algorithm outside is the one that is signed.
    pub(crate) fn check_signature(&self, issuer: &Self) -> Result<(), StampError> {
        let of = format!("the certificate of {}", self.name());
        if self.algorithm != *self.content.signature() {
            return Err(StampError::Signature { of });
        }
        signature::check(issuer.key(), &self.algorithm, None, &self.signed, &self.signature)
            .map_err(StampError::signature(&of))
    }

    /// An extension, and whether it is critical.
    fn extension<'a, T: Decode<'a, Error = der::Error> + AssociatedOid>(
        &'a self,
    ) -> Result<Option<(bool, T)>, StampError> {
        let found = self.content.get_extension::<T>();
        found.map_err(|_| self.misused(format!("has a damaged extension {}", T::OID)))
    }

    fn misused(&self, reason: impl Into<String>) -> StampError {
        StampError::Use {
            subject: self.name(),
            reason: reason.into(),
        }
    }
}

/// A distinguished name as RFC 4514 writes it.
pub(crate) fn shown(name: &Name) -> String {
    match name.is_empty() {
        true => "somebody without a name".into(),
        false => name.to_string(),
    }
}

/// Whether a GeneralName is this name: of the kind directoryName (RFC 5280 section 4.2.1.6), with the same bytes.
pub(crate) fn is_directory_name(general: &Any, name: &Name) -> bool {
    let number = TagNumber(4);
    let constructed = true;
    general.tag() == Tag::ContextSpecific { constructed, number }
        && name.to_der().is_ok_and(|name| name == general.value())
}
