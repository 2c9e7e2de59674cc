use crate::mark::SoftBits;

/// What is looked for in a suspect: the bits of a mark, and when they are read, so that nothing more needs to be looked at. Bits alone are read when all of them are there.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    pub(super) bits: &'a [bool],
    is_read: Option<&'a dyn Fn(&SoftBits) -> bool>,
}

impl<'a> Wanted<'a> {
    /// Bits that are read when `is_read` says so, as those of a code are that can be decoded.
    pub fn until(bits: &'a [bool], is_read: &'a dyn Fn(&SoftBits) -> bool) -> Self {
        Self {
            bits,
            is_read: Some(is_read),
        }
    }

    pub(super) fn is_read(&self, soft: &SoftBits) -> bool {
        match self.is_read {
            Some(is_read) => is_read(soft),
            None => soft.hard() == self.bits,
        }
    }
}

impl<'a> From<&'a [bool]> for Wanted<'a> {
    fn from(bits: &'a [bool]) -> Self {
        Self { bits, is_read: None }
    }
}

impl<'a> From<&'a Vec<bool>> for Wanted<'a> {
    fn from(bits: &'a Vec<bool>) -> Self {
        bits.as_slice().into()
    }
}
