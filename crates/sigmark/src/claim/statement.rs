use serde::{Deserialize, Serialize};

use crate::payload::GeometryDigest;

/// What the signature in the shape is a signature of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coverage {
    /// The message and the digest of the original's geometry. A forger who subtracts a mark of his own and calls the
    /// result the original would need a signature over a mesh that contains that very signature.
    #[default]
    MessageAndGeometry,
    /// The message alone, as in the paper.
    Message,
}

impl Coverage {
    /// The bytes that are signed.
    ///
    /// For message and geometry: the text `sigmark mark v1` and a zero byte, the 32 bytes of the digest, then the message.
    pub fn signed_bytes(self, message: &str, original: &GeometryDigest) -> Vec<u8> {
        match self {
            Self::Message => message.as_bytes().to_vec(),
            Self::MessageAndGeometry => {
                [b"sigmark mark v1\0", &original.as_bytes()[..], message.as_bytes()].concat()
            }
        }
    }
}
