//! The layouts that are held beside each other.

use std::{fmt, str::FromStr};

use anyhow::{Context, Error, Result, bail};
use job::Job;
use mesh::TriMesh;
use serde::{Deserialize, Serialize};
use sigmark::mark::{Borders, ChipLayout, ChipPlan, Original, PatchCount, Pool};

/// A way to lay a mark out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriedLayout {
    /// How chips are shared out.
    pub kind: Kind,
    /// Into how many patches a model is cut; none for what the library chooses.
    pub patches: Option<usize>,
    /// How often each bit stands in a patch, or, where chips are pooled, in the model; none for what the library chooses.
    pub chip_rate: Option<usize>,
    /// Root mean square displacement, in diagonals.
    pub strength: f64,
}

/// How chips are shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The paper's: every patch carries all bits, by harmonics with free borders.
    Free,
    /// Every patch carries all bits, by harmonics that are zero at borders.
    Fixed,
    /// All patches together carry the bits, by harmonics that are zero at borders.
    Pooled,
}

/// The layout of the paper, which was the default until version 3 of certificates, and today's default.
pub(super) const PAGE: [TriedLayout; 2] = [
    TriedLayout {
        kind: Kind::Free,
        patches: None,
        chip_rate: Some(3),
        strength: 4e-4,
    },
    TriedLayout {
        kind: Kind::Pooled,
        patches: None,
        chip_rate: None,
        strength: 4e-4,
    },
];

impl TriedLayout {
    /// The mesh cut for so many bits, and where these lie.
    pub(super) fn cut(&self, mesh: &TriMesh, bits: usize, job: &Job) -> Result<(Original, ChipPlan)> {
        let borders = match self.kind {
            Kind::Free => Borders::Free,
            Kind::Fixed => Borders::Fixed,
            Kind::Pooled => {
                let mut pool = Pool::default();
                (pool.repetitions, pool.patches) = (self.chip_rate, self.patches);
                let original = Original::pooled(mesh.clone(), bits, pool, job)?;
                return Ok((original, ChipPlan::pooled(bits, [1; 32])));
            }
        };
        let layout = ChipLayout::new(bits, self.chip_rate.unwrap_or(3))?;
        let count = self.patches.map_or(PatchCount::Paper, PatchCount::Exactly);
        let original = Original::cut(mesh.clone(), layout.functions(), count, job)?;
        Ok((original.with_borders(borders), ChipPlan::EveryPatch(layout)))
    }
}

impl fmt::Display for TriedLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Kind::Free => "free",
            Kind::Fixed => "fixed",
            Kind::Pooled => "pooled",
        };
        let of = |number: Option<usize>| number.map_or("auto".into(), |number| number.to_string());
        let (patches, rate) = (of(self.patches), of(self.chip_rate));
        write!(f, "{kind}:{patches}:{rate}:{:e}", self.strength)
    }
}

impl FromStr for TriedLayout {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let [kind, patches, rate, strength] = text.split(':').collect::<Vec<_>>()[..] else {
            bail!("a layout has four parts: KIND:PATCHES:CHIP_RATE:RMS");
        };
        let number = |what: &str, text: &str| match text {
            "auto" => Ok(None),
            count => count
                .parse()
                .map(Some)
                .with_context(|| format!("{what} are a number, or \"auto\"")),
        };
        Ok(Self {
            kind: match kind {
                "free" => Kind::Free,
                "fixed" => Kind::Fixed,
                "pooled" => Kind::Pooled,
                _ => bail!("the kind is \"free\", \"fixed\" or \"pooled\""),
            },
            patches: number("patches", patches)?,
            chip_rate: number("repetitions", rate)?,
            strength: strength.parse().context("the strength is a number")?,
        })
    }
}
