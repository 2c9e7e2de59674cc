/// An estimate of every bit of a mark: positive for 1, negative for 0, 0 where nothing is known, the larger the surer.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftBits {
    values: Vec<f64>,
    are_ratios: bool,
}

impl SoftBits {
    /// Estimates in a unit of the detector's own.
    pub fn new(values: Vec<f64>) -> Self {
        Self {
            values,
            are_ratios: false,
        }
    }

    /// Log-likelihood ratios, ln P(1) / P(0).
    pub fn ratios(values: Vec<f64>) -> Self {
        Self {
            values,
            are_ratios: true,
        }
    }

    /// Others of the same kind.
    pub(crate) fn with_values(&self, values: Vec<f64>) -> Self {
        let are_ratios = self.are_ratios;
        Self { values, are_ratios }
    }

    /// The estimates, one a bit.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// What each bit is to count by in a [correlation]: where ratios r are known tanh(r/2), the expected value of ±1, so that none counts for more than a bit that is certain; else the estimates.
    pub fn weights(&self) -> Vec<f64> {
        let weight = |&x: &f64| if self.are_ratios { (x / 2.0).tanh() } else { x };
        self.values.iter().map(weight).collect()
    }

    /// The bits themselves: 1 where the estimate is not negative (eq. 17).
    pub fn hard(&self) -> Vec<bool> {
        self.values.iter().map(|&q| q >= 0.0).collect()
    }
}

/// Extraction rate (eq. 18): the share of bits on which `extracted` and `signature` agree, from 0 to 1.
pub fn extraction_rate(signature: &[bool], extracted: &[bool]) -> f64 {
    let matches = signature.iter().zip(extracted).filter(|(s, e)| s == e).count();
    matches as f64 / signature.len().max(1) as f64
}

/// T = Σ sₜ xₜ / √(Σ xₜ²) with sₜ = ±1; 0 if every xₜ is zero.
pub fn correlation(signature: &[bool], soft: &[f64]) -> f64 {
    let norm = soft.iter().map(|x| x * x).sum::<f64>().sqrt();
    let signed: f64 = signature
        .iter()
        .zip(soft)
        .map(|(&s, &x)| if s { x } else { -x })
        .sum();
    if norm > 0.0 { signed / norm } else { 0.0 }
}
