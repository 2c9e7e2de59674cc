use serde::{Deserialize, Serialize};

use super::{Permutation, Scheme, Signature, SignatureError};

/// Which bits stand in a shape for a signature (r, s).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum PayloadKind {
    /// e = F_h(r ‖ s), h the hash of the statement that is signed.
    Signature,
    /// r ‖ s as they are, as in the paper: a signer can choose half of them.
    PlainSignature,
}

/// The way from a signature to the bits of a mark, and back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Payload {
    scheme: Scheme,
    permutation: Option<Permutation>,
}

impl PayloadKind {
    /// What marks of a scheme hold: the paper's the signature itself, others the permuted one.
    pub fn of(scheme: Scheme) -> Self {
        match scheme.is_of_paper() {
            true => Self::PlainSignature,
            false => Self::Signature,
        }
    }

    /// The name in certificates and statements.
    pub fn name(self) -> &'static str {
        match self {
            Self::Signature => "signature",
            Self::PlainSignature => "plain-signature",
        }
    }
}

impl Payload {
    /// The payload of signatures over a statement with this hash.
    pub fn new(scheme: Scheme, statement: [u8; 32]) -> Self {
        let permutation = match PayloadKind::of(scheme) {
            PayloadKind::Signature => Some(Permutation::keyed(statement)),
            PayloadKind::PlainSignature => None,
        };
        Self { scheme, permutation }
    }

    /// The bits of a mark that holds a signature of this scheme.
    pub fn bits(&self, signature: &Signature) -> Vec<bool> {
        let Some(permutation) = &self.permutation else {
            return signature.bits();
        };
        let [r, s] = permutation.apply([*signature.r(), *signature.s()]);
        Signature::new(self.scheme, r, s).bits()
    }

    /// The signature that bits hold, which is the inverse of [`bits`](Self::bits); where a bit is wrong, nothing like it.
    ///
    /// # Errors
    /// [`SignatureError::Length`] unless there are as many as the scheme has.
    pub fn signature(&self, bits: &[bool]) -> Result<Signature, SignatureError> {
        let read = Signature::from_bits(self.scheme, bits)?;
        let Some(permutation) = &self.permutation else {
            return Ok(read);
        };
        let [r, s] = permutation.invert([*read.r(), *read.s()]);
        Ok(Signature::new(self.scheme, r, s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_bit_string_holds_one_signature(bits in proptest::collection::vec(any::<bool>(), 512), h: [u8; 32]) {
            for &scheme in Scheme::ALL {
                let payload = Payload::new(scheme, h);
                let bits = &bits[..scheme.bits()];
                prop_assert_eq!(payload.bits(&payload.signature(bits).unwrap()), bits);
            }
        }
    }

    #[test]
    fn only_the_papers_marks_hold_the_signature_as_it_is() {
        for &scheme in Scheme::ALL {
            let bits: Vec<bool> = (0..scheme.bits()).map(|t| t % 3 == 0).collect();
            let signature = Signature::from_bits(scheme, &bits).unwrap();
            let plain = Payload::new(scheme, [1; 32]).bits(&signature) == bits;
            assert_eq!(plain, scheme.is_of_paper(), "{scheme}");
        }
    }
}
