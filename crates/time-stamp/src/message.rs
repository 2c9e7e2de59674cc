//! The messages of RFC 3161 and those of RFC 5652 that they lie in, field by field, as ASN.1 has them.
//!
//! Read as DER. What is signed is kept as it came: the content as octets, the attributes as the set that is signed.

use der::{
    Any, AnyRef, Sequence, ValueOrd,
    asn1::{BitString, Int, ObjectIdentifier, OctetString, SetOfVec, Uint},
};
use x509_cert::{ext::Extensions, name::Name, spki::AlgorithmIdentifierOwned};

/// Object identifiers by their numbers.
macro_rules! oids {
    ($($(#[$doc:meta])* $name:ident = $number:literal;)*) => {
        $($(#[$doc])* pub(crate) const $name: ObjectIdentifier = ObjectIdentifier::new_unwrap($number);)*
    };
}
pub(crate) use oids;

oids! {
    /// id-signedData, RFC 5652 section 5.1.
    SIGNED_DATA = "1.2.840.113549.1.7.2";
    /// id-ct-TSTInfo, RFC 3161 section 2.4.2.
    TST_INFO = "1.2.840.113549.1.9.16.1.4";
    /// id-contentType, RFC 5652 section 11.1.
    CONTENT_TYPE = "1.2.840.113549.1.9.3";
    /// id-messageDigest, RFC 5652 section 11.2.
    MESSAGE_DIGEST = "1.2.840.113549.1.9.4";
    /// id-aa-signingCertificate, RFC 2634 section 5.4.
    SIGNING_CERTIFICATE = "1.2.840.113549.1.9.16.2.12";
    /// id-aa-signingCertificateV2, RFC 5035 section 3.
    SIGNING_CERTIFICATE_V2 = "1.2.840.113549.1.9.16.2.47";
}

/// TimeStampReq, RFC 3161 section 2.4.1, without policy and extensions.
#[derive(Sequence)]
pub(crate) struct TimeStampReq {
    pub(crate) version: u8,
    pub(crate) imprint: MessageImprint,
    #[asn1(optional = "true")]
    pub(crate) nonce: Option<Uint>,
    #[asn1(default = "Default::default")]
    pub(crate) cert_req: bool,
}

/// MessageImprint, RFC 3161 section 2.4.1.
#[derive(Clone, Debug, Sequence)]
pub(crate) struct MessageImprint {
    pub(crate) algorithm: AlgorithmIdentifierOwned,
    pub(crate) digest: OctetString,
}

/// TimeStampResp, RFC 3161 section 2.4.2.
#[derive(Sequence)]
pub(crate) struct TimeStampResp<'a> {
    pub(crate) status: StatusInfo,
    #[asn1(optional = "true")]
    pub(crate) token: Option<AnyRef<'a>>,
}

/// PKIStatusInfo, RFC 3161 section 2.4.2.
#[derive(Sequence)]
pub(crate) struct StatusInfo {
    pub(crate) status: Int,
    #[asn1(optional = "true")]
    pub(crate) text: Option<Vec<Any>>,
    #[asn1(optional = "true")]
    pub(crate) failure: Option<BitString>,
}

/// ContentInfo, RFC 5652 section 3.
#[derive(Sequence)]
pub(crate) struct ContentInfo<'a> {
    pub(crate) content_type: ObjectIdentifier,
    #[asn1(context_specific = "0", tag_mode = "EXPLICIT")]
    pub(crate) content: AnyRef<'a>,
}

/// SignedData, RFC 5652 section 5.1. The sets of certificates and revocation lists are read as sequences are: an implicit
/// tag stands in place of either's, and their order means nothing.
#[derive(Sequence)]
pub(crate) struct SignedData {
    pub(crate) version: u8,
    pub(crate) digest_algorithms: SetOfVec<AlgorithmIdentifierOwned>,
    pub(crate) content: EncapsulatedContent,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) certificates: Option<Vec<Any>>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) revocations: Option<Vec<Any>>,
    pub(crate) signers: SetOfVec<Any>,
}

