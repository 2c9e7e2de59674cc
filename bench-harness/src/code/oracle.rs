//! AFF3CT's published curves of the (2048, 1024) polar code with a CRC of 32 bits, and ours in the same setting.
//!
//! Source: github.com/aff3ct/error_rate_references, commit 021a9e0851720071bb3e22517744b688413bb6d5,
//! `POLAR/AWGN/BPSK/ASCL/Polar_N2048_K1024_ASCL_L001_CRC32_SPC4_p32.txt` and its neighbours for lists of 32 and 128: fully adaptive lists,
//! Gaussian approximation at the strength of each point, systematic, single precision. Two hundred errors a point.

/// A list, and its frame error rates: Eb/N0 in dB with 1024 bits counted as information.
pub(super) struct Published {
    pub(super) list: usize,
    pub(super) rates: &'static [(f64, f64)],
}

pub(super) const PUBLISHED: [Published; 3] = [
    Published {
        list: 1,
        rates: &[
            (2.0, 1.06e-1),
            (2.1, 5.90e-2),
            (2.2, 4.62e-2),
            (2.3, 2.85e-2),
            (2.4, 1.59e-2),
            (2.5, 9.87e-3),
            (2.6, 6.01e-3),
            (2.7, 3.03e-3),
            (2.8, 1.80e-3),
            (2.9, 9.50e-4),
            (3.0, 5.12e-4),
        ],
    },
    Published {
        list: 32,
        rates: &[
            (1.2, 7.11e-2),
            (1.3, 3.71e-2),
            (1.4, 1.70e-2),
            (1.5, 8.74e-3),
            (1.6, 3.96e-3),
            (1.7, 1.39e-3),
            (1.8, 5.10e-4),
            (1.9, 2.08e-4),
        ],
    },
    Published {
        list: 128,
        rates: &[
            (1.1, 7.06e-2),
            (1.2, 3.40e-2),
            (1.3, 1.64e-2),
            (1.4, 7.11e-3),
            (1.5, 3.12e-3),
            (1.6, 1.01e-3),
            (1.7, 3.91e-4),
            (1.8, 9.21e-5),
        ],
    },
];

/// Bits that are counted as information, those in the polar code with the CRC, and the length.
pub(super) const INFORMATION: usize = 1024;
pub(super) const CARRIED: usize = 1056;
pub(super) const LENGTH: usize = 2048;

/// T₀ at this Eb/N0 in dB.
pub(super) fn t0(eb_n0: f64) -> f64 {
    (2.0 * INFORMATION as f64 * 10f64.powf(eb_n0 / 10.0)).sqrt()
}

impl Published {
    /// Eb/N0 in dB at a frame error rate, on a straight line of ln FER between two points.
    pub(super) fn at(&self, rate: f64) -> Option<f64> {
        self.rates.windows(2).find_map(|pair| {
            let [(x, a), (y, b)] = [pair[0], pair[1]];
            (a >= rate && b <= rate).then(|| x + (y - x) * (a / rate).ln() / (a / b).ln())
        })
    }

    /// Its points about a thousandth, beside which ours are measured.
    pub(super) fn near(&self) -> impl Iterator<Item = (f64, f64)> {
        let about = |&(_, rate): &(f64, f64)| (3e-4..1e-2).contains(&rate);
        self.rates.iter().copied().filter(about)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_32_reaches_a_thousandth_between_its_points() {
        let at = PUBLISHED[1].at(1e-3).unwrap_or_default();
        assert!((at - 1.733).abs() < 1e-3, "{at}");
        assert_eq!(PUBLISHED[1].near().count(), 4);
        assert_eq!(PUBLISHED[1].at(1e-9), None);
    }
}
