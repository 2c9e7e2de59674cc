use crate::payload::Curve;

/// Why a key could not be read or written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// There is no PEM block in the text.
    #[error(
        "no PEM block (\"-----BEGIN …-----\") was found: give a key file in PEM form, such as `openssl genpkey` writes"
    )]
    NotPem,
    /// The PEM block is not well-formed.
    #[error("the PEM block is damaged ({detail}): copy the key file again, unchanged")]
    DamagedPem {
        /// What is wrong with it.
        detail: String,
    },
    /// Something follows the key.
    #[error("there is text after the key's PEM block: give a file that holds this one key only")]
    TrailingText,
    /// The PEM block holds something else than asked for.
    #[error("a {expected} is needed, but the file holds a {found:?}: {remedy}")]
    WrongKind {
        /// "private key" or "public key".
        expected: &'static str,
        /// The label of the PEM block.
        found: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The private key is locked.
    #[error("the private key is locked by a passphrase: give the passphrase")]
    PassphraseNeeded,
    /// The private key is not locked, but a passphrase was given.
    #[error(
        "the private key is not locked, but a passphrase was given: read it without, or lock it with `openssl pkcs8 -topk8`"
    )]
    NotEncrypted,
    /// A key would be locked by nothing.
    #[error("the passphrase is empty: choose one, or store the key without")]
    EmptyPassphrase,
    /// The key cannot be unlocked by this passphrase.
    #[error("the passphrase is wrong (or the file is damaged): try again")]
    WrongPassphrase,
    /// The key is locked in OpenSSL's old way, by headers in the PEM block.
    #[error(
        "the key is locked in the old OpenSSL form (\"Proc-Type: 4,ENCRYPTED\"): convert it with `openssl pkcs8 -topk8`"
    )]
    LegacyEncryption,
    /// The key is locked by an algorithm that is not supported.
    #[error(
        "the key is locked in a way that is not supported ({detail}): convert it with `openssl pkcs8 -topk8`"
    )]
    UnsupportedEncryption {
        /// What was found.
        detail: String,
    },
    /// To unlock the key would take more time or memory than is reasonable.
    #[error(
        "to unlock the key its file asks for {found} {what}, more than the {limit} allowed here: convert it with `openssl pkcs8 -topk8`"
    )]
    CostlyEncryption {
        /// "PBKDF2 iterations", "bytes of scrypt memory", or "rounds of scrypt".
        what: &'static str,
        /// What the file asks for.
        found: u64,
        /// What is allowed.
        limit: u64,
    },
    /// The DER structure inside the PEM block is not that of a key.
    #[error(
        "the key's contents are not a valid {what} ({detail}): the file is damaged or not a key; export it again"
    )]
    DamagedDer {
        /// "PKCS#8 private key", "SEC1 private key", "public key" or "encrypted private key".
        what: &'static str,
        /// What the parser says.
        detail: String,
    },
    /// The key is not an elliptic curve key.
    #[error(
        "the key's algorithm is {name} ({oid}), not an elliptic curve's: make one with `openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256`"
    )]
    WrongAlgorithm {
        /// Its name, or "unknown".
        name: &'static str,
        /// Its object identifier.
        oid: String,
    },
    /// The key is on a curve that is not supported.
    #[error(
        "the key's curve {oid} is not supported: use P-256 (1.2.840.10045.3.1.7) or, for the paper's scheme, B-163 (1.3.132.0.15)"
    )]
    UnknownCurve {
        /// Object identifier of the curve.
        oid: String,
    },
    /// The key does not name its curve.
    #[error(
        "the key does not name its curve (it spells it out, or leaves it out): convert it with `openssl ec -param_enc named_curve`"
    )]
    CurveNotNamed,
    /// The key names two curves.
    #[error("the key names two different curves, {outer} and {inner}: the file is damaged; export it again")]
    CurvesDisagree {
        /// Object identifier outside.
        outer: String,
        /// Object identifier inside.
        inner: String,
    },
    /// A private key is zero, too large or of a wrong length.
    #[error(
        "the private key is not between 1 and d - 1, d the order of {curve}: the file is damaged, or the key must not be used; make a new one"
    )]
    ScalarOutOfRange {
        /// The key's curve.
        curve: Curve,
    },
    /// A public key is not encoded as a point: wrong length, tag or coordinate.
    #[error(
        "the public key is not the encoding of a point of {curve} ({detail}): the file is damaged; export it again"
    )]
    PointEncoding {
        /// The key's curve.
        curve: Curve,
        /// What is wrong with it.
        detail: &'static str,
    },
    /// A public key does not satisfy the equation of the curve.
    #[error(
        "the public key is not a point of {curve}: the file is damaged or forged; obtain the key again from its owner"
    )]
    PointNotOnCurve {
        /// The key's curve.
        curve: Curve,
    },
    /// A public key is the neutral element, for which anybody can sign.
    #[error(
        "the public key is the point at infinity of {curve}, which is no key: obtain the key again from its owner"
    )]
    PointAtInfinity {
        /// The key's curve.
        curve: Curve,
    },
    /// A public key lies outside the group that the base point generates.
    #[error(
        "the public key does not have the order of the base point of {curve}: it is forged; obtain the key again from its owner"
    )]
    PointOfWrongOrder {
        /// The key's curve.
        curve: Curve,
    },
    /// The public key beside a private key is not its own.
    #[error(
        "the public key stored beside the private key does not belong to it: the file is damaged; export it again"
    )]
    KeysDisagree,
}

/// Why octets are not a public key, before it is said on which curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PointError {
    Encoding(&'static str),
    Infinity,
    NotOnCurve,
    #[cfg(feature = "paper")]
    WrongOrder,
}

impl PointError {
    pub(super) fn on(self, curve: Curve) -> KeyError {
        match self {
            PointError::Encoding(detail) => KeyError::PointEncoding { curve, detail },
            PointError::Infinity => KeyError::PointAtInfinity { curve },
            PointError::NotOnCurve => KeyError::PointNotOnCurve { curve },
            #[cfg(feature = "paper")]
            PointError::WrongOrder => KeyError::PointOfWrongOrder { curve },
        }
    }
}
