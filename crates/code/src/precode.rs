//! The convolution that runs before the polar transform (Arıkan 2019, *From sequential decoding to channel polarization
//! and back again*): u_i = Σ_j g_j v_{i−j}, where v holds the payload and, at frozen positions, zeros.
//!
//! A frozen u_i is then a parity of payload bits before it, which the decoder knows of each path. That costs nothing
//! and leaves fewer light codewords.

/// The coefficients g_0, …, g_63, from the lowest bit; g_0 = 1, so that v_i can be told from u_i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Precoder(pub(crate) u64);

impl Precoder {
    /// What the v so far add to the next 64 u, after v_i was taken to be `v`: the register that follows u_i.
    #[inline]
    pub(crate) fn after(self, register: u64, v: bool) -> u64 {
        (register ^ if v { self.0 } else { 0 }) >> 1
    }

    /// u of v, in place.
    pub(crate) fn precode(self, bits: &mut [bool]) {
        let mut register = 0;
        for bit in bits {
            let v = *bit;
            *bit ^= register & 1 == 1;
            register = self.after(register, v);
        }
    }
}
