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
    /// In how many ways a suspect may be taken, each of which is read by itself.
    ways: usize,
    /// From which p on nothing more is looked at, though the payload is not read; 0 where it has to be.
    enough: f64,
    last: RefCell<Option<(SoftBits, bool)>>,
}

/// T₀ is an estimate: by so much it may be too small.
const NEARLY: f64 = 0.9;

impl<'a> Decoder<'a> {
    /// For the bits that the certificate's mark has, in a suspect that is taken in one way; nothing but the payload is enough.
    pub(super) fn new(certificate: &'a Certificate, expected: &'a [bool]) -> Self {
        Self {
            certificate,
            expected,
            ways: 1,
            enough: 0.0,
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

    /// The same, for a suspect that is taken in so many ways, and of which a probability of so much is enough, too.
    pub(super) fn enough(self, ways: usize, enough: f64) -> Self {
        Self { ways, enough, ..self }
    }

    /// Whether there is no need to look at more of a suspect: such soft bits, chosen of so many readings in each way, are as improbable as is enough; or the payload is read, and is evidence, which a tag
    /// is from more chips than it takes to read it.
    pub(super) fn is_enough(&self, soft: &SoftBits, tries: usize) -> bool {
        let p = self.ways as f64 * tries as f64 * p_value(self.expected, &soft.weights());
        p <= self.enough || p <= EVIDENCE && self.is_read(soft)
    }
}
