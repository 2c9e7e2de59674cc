use std::time::Duration;

use der::{
    Any, Decode, Encode, Tag, TagNumber, Tagged,
    asn1::{ObjectIdentifier, OctetStringRef, SetOfVec},
    oid::AssociatedOid,
};
use sha2::Sha256;
use x509_cert::spki::AlgorithmIdentifierOwned;

use crate::{
    Query, Roots, StampError, Time,
    attributes::{Attributes, NamedCertificates},
    certificate::{Certificate, is_directory_name},
    message::{self, ContentInfo, IssuerAndSerial, SignedData, SignerInfo, TimeStampResp, TstInfo},
    signature::{self, Hash},
    status,
};

/// An authority's word that a digest existed at a time: a TimeStampToken (RFC 3161 section 2.4.2), read but not yet checked.
#[derive(Clone, Debug)]
pub struct Stamp {
    /// What is signed, as it came.
    content: Vec<u8>,
    info: TstInfo,
    time: Time,
    signer: SignerInfo,
    /// Those that came along and can be read.
    certificates: Vec<Certificate>,
}

/// What a stamp says that checks.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Stamped {
    /// When.
    pub time: Time,
    /// How far the time may be off, if the authority says so.
    pub accuracy: Option<Duration>,
    /// Who says so: the subject of the signer's certificate, as RFC 4514 writes it.
    pub authority: String,
    /// The stamp's number, in hexadecimal; no other stamp of this authority has it.
    pub serial: String,
    /// The policy that the authority stamped under, an object identifier.
    pub policy: String,
}

impl Stamp {
    /// Reads an authority's reply, a TimeStampResp in DER, or the TimeStampToken of one. Nothing is checked yet but that a
    /// stamp was granted and can be read.
    ///
    /// # Errors
    /// [`StampError::Refused`] with the authority's reason; the other variants when the reply is no stamp that can be read.
    pub fn from_reply(reply: &[u8]) -> Result<Self, StampError> {
        crate::check_size(reply.len())?;
        let token = match ContentInfo::from_der(reply) {
            Ok(token) => token,
            Err(_) => {
                let response = TimeStampResp::from_der(reply).map_err(StampError::malformed("reply"))?;
                status::check_granted(&response.status)?;
                let token = response.token.ok_or(StampError::NoToken)?;
                token.decode_as().map_err(StampError::malformed("token"))?
            }
        };
        Self::from_token(&token)
    }

    /// RFC 3161 section 2.4.2: signed data with one signer, which hold a TSTInfo of version 1.
    fn from_token(token: &ContentInfo<'_>) -> Result<Self, StampError> {
        if token.content_type != message::SIGNED_DATA {
            return Err(StampError::AnotherContent(token.content_type));
        }
        let data: SignedData = token
            .content
            .decode_as()
            .map_err(StampError::malformed("signed message"))?;
        if data.content.content_type != message::TST_INFO {
            return Err(StampError::AnotherContent(data.content.content_type));
        }
        let [signer] = data.signers.as_ref() else {
            return Err(StampError::Signers(data.signers.len()));
        };
        let malformed = StampError::malformed("signed message");
        let signer: SignerInfo = signer.decode_as().map_err(&malformed)?;
        if !lists(&data.digest_algorithms, &signer.digest_algorithm) {
            return Err(StampError::Changed("list of hash functions"));
        }
        let content = data
            .content
            .content
            .map(|content| content.as_bytes().to_vec())
            .unwrap_or_default();
        let info = TstInfo::from_der(&content).map_err(StampError::malformed("statement of the time"))?;
        check_understood(&info)?;
        let certificates = data.certificates.unwrap_or_default();
        let certificates = certificates
            .iter()
            .filter_map(|certificate| Certificate::from_der(&certificate.to_der().ok()?).ok());
        Ok(Self {
            time: Time::from_asn1(&info.time)?,
            certificates: certificates.collect(),
            content,
            info,
            signer,
        })
    }

    /// The time that the stamp says, whoever wrote it.
    pub fn claimed_time(&self) -> Time {
        self.time
    }

    /// Whether the stamp is of this SHA-256 digest, whoever wrote it.
    ///
    /// # Errors
    /// [`StampError::AnotherDigest`], [`StampError::AnotherHash`].
    pub fn check_covers(&self, digest: &[u8; 32]) -> Result<(), StampError> {
        let imprint = &self.info.imprint;
        if imprint.algorithm.oid != Sha256::OID {
            return Err(StampError::AnotherHash(imprint.algorithm.oid));
        }
        match imprint.digest.as_bytes() == digest {
            true => Ok(()),
            false => Err(StampError::AnotherDigest(hex(imprint.digest.as_bytes()))),
        }
    }

    /// Whether the stamp was made for this query: it is of the same digest and repeats the nonce (RFC 3161 section 2.4.2).
    ///
    /// # Errors
    /// [`StampError::Nonce`], and those of [`check_covers`](Self::check_covers).
    pub fn check_answers(&self, query: &Query) -> Result<(), StampError> {
        self.check_covers(query.digest())?;
        let repeated = self.info.nonce.as_ref().map(|nonce| unsigned(nonce.as_bytes()));
        match query.nonce_bytes() {
            Some(nonce) if repeated != Some(unsigned(&nonce)) => Err(StampError::Nonce),
            _ => Ok(()),
        }
    }

