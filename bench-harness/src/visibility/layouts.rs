//! The layouts that are held beside each other.

use std::{fmt, str::FromStr, sync::Arc};

use anyhow::{Context, Error, Result, bail};
use job::Job;
use mesh::TriMesh;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde::{Deserialize, Serialize};
use sigmark::{
    Curve, Embedder, SigningKey, Strength,
    mark::{Borders, ChipLayout, ChipPlan, MarkLayout, Original, Patch, PatchCount},
};

/// The bits of a signature, which every patch carries where chips are not pooled.
const BITS: usize = 512;

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
    /// All patches together carry the bits, by harmonics that are zero at borders: what `sigmark embed` writes.
    Pooled,
    /// The same chips, of which as many as there are carry each of 512 bits: extraction rates are then comparable with those of layouts without a code.
    Repeated,
    /// The same again, of the same root mean square displacement in all patches, whether they are rough or thin: what the layout alone does.
    Even,
    /// The same patches and numbers of harmonics, by free ones times a window that is zero at borders.
    Windowed,
}

/// The default strength, in diagonals.
pub(super) const STANDARD: f64 = 4e-4;

/// The layout of the paper, which was the default until version 3 of certificates.
pub(super) const SEAMED: TriedLayout = TriedLayout {
    kind: Kind::Free,
    patches: None,
    chip_rate: Some(3),
    strength: STANDARD,
};

/// Today's default.
pub(super) const TODAY: TriedLayout = TriedLayout {
    kind: Kind::Pooled,
    patches: None,
    chip_rate: None,
    strength: STANDARD,
};

/// The same displacements, in which a code is not in the way of a comparison.
pub(super) const TODAY_REPEATED: TriedLayout = TriedLayout {
    kind: Kind::Repeated,
    ..TODAY
};

/// Without regard to the surface.
pub(super) const TODAY_EVEN: TriedLayout = TriedLayout {
    kind: Kind::Even,
    ..TODAY
};

/// Its rival.
const WINDOWED: TriedLayout = TriedLayout {
    kind: Kind::Windowed,
    ..TODAY
};

/// What is attacked on the page.
pub(super) const ATTACKED: [TriedLayout; 3] = [SEAMED, TODAY_EVEN, TODAY_REPEATED];

/// What is looked at on the page.
pub(super) const PAGE: [TriedLayout; 3] = [SEAMED, TODAY, WINDOWED];

impl TriedLayout {
    /// The same, of another strength.
    pub(super) fn with_strength(self, strength: f64) -> Self {
        Self { strength, ..self }
    }

    /// Where and how strongly a mesh is marked. Named strengths are those of the command: less where a pooled mark's model is thin.
    ///
    /// # Errors
    /// Where the mesh has no room for it.
    pub(super) fn laid(&self, mesh: &TriMesh, job: &Job) -> Result<MarkLayout> {
        let strength = Strength::Level(self.strength);
        let borders = match self.kind {
            Kind::Free => Borders::Free,
            Kind::Fixed => Borders::Fixed,
            Kind::Pooled => return self.pooled(mesh, strength, job),
            Kind::Repeated | Kind::Even => {
                let pooled = self.pooled(mesh, strength, job)?;
                let plan = match *pooled.plan() {
                    ChipPlan::Pooled { key, .. } => ChipPlan::pooled(BITS, key),
                    plan => plan,
                };
                let alphas = match self.kind {
                    Kind::Even => self.even(&pooled),
                    _ => pooled.alphas().to_vec(),
                };
                return Ok(MarkLayout::new(Arc::clone(pooled.original()), plan, alphas)?);
            }
            Kind::Windowed => {
                let fixed = self.pooled(mesh, strength, job)?;
                let original = (**fixed.original()).clone().with_borders(Borders::Windowed);
                let alphas = fixed.alphas().to_vec();
                return Ok(MarkLayout::new(Arc::new(original), *fixed.plan(), alphas)?);
            }
        };
        let layout = ChipLayout::new(BITS, self.chip_rate.unwrap_or(3))?;
        let count = self.patches.map_or(PatchCount::Paper, PatchCount::Exactly);
        let original = Original::cut(mesh.clone(), layout.functions(), count, job)?.with_borders(borders);
        let plan = ChipPlan::EveryPatch(layout);
        Ok(MarkLayout::with_strength(Arc::new(original), plan, strength)?)
    }

    /// α of every patch with which each is displaced alike: a chip adds (α φ)² to the mean square of its patch.
    fn even(&self, pooled: &MarkLayout) -> Vec<f64> {
        let (original, plan) = (pooled.original(), pooled.plan());
        let displacement = self.strength * original.mesh().bounding_box().diagonal();
        let of_patch = |(patch, &functions): (&Patch, &usize)| {
            let (chips, size) = (plan.chips_per_axis(functions), plan.size(patch));
            let square: f64 = (0..3).map(|axis| chips[axis] as f64 * size[axis].powi(2)).sum();
            displacement / square.sqrt()
        };
        original
            .patches()
            .iter()
            .zip(original.functions())
            .map(of_patch)
            .collect()
    }

    /// What the embedder does.
    fn pooled(&self, mesh: &TriMesh, strength: Strength, job: &Job) -> Result<MarkLayout> {
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([3; 32]));
        let mut embedder = Embedder::new(&key).strength(strength);
        if let Some(rate) = self.chip_rate {
            embedder = embedder.chip_rate(rate);
        }
        if let Some(patches) = self.patches {
            embedder = embedder.patches(patches);
        }
        let original = Arc::new(embedder.cut(mesh, job)?);
        Ok(embedder.prepare_in(&original)?.layout().clone())
    }
}

impl fmt::Display for TriedLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Kind::Free => "free",
            Kind::Fixed => "fixed",
            Kind::Pooled => "pooled",
            Kind::Repeated => "repeated",
            Kind::Even => "even",
            Kind::Windowed => "windowed",
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
                "repeated" => Kind::Repeated,
                "even" => Kind::Even,
                "windowed" => Kind::Windowed,
                _ => bail!(
                    "the kind is \"free\", \"fixed\", \"pooled\", \"repeated\", \"even\" or \"windowed\""
                ),
            },
            patches: number("patches", patches)?,
            chip_rate: number("repetitions", rate)?,
            strength: strength.parse().context("the strength is a number")?,
        })
    }
}
