use crate::{
    CodeError, Reliability,
    candidates::Candidates,
    list::Paths,
    plan::{Step, plan},
    precode::Precoder,
    transform::transform,
};

/// A code.
#[derive(Clone, Debug)]
pub struct PolarCode {
    free: Vec<bool>,
    payload_bits: usize,
    steps: Vec<Step>,
    precoder: Precoder,
}

impl PolarCode {
    /// New.
    pub fn with(payload_bits: usize, length: usize, reliability: Reliability, generator: u64, min_weight: u32) -> Self {
        let weights = reliability.weights(length);
        let mut order: Vec<usize> = (0..length).collect();
        order.sort_by(|&a, &b| {
            let (ra, rb) = (a.count_ones() >= min_weight, b.count_ones() >= min_weight);
            rb.cmp(&ra).then(weights[b].total_cmp(&weights[a])).then(b.cmp(&a))
        });
        let mut free = vec![false; length];
        for &i in &order[..payload_bits] {
            free[i] = true;
        }
        Self::of(free, generator)
    }
    /// Of a set.
    pub fn of(free: Vec<bool>, generator: u64) -> Self {
        let steps = plan(&free);
        let payload_bits = free.iter().filter(|&&f| f).count();
        Self { free, payload_bits, steps, precoder: Precoder(generator) }
    }
    /// Free.
    pub fn free(&self) -> &[bool] { &self.free }
    /// Encode.
    pub fn encode(&self, payload: &[bool]) -> Vec<bool> {
        let mut bits = vec![false; self.free.len()];
        let mut payload = payload.iter();
        for (bit, &free) in bits.iter_mut().zip(&self.free) {
            if free { *bit = *payload.next().unwrap_or(&false); }
        }
        self.precoder.precode(&mut bits);
        transform(&mut bits);
        bits
    }
    /// Decode.
    pub fn decode(&self, ratios: &[f32], list: usize, exact: bool) -> Result<Candidates, CodeError> {
        let _ = self.payload_bits;
        let paths = Paths::new(ratios, self.precoder, list);
        Ok(if exact { paths.run::<true>(&self.steps) } else { paths.run::<false>(&self.steps) })
    }
}
