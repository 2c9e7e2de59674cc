use std::cell::RefCell;

use code::LISTS;

use super::{
    Certificate, EVIDENCE,
    statistics::{margin, p_value},
};
use crate::mark::SoftBits;

/// Looks for a certificate's payload in soft bits. What was asked last is kept, since a reading that is judged was asked for when it was chosen.
pub(super) struct Decoder<'a> {
    certificate: &'a Certificate,
    expected: &'a [bool],
    last: RefCell<Option<(SoftBits, bool)>>,
}

/// T₀ is an estimate: by so much it may be too small.
const NEARLY: f64 = 0.9;

/// More readings than a best one is ever chosen of, but of the most symmetric shapes.
const MANY_TRIES: f64 = 1e3;

impl<'a> Decoder<'a> {
    /// For the bits that the certificate's mark has.
    pub(super) fn new(certificate: &'a Certificate, expected: &'a [bool]) -> Self {
        Self {
            certificate,
            expected,
            last: RefCell::default(),
        }
    }

    /// The bits of the mark.
    pub(super) fn expected(&self) -> &'a [bool] {
        self.expected
    }

    /// Whether soft bits hold the payload. Lists aren't asked where it would take luck: reading k bits takes T₀ ≥ √(2 ln 2 · k), however many chips there are (Shannon).
    pub(super) fn is_read(&self, soft: &SoftBits) -> bool {
        let statement = self.certificate.statement();
        let bits = statement.payload.bits(statement.scheme) as f64;
        let least = NEARLY * (2.0 * std::f64::consts::LN_2 * bits).sqrt();
        if margin(self.expected, &soft.weights()) <= least {
            return false;
        }
        if let Some((of, is_read)) = &*self.last.borrow()
            && of == soft
        {
            return *is_read;
        }
        let is_read = self.certificate.is_read(soft, &LISTS);
        *self.last.borrow_mut() = Some((soft.clone(), is_read));
        is_read
    }

    /// Whether there is no need to look at more of a suspect: the payload is read, and is evidence, which a tag is from more chips than it takes to read it.
    pub(super) fn is_all(&self, soft: &SoftBits) -> bool {
        MANY_TRIES * p_value(self.expected, &soft.weights()) <= EVIDENCE && self.is_read(soft)
    }
}
