/// An estimate of every bit of a signature: positive for 1, negative for 0, the larger the surer. The unit is the detector's.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftBits(pub Vec<f64>);

impl SoftBits {
    /// The bits themselves: 1 where the estimate is not negative (eq. 17).
    pub fn hard(&self) -> Vec<bool> {
        self.0.iter().map(|&q| q >= 0.0).collect()
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