    /// Checks all of the stamp: that it is of this SHA-256 digest, that its authority signed it, and that the authority's
    /// certificate is one for time stamps, which led to one of `roots` when the stamp was made.
    ///
    /// # Errors
    /// What is wrong first, as a variant of [`StampError`].
    pub fn verify(&self, digest: &[u8; 32], roots: &Roots) -> Result<Stamped, StampError> {
        self.check_covers(digest)?;
        let sent = || self.certificates.iter();
        // An authority may be a root itself, and send nothing.
        let certificate = sent()
            .chain(roots.all())
            .find(|certificate| self.is_signed_by(certificate))
            .ok_or(StampError::NoCertificate)?;
        let named = self.check_signature(certificate)?;
        certificate.check_stamps()?;
        self.check_authority(certificate)?;
        let others = sent().chain(roots.helpers()).filter(|other| named.allow(other));
        roots.check(certificate, others.collect(), self.time)?;
        Ok(Stamped {
            time: self.time,
            accuracy: self.accuracy(),
            authority: certificate.name(),
            serial: hex(unsigned(self.info.serial.as_bytes())),
            policy: self.info.policy.to_string(),
        })
    }

    /// Whether the signer says that this is his certificate (RFC 5652 section 5.3).
    fn is_signed_by(&self, certificate: &Certificate) -> bool {
        let who = &self.signer.who;
        match who.tag() {
            Tag::Sequence => who.decode_as::<IssuerAndSerial>().is_ok_and(|who| {
                who.issuer == *certificate.issuer() && who.serial.as_bytes() == certificate.serial()
            }),
            Tag::ContextSpecific {
                number: TagNumber(0), ..
            } => certificate.has_key_identifier(who.value()),
            _ => false,
        }
    }

    /// RFC 5652 section 5.4: the signature is over the attributes, and they are over the content. Answers which certificates
    /// they name.
    fn check_signature(&self, certificate: &Certificate) -> Result<NamedCertificates, StampError> {
        let attributes = Attributes(
            self.signer
                .signed
                .as_ref()
                .ok_or(StampError::Attribute("content"))?,
        );
        let malformed = StampError::malformed("signed attributes");
        let content_type: ObjectIdentifier = attributes
            .needed(message::CONTENT_TYPE, "content's type")?
            .decode_as()
            .map_err(&malformed)?;
        if content_type != message::TST_INFO {
            return Err(StampError::Changed("content's type"));
        }
        let fault = StampError::signature("the stamp");
        let hash = Hash::named(&self.signer.digest_algorithm).map_err(&fault)?;
        let digest: &OctetStringRef = attributes
            .needed(message::MESSAGE_DIGEST, "digest")?
            .decode_as()
            .map_err(&malformed)?;
        if digest.as_bytes() != hash.digest(&self.content) {
            return Err(StampError::Changed("content"));
        }
        let named = attributes.certificates()?;
        if !named.begin_with(certificate) {
            return Err(StampError::AnotherSigner("certificate"));
        }
        let signed = attributes.0.to_der().map_err(malformed)?;
        let SignerInfo {
            signature_algorithm,
            signature,
            ..
        } = &self.signer;
        signature::check(
            certificate.key(),
            signature_algorithm,
            Some(hash),
            &signed,
            signature.as_bytes(),
        )
        .map_err(fault)?;
        Ok(named)
    }

    /// RFC 3161 section 2.4.2, `tsa`: if the stamp says whose it is, it is one of the names in the signer's certificate.
    fn check_authority(&self, certificate: &Certificate) -> Result<(), StampError> {
        let Some(said) = &self.info.authority else {
            return Ok(());
        };
        match is_directory_name(said, certificate.subject()) || certificate.other_names().contains(said) {
            true => Ok(()),
            false => Err(StampError::AnotherSigner("authority")),
        }
    }

    fn accuracy(&self) -> Option<Duration> {
        let accuracy = self.info.accuracy.as_ref()?;
        Some(
            Duration::from_secs(accuracy.seconds.unwrap_or(0).into())
                + Duration::from_millis(accuracy.millis.unwrap_or(0).into())
                + Duration::from_micros(accuracy.micros.unwrap_or(0).into()),
        )
    }
}

/// The version, and that no extension has to be understood that is not: RFC 3161 defines none.
fn check_understood(info: &TstInfo) -> Result<(), StampError> {
    let malformed = |reason: String| StampError::Malformed {
        part: "statement of the time",
        reason,
    };
    if info.version != 1 {
        return Err(malformed(format!("it has version {}, not 1", info.version)));
    }
    let mut extensions = info.extensions.iter().flatten();
    match extensions.find(|extension| extension.critical) {
        Some(extension) => Err(malformed(format!(
            "its extension {} is not understood here",
            extension.extn_id
        ))),
        None => Ok(()),
    }
}

/// Whether a signer's hash function is in the list of them; if not, the signature may be refused (RFC 5652 section 5.1).
fn lists(algorithms: &SetOfVec<AlgorithmIdentifierOwned>, signers: &AlgorithmIdentifierOwned) -> bool {
    let plain = |listed: &AlgorithmIdentifierOwned| listed.parameters.as_ref().is_none_or(Any::is_null);
    algorithms
        .iter()
        .any(|listed| listed.oid == signers.oid && plain(listed))
}

/// A number without leading zeros: INTEGERs have one before a first bit that is set.
fn unsigned(bytes: &[u8]) -> &[u8] {
    let zeros = bytes.iter().take_while(|&&byte| byte == 0).count();
    &bytes[zeros.min(bytes.len().saturating_sub(1))..]
}

/// Bytes in hexadecimal.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
