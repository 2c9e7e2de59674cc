use crate::mark::SoftBits;

/// What is looked for in a suspect: the bits of a mark, and when that is enough, so that nothing more needs to be looked at. Of bits alone all are enough.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    pub(super) bits: &'a [bool],
    is_enough: Option<&'a IsEnough<'a>>,
    tries: usize,
}

/// Whether soft bits are enough that were chosen of so many readings.
type IsEnough<'a> = dyn Fn(&SoftBits, usize) -> bool + 'a;

impl<'a> Wanted<'a> {
    /// Bits, of which there is enough when `is_enough` says so of what was read, and of how many readings that could have been chosen: all that may ever be
    /// looked at, whether or not they are.
    pub fn until(bits: &'a [bool], is_enough: &'a dyn Fn(&SoftBits, usize) -> bool) -> Self {
        Self {
            is_enough: Some(is_enough),
            ..bits.into()
        }
    }

    /// The same, chosen of so many times as many readings.
    pub(super) fn of(self, readings: usize) -> Self {
        let tries = self.tries.saturating_mul(readings);
        Self { tries, ..self }
    }

    /// Of how many readings one is chosen.
    pub(super) fn tries(&self) -> usize {
        self.tries
    }

    pub(super) fn is_enough(&self, soft: &SoftBits) -> bool {
        match self.is_enough {
            Some(is_enough) => is_enough(soft, self.tries),
            None => soft.hard() == self.bits,
        }
    }
}

impl<'a> From<&'a [bool]> for Wanted<'a> {
    fn from(bits: &'a [bool]) -> Self {
        Self {
            bits,
            is_enough: None,
            tries: 1,
        }
    }
}

impl<'a> From<&'a Vec<bool>> for Wanted<'a> {
    fn from(bits: &'a Vec<bool>) -> Self {
        bits.as_slice().into()
    }
}