/// EncapsulatedContentInfo, RFC 5652 section 5.2.
#[derive(Sequence)]
pub(crate) struct EncapsulatedContent {
    pub(crate) content_type: ObjectIdentifier,
    #[asn1(context_specific = "0", tag_mode = "EXPLICIT", optional = "true")]
    pub(crate) content: Option<OctetString>,
}

/// SignerInfo, RFC 5652 section 5.3.
#[derive(Clone, Debug, Sequence)]
pub(crate) struct SignerInfo {
    pub(crate) version: u8,
    /// IssuerAndSerialNumber, or [0] SubjectKeyIdentifier.
    pub(crate) who: Any,
    pub(crate) digest_algorithm: AlgorithmIdentifierOwned,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) signed: Option<SetOfVec<Attribute>>,
    pub(crate) signature_algorithm: AlgorithmIdentifierOwned,
    pub(crate) signature: OctetString,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) unsigned: Option<Vec<Any>>,
}

/// Attribute, RFC 5652 section 5.3.
#[derive(Clone, Debug, PartialEq, Eq, Sequence, ValueOrd)]
pub(crate) struct Attribute {
    pub(crate) name: ObjectIdentifier,
    pub(crate) values: SetOfVec<Any>,
}

/// IssuerAndSerialNumber, RFC 5652 section 10.2.4.
#[derive(Sequence)]
pub(crate) struct IssuerAndSerial {
    pub(crate) issuer: Name,
    pub(crate) serial: Int,
}

/// SigningCertificate, RFC 2634 section 5.4, and SigningCertificateV2, RFC 5035 section 3.
#[derive(Sequence)]
pub(crate) struct SigningCertificate {
    pub(crate) certificates: Vec<CertificateId>,
    #[asn1(optional = "true")]
    pub(crate) policies: Option<Any>,
}

/// ESSCertID, RFC 2634 section 5.4.1, which has no algorithm, and ESSCertIDv2, RFC 5035 section 4.
#[derive(Sequence)]
pub(crate) struct CertificateId {
    #[asn1(optional = "true")]
    pub(crate) algorithm: Option<AlgorithmIdentifierOwned>,
    pub(crate) digest: OctetString,
    #[asn1(optional = "true")]
    pub(crate) issuer: Option<IssuerSerial>,
}

/// IssuerSerial, RFC 5035 section 4.
#[derive(Sequence)]
pub(crate) struct IssuerSerial {
    /// GeneralNames.
    pub(crate) names: Vec<Any>,
    pub(crate) serial: Int,
}

/// TSTInfo, RFC 3161 section 2.4.2.
#[derive(Clone, Debug, Sequence)]
pub(crate) struct TstInfo {
    pub(crate) version: u8,
    pub(crate) policy: ObjectIdentifier,
    pub(crate) imprint: MessageImprint,
    pub(crate) serial: Int,
    /// GeneralizedTime, with fractions of seconds, which DER certificates have not: [`Time`](crate::Time) reads it.
    pub(crate) time: Any,
    #[asn1(optional = "true")]
    pub(crate) accuracy: Option<Accuracy>,
    #[asn1(default = "Default::default")]
    pub(crate) ordering: bool,
    #[asn1(optional = "true")]
    pub(crate) nonce: Option<Int>,
    /// GeneralName.
    #[asn1(context_specific = "0", tag_mode = "EXPLICIT", optional = "true")]
    pub(crate) authority: Option<Any>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) extensions: Option<Extensions>,
}

/// Accuracy, RFC 3161 section 2.4.2.
#[derive(Clone, Debug, Sequence)]
pub(crate) struct Accuracy {
    #[asn1(optional = "true")]
    pub(crate) seconds: Option<u32>,
    #[asn1(context_specific = "0", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) millis: Option<u16>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    pub(crate) micros: Option<u16>,
}
