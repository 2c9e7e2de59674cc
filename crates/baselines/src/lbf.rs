use job::Job;
use sigmark::mark::{ChipLayout, MarkStage, Patch};

use crate::{
    Algorithm, AlgorithmId, BaselineError, Prepared, Reference, Subject,
    algorithm::check_vertices,
    carrier::{Carrier, Chip, PreparedCarriers},
    kirchhoff::laplacian_basis,
};

/// Laplacian basis functions (Ohbuchi et al. 2001, 2002), as the paper ran them.
///
/// The eigenvectors e₁, e₂, … of each patch's K carry a chip each, with the same sign along all three axes:
///
/// x̃′ₖ = x̃ₖ + α s φ,  k = 1 … l c,
///
/// φ being the edges of the patch's bounding box. The marked patch is the reconstruction from m eigenvectors; what they do not span
/// is lost, unless it is compensated (eq. 8). Bits are read by the sum of coefficients' differences over axes and chips.
#[derive(Clone, Debug)]
pub struct Lbf {
    functions: usize,
    chip_rate: usize,
    compensated: bool,
}

impl Lbf {
    /// α of the paper's tables.
    pub const PAPER_ALPHA: f64 = 0.001;

    /// With m = `functions` eigenvectors a patch; the paper has 5 000 for the bunny, 3 500 for the teddy, 4 000 otherwise.
    pub fn new(functions: usize) -> Self {
        Self {
            functions,
            chip_rate: 1,
            compensated: false,
        }
    }

    /// Adds the reconstruction difference (eq. 14). By Theorem 1 l c + 1 eigenvectors then do as well as more, and only so many are
    /// computed.
    pub fn compensated(self) -> Self {
        Self {
            compensated: true,
            ..self
        }
    }

    /// c, how often each bit is repeated in a patch; 1 by default.
    pub fn chip_rate(self, rate: usize) -> Self {
        Self {
            chip_rate: rate,
            ..self
        }
    }

    /// How many eigenvectors to compute for l bits.
    fn count(&self, bits: usize) -> Result<usize, BaselineError> {
        // An empty layout is refused as everywhere else.
        ChipLayout::new(bits, self.chip_rate)?;
        let least = bits.saturating_mul(self.chip_rate).saturating_add(1);
        match self.functions {
            _ if self.compensated => Ok(least),
            functions if functions >= least => Ok(functions),
            functions => Err(BaselineError::TooFewFunctions {
                functions,
                bits,
                rate: self.chip_rate,
                least,
            }),
        }
    }

    /// Chip p modulates eigenvector 1 + p, column p of the carrier, along all axes.
    fn chips(&self, bits: usize, patch: &Patch) -> Vec<Chip> {
        let size = patch.size();
        let chips = (0..bits * self.chip_rate).flat_map(|p| (0..3).map(move |axis| (p, axis)));
        chips
            .map(|(p, axis)| Chip {
                bit: p % bits,
                function: p,
                axis,
                amplitude: size[axis],
            })
            .collect()
    }
}

impl Algorithm for Lbf {
    fn id(&self) -> AlgorithmId {
        match self.compensated {
            false => AlgorithmId::LBF,
            true => AlgorithmId::new("lbf-compensated"),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![
            ("functions", self.functions.to_string()),
            ("chip rate", self.chip_rate.to_string()),
        ]
    }

    fn name(&self) -> String {
        let compensation = if self.compensated { ", compensated" } else { "" };
        format!("LBFs{compensation}")
    }

    fn reference(&self) -> Reference {
        Reference::Original
    }

    fn paper_alpha(&self) -> Option<f64> {
        Some(Self::PAPER_ALPHA)
    }

    /// One patch after the other: m eigenvectors of a single one fill the memory of a small machine.
    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        let original = subject.mesh.positions();
        check_vertices(subject.patches.labels().len(), original.len())?;
        let functions = self.count(subject.bits)?;
        let modulated = subject.bits.saturating_mul(self.chip_rate);
        let mut base = original.to_vec();
        let mut carriers = Vec::with_capacity(subject.patches.len());
        job.begin(MarkStage::Harmonics)?;
        for (index, patch) in subject.patches.iter().enumerate() {
            let spectrum = laplacian_basis(index, patch, functions, job)?;
            if !self.compensated {
                let kept = spectrum.transform_positions(patch.mesh().positions());
                let reconstruction = spectrum.inverse_transform_positions(&kept);
                for (&v, position) in patch.vertices().iter().zip(reconstruction) {
                    base[v as usize] = position;
                }
            }
            carriers.push(Carrier {
                vertices: patch.vertices().to_vec(),
                functions: spectrum.eigenfunctions().subcols(1, modulated).to_owned(),
                chips: self.chips(subject.bits, patch),
            });
            job.progress((index + 1) as f64 / subject.patches.len() as f64)?;
        }
        Ok(Box::new(PreparedCarriers {
            bits: subject.bits,
            functions,
            base,
            original: original.to_vec(),
            carriers,
        }))
    }
}
