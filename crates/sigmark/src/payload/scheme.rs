//! What can be chosen: the curve and the hash function.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use sha1::Sha1;
use sha2::{Digest, Sha256};

/// An elliptic curve group of prime order `d`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Curve {
    /// NIST P-256 (secp256r1, prime256v1): about 128 bits of security.
    P256,
    /// NIST B-163 (sect163r2) over GF(2¹⁶³), cofactor 2: the standard curve nearest to the paper's.
    /// About 80 bits of security, not constant-time: for reproducing the paper only, behind the feature `paper`.
    #[cfg(feature = "paper")]
    B163,
}

impl Curve {
    pub(crate) const ALL: &[Curve] = &[
        Curve::P256,
        #[cfg(feature = "paper")]
        Curve::B163,
    ];

    /// The standard's name: "P-256" or "B-163".
    pub fn name(self) -> &'static str {
        match self {
            Curve::P256 => "P-256",
            #[cfg(feature = "paper")]
            Curve::B163 => "B-163",
        }
    }

    /// The bits of a private key, and of a coordinate.
    pub(crate) fn bits(self) -> usize {
        match self {
            Curve::P256 => 256,
            #[cfg(feature = "paper")]
            Curve::B163 => 163,
        }
    }

    /// The octets of a coordinate, and of a private key (on both curves the same number).
    pub(crate) fn octets(self) -> usize {
        self.bits().div_ceil(8)
    }
}

impl fmt::Display for Curve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A signature scheme: ECDSA with a curve and a hash function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Scheme {
    /// P-256 with SHA-256: 512 bits. The default, and the only one to sign new work with.
    #[default]
    #[serde(rename = "ecdsa-p256-sha256")]
    EcdsaP256Sha256,
    /// P-256 with SHA-1, the paper's hash function: 512 bits.
    #[serde(rename = "ecdsa-p256-sha1")]
    EcdsaP256Sha1,
    /// B-163 with SHA-1: the paper's 324 bits. For reproduction only, behind the feature `paper`.
    #[cfg(feature = "paper")]
    #[serde(rename = "ecdsa-b163-sha1")]
    EcdsaB163Sha1,
}

/// What a scheme is made of: its name, its curve, its hash function, and the bits of `r`, and of `s`.
type Parts = (&'static str, Curve, Hash, usize);

#[derive(Clone, Copy)]
enum Hash {
    Sha1,
    Sha256,
}

impl Scheme {
    /// Every scheme, the default first.
    pub const ALL: &[Scheme] = &[
        Scheme::EcdsaP256Sha256,
        Scheme::EcdsaP256Sha1,
        #[cfg(feature = "paper")]
        Scheme::EcdsaB163Sha1,
    ];

    /// The order of B-163 exceeds 2¹⁶² by 2⁸¹ only, and a component needs the 163rd bit with a probability of 2⁻⁸¹: 162 bits
    /// do, and a signer takes the next nonce where they do not.
    fn parts(self) -> Parts {
        match self {
            Scheme::EcdsaP256Sha256 => ("ecdsa-p256-sha256", Curve::P256, Hash::Sha256, 256),
            Scheme::EcdsaP256Sha1 => ("ecdsa-p256-sha1", Curve::P256, Hash::Sha1, 256),
            #[cfg(feature = "paper")]
            Scheme::EcdsaB163Sha1 => ("ecdsa-b163-sha1", Curve::B163, Hash::Sha1, 162),
        }
    }

    /// The name in certificates and on the command line, such as "ecdsa-p256-sha256".
    pub fn name(self) -> &'static str {
        self.parts().0
    }

    /// The curve that a key must be on.
    pub fn curve(self) -> Curve {
        self.parts().1
    }

    /// Whether it is the paper's own, whose marks are read by the paper's rule.
    pub(crate) fn is_of_paper(self) -> bool {
        match self {
            Scheme::EcdsaP256Sha256 | Scheme::EcdsaP256Sha1 => false,
            #[cfg(feature = "paper")]
            Scheme::EcdsaB163Sha1 => true,
        }
    }

    /// The hash function's name: "SHA-256" or "SHA-1".
    pub fn digest_name(self) -> &'static str {
        match self.parts().2 {
            Hash::Sha256 => "SHA-256",
            Hash::Sha1 => "SHA-1",
        }
    }

    /// The signature's length `l` in bits: 512 on P-256, 324 on B-163.
    pub fn bits(self) -> usize {
        2 * self.component_bits()
    }

    /// The bits of `r`, and of `s`.
    pub(crate) fn component_bits(self) -> usize {
        self.parts().3
    }

    /// `h = H(W)`.
    pub(crate) fn digest(self, message: &[u8]) -> Vec<u8> {
        match self.parts().2 {
            Hash::Sha256 => Sha256::digest(message).to_vec(),
            Hash::Sha1 => Sha1::digest(message).to_vec(),
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Scheme {
    type Err = UnknownScheme;

    fn from_str(name: &str) -> Result<Self, UnknownScheme> {
        Scheme::ALL
            .iter()
            .find(|scheme| scheme.name() == name)
            .copied()
            .ok_or_else(|| UnknownScheme {
                name: name.to_owned(),
            })
    }
}

/// There is no scheme by that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no signature scheme {name:?}: choose one of {:?}", Scheme::ALL.iter().map(|s| s.name()).collect::<Vec<_>>())]
pub struct UnknownScheme {
    /// The name given.
    pub name: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scheme_has_one_name_in_text_and_in_json() {
        for &scheme in Scheme::ALL {
            assert_eq!(scheme.to_string().parse::<Scheme>(), Ok(scheme));
            let json = serde_json::to_string(&scheme).expect("a unit variant");
            assert_eq!(json, format!("\"{scheme}\""));
        }
        assert!(matches!(
            "ecdsa-p384-sha384".parse::<Scheme>(),
            Err(UnknownScheme { .. })
        ));
    }

    #[test]
    fn the_papers_signature_has_324_bits_and_the_default_512() {
        #[cfg(feature = "paper")]
        assert_eq!(Scheme::EcdsaB163Sha1.bits(), 324);
        assert_eq!(Scheme::EcdsaP256Sha1.bits(), 512);
        assert_eq!(Scheme::default().bits(), 512);
        assert_eq!(Scheme::default(), Scheme::EcdsaP256Sha256);
    }
}
