use mesh::{Similarity, TriMesh, Vec3};

use crate::mark::{AttackModel, MarkError, Registered, SoftBits, correlation};

/// What was read of a suspect, and in which pose.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Reading {
    /// The bits.
    pub soft: SoftBits,
    /// Takes the suspect to the original.
    pub transform: Similarity,
    /// What the bits were read from.
    pub registered: Registered,
    /// Root mean square distance of corresponding points, in the original's unit.
    pub residual: f64,
    /// What moved the suspect; none where the joint estimate was not asked.
    pub attack_model: Option<AttackModel>,
    /// Of how many readings this could have been chosen: what a p-value is to be multiplied by.
    pub tries: usize,
}

impl Reading {
    pub(super) fn new(
        original: &TriMesh,
        registered: Registered,
        transform: Similarity,
        soft: SoftBits,
        attack_model: Option<AttackModel>,
    ) -> Self {
        let pairs = registered.positions.iter().zip(original.positions());
        let squares: Vec<f64> = pairs
            .filter_map(|(r, &v)| r.map(|r| (Vec3(r) - Vec3(v)).squared()))
            .collect();
        Self {
            soft,
            transform,
            residual: (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt(),
            registered,
            attack_model,
            tries: 1,
        }
    }
}

/// Keeps the reading that agrees best with the bits that are looked for; the first of equals.
pub(super) struct Choice<'a> {
    expected: &'a [bool],
    best: Option<(f64, Reading)>,
}

impl<'a> Choice<'a> {
    pub(super) fn new(expected: &'a [bool]) -> Self {
        Self { expected, best: None }
    }

    pub(super) fn offer(&mut self, reading: Reading) {
        let agreement = correlation(self.expected, &reading.soft.0);
        if self.best.as_ref().is_none_or(|(best, _)| agreement > *best) {
            self.best = Some((agreement, reading));
        }
    }

    /// The best one, if it misreads a bit.
    pub(super) fn misread(&self) -> Option<&Reading> {
        let (_, best) = self.best.as_ref()?;
        (best.soft.hard() != self.expected).then_some(best)
    }

    /// The best one, chosen of so many that could have been read.
    pub(super) fn best(self, tries: usize) -> Result<Reading, MarkError> {
        let (_, best) = self.best.ok_or(MarkError::Alignment)?;
        Ok(Reading { tries, ..best })
    }
}
