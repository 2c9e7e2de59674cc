use std::{borrow::Cow, fmt};

use serde::{Deserialize, Serialize};

/// What an algorithm is known by: on command lines, in the keys of finished work, among the paper's printed figures. People read its
/// [name](crate::Algorithm::name).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AlgorithmId(Cow<'static, str>);

/// What a way to read an algorithm's marks is known by.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct DetectorId(Cow<'static, str>);

impl AlgorithmId {
    /// Of [`Mhb`](crate::Mhb).
    pub const MHB: Self = Self::new("mhb");
    /// Of [`Lbf`](crate::Lbf) as the paper ran it.
    pub const LBF: Self = Self::new("lbf");
    /// Of [`Rbf`](crate::Rbf).
    pub const RBF: Self = Self::new("rbf");

    /// Small letters and hyphens.
    pub const fn new(id: &'static str) -> Self {
        Self(Cow::Borrowed(id))
    }
}

impl DetectorId {
    /// The paper's extraction (eqs. 15–17), or the algorithm's own.
    pub const PAPER: Self = Self::new("paper");
    /// Bits, misalignment and what else disturbs the surface estimated together, by least squares.
    pub const LEAST_SQUARES: Self = Self::new("least-squares");

    /// Small letters and hyphens.
    pub const fn new(id: &'static str) -> Self {
        Self(Cow::Borrowed(id))
    }

    /// What people read: the words that the hyphens join.
    pub fn name(&self) -> String {
        self.0.replace('-', " ")
    }
}

impl fmt::Display for AlgorithmId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Display for DetectorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
