//! The convolution before the polar transform (Arıkan 2019, *From sequential decoding to channel polarization and back again*):
//! u_i = Σ_j g_j v_{i−j} over GF(2), where v holds the payload and, at frozen positions, zeros.
//!
//! A frozen u_i is then a parity of payload bits before it, which the decoder knows of each path. That costs nothing and leaves fewer
//! light codewords.

/// The coefficients g_0, …, g_63, from the lowest bit; g_0 = 1, so that u_i tells v_i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Precoder(u64);

impl Precoder {
    /// The first 64 binary digits of π − 3, which nobody chose.
    pub(crate) const PI: Self = Self(0x243F_6A88_85A3_08D3);

    /// None where g_0 = 0.
    pub(crate) fn new(generator: u64) -> Option<Self> {
        (generator & 1 == 1).then_some(Self(generator))
    }

    /// The register after position i: bit j is what v_0, …, v_i add to u_{i+1+j}. `register` is the one before.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_convolution_with_its_generator() {
        let generator = 0x243F_6A88_85A3_08D3u64;
        let v: Vec<bool> = (0..200u32).map(|i| i * i % 7 < 3).collect();
        let mut u = v.clone();
        Precoder::PI.precode(&mut u);
        for i in 0..200 {
            let taps = (0..64.min(i + 1)).filter(|&j| generator >> j & 1 == 1 && v[i - j]);
            assert_eq!(u[i], taps.count() % 2 == 1);
        }
    }
}
