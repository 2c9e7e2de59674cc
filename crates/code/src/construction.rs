//! Which positions carry the payload.

/// How reliable each position is, by a design.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reliability {
    /// Position i counts Σ β^s over the bits s of i that are 1.
    Expansion {
        /// β.
        beta: f64,
    },
    /// Gaussian approximation at this signal-to-noise ratio of a code bit, in dB.
    Gaussian {
        /// dB.
        snr_db: f64,
    },
}

fn phi(x: f64) -> f64 {
    if x <= 0.0 { 1.0 }
    else if x < 10.0 { (-0.4527 * x.powf(0.86) + 0.0218).exp().min(1.0) }
    else { (std::f64::consts::PI / x).sqrt() * (-x / 4.0).exp() * (1.0 - 10.0 / (7.0 * x)) }
}

fn phi_inv(y: f64) -> f64 {
    if y >= 1.0 { return 0.0; }
    let (mut lo, mut hi) = (0.0, 4000.0);
    for _ in 0..100 {
        let mid = 0.5 * (lo + hi);
        if phi(mid) > y { lo = mid } else { hi = mid }
    }
    0.5 * (lo + hi)
}

impl Reliability {
    pub(crate) fn weights(self, length: usize) -> Vec<f64> {
        match self {
            Self::Expansion { beta } => (0..length).map(|i| {
                let mut power = 1.0;
                let mut sum = 0.0;
                let mut rest = i;
                while rest > 0 {
                    if rest & 1 == 1 { sum += power; }
                    power *= beta;
                    rest >>= 1;
                }
                sum
            }).collect(),
            Self::Gaussian { snr_db } => {
                let mut means = vec![4.0 * 10f64.powf(snr_db / 10.0) / 2.0];
                while means.len() < length {
                    means = means.iter().flat_map(|&m| {
                        let p = phi(m);
                        let minus = if m < 1e-12 { m*1e-3 } else { phi_inv(1.0 - (1.0 - p) * (1.0 - p)) };
                        [minus, 2.0 * m]
                    }).collect();
                }
                means
            }
        }
    }
}
