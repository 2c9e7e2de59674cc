//! Numbers by chance, the same in every run.

use mesh::Vec3;
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};

/// A source of numbers.
pub(super) struct Draw(ChaCha20Rng);

impl Draw {
    /// What is drawn depends on the seed and on what it is for.
    pub(super) fn new(purpose: u64, seed: u64) -> Self {
        Self(ChaCha20Rng::seed_from_u64(
            seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ purpose,
        ))
    }

    /// Between 0 and 1.
    pub(super) fn unit(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / (f64::from(u32::MAX) + 1.0)
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// One of so many.
    pub(super) fn one_of(&mut self, count: usize) -> usize {
        ((self.unit() * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// A normal deviate (Box and Muller).
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }

    /// A direction.
    pub(super) fn direction(&mut self) -> Vec3 {
        Vec3([self.normal(), self.normal(), self.normal()]).unit()
    }
}
