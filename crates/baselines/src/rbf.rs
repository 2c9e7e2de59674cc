use job::Job;
use sigmark::mark::{ChipLayout, MarkStage};

use crate::{
    Algorithm, AlgorithmId, BaselineError, Kernel, Prepared, Reference, Subject,
    carrier::{Carrier, PreparedCarriers, chips, coefficients},
    radial_basis,
};

/// Orthonormal radial basis functions (Wu and Kobbelt 2005), as the paper ran them.
///
/// One basis for the whole mesh, ⌈l/3⌉ functions, each with a bit for x, y and z:
///
/// x̃′ = x̃ (1 + α s),
///
/// x̃ being the coefficients of the raw coordinates, so that the mark depends on where the origin lies. A bit is the sign of (x̃′ − x̃) x̃. The
/// paper aligns suspects with the marked mesh.
#[derive(Clone, Debug, Default)]
pub struct Rbf {
    kernel: Kernel,
}

impl Rbf {
    /// α of the paper's tables.
    pub const PAPER_ALPHA: f64 = 0.01;

    /// With another kernel than φ(r) = r.
    pub fn with_kernel(kernel: Kernel) -> Self {
        Self { kernel }
    }
}

impl Algorithm for Rbf {
    fn id(&self) -> AlgorithmId {
        AlgorithmId::RBF
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("kernel", format!("{:?}", self.kernel))]
    }

    fn name(&self) -> String {
        match self.kernel {
            Kernel::Linear => "RBFs".into(),
            kernel => format!("RBFs, {kernel:?}"),
        }
    }

    fn reference(&self) -> Reference {
        Reference::Marked
    }

    fn paper_alpha(&self) -> Option<f64> {
        Some(Self::PAPER_ALPHA)
    }

    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        let positions = subject.mesh.positions();
        let layout = ChipLayout::new(subject.bits, 1)?;
        job.begin(MarkStage::Harmonics)?;
        let functions = radial_basis(positions, layout.frequencies(), self.kernel)?;
        let moved = coefficients(functions.as_ref(), positions);
        job.progress(1.0)?;
        Ok(Box::new(PreparedCarriers {
            bits: subject.bits,
            functions: layout.frequencies(),
            base: positions.to_vec(),
            original: positions.to_vec(),
            carriers: vec![Carrier {
                vertices: (0..positions.len() as u32).collect(),
                chips: chips(&layout, |function, axis| moved[function][axis]),
                functions,
            }],
        }))
    }
}
