//! The layouts that are held beside each other.

use std::{fmt, str::FromStr};

use anyhow::{Context, Error, Result, bail};
use serde::{Deserialize, Serialize};
use sigmark::{PatchCount, mark::Borders};

/// A way to lay a mark of 512 bits out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriedLayout {
    /// Whether harmonics are zero at borders between patches.
    pub fixed: bool,
    /// Into how many patches a model is cut; none for what the library chooses, which is fewer for free borders, as the paper has it.
    pub patches: Option<usize>,
    /// c.
    pub chip_rate: usize,
    /// Root mean square displacement, in diagonals.
    pub strength: f64,
}

/// The layout of the paper's, which was the default until version 3 of certificates, and today's default.
pub(super) const PAGE: [TriedLayout; 2] = [
    TriedLayout {
        fixed: false,
        patches: None,
        chip_rate: 3,
        strength: 4e-4,
    },
    TriedLayout {
        fixed: true,
        patches: None,
        chip_rate: 1,
        strength: 4e-4,
    },
];

impl TriedLayout {
    pub(super) fn borders(&self) -> Borders {
        if self.fixed { Borders::Fixed } else { Borders::Free }
    }

    pub(super) fn count(&self) -> PatchCount {
        match self.patches {
            Some(count) => PatchCount::Exactly(count),
            None if self.fixed => PatchCount::Auto,
            None => PatchCount::Paper,
        }
    }
}

impl fmt::Display for TriedLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let borders = if self.fixed { "fixed" } else { "free" };
        let patches = self.patches.map_or("auto".into(), |count| count.to_string());
        write!(f, "{borders}:{patches}:{}:{:e}", self.chip_rate, self.strength)
    }
}

impl FromStr for TriedLayout {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let [borders, patches, rate, strength] = text.split(':').collect::<Vec<_>>()[..] else {
            bail!("a layout has four parts: BORDERS:PATCHES:CHIP_RATE:RMS");
        };
        Ok(Self {
            fixed: match borders {
                "fixed" => true,
                "free" => false,
                _ => bail!("borders are \"fixed\" or \"free\""),
            },
            patches: match patches {
                "auto" => None,
                count => Some(count.parse().context("patches are a number, or \"auto\"")?),
            },
            chip_rate: rate.parse().context("the chip rate is a number")?,
            strength: strength.parse().context("the strength is a number")?,
        })
    }
}
