use faer::Mat;
use job::Job;
use sigmark::mark::{ChipLayout, MarkStage, Patch};

use crate::{
    Algorithm, AlgorithmId, BaselineError, Kernel, Prepared, Reference, Subject,
    algorithm::check_vertices,
    carrier::{Carrier, PreparedCarriers, chips},
    kirchhoff::laplacian_basis,
    radial_basis,
};

/// A rival's basis functions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Basis {
    /// Eigenvectors of K, from the second.
    Laplacian,
    /// Orthonormal radial functions.
    Radial(Kernel),
}

impl Basis {
    fn name(self) -> String {
        match self {
            Self::Laplacian => "LBFs".into(),
            Self::Radial(Kernel::Linear) => "RBFs".into(),
            Self::Radial(kernel) => format!("RBFs ({kernel:?})"),
        }
    }

    /// `count` orthonormal functions of a patch.
    fn functions(
        self,
        index: usize,
        patch: &Patch,
        count: usize,
        job: &Job,
    ) -> Result<Mat<f64>, BaselineError> {
        match self {
            Self::Laplacian => {
                let spectrum = laplacian_basis(index, patch, count + 1, job)?;
                Ok(spectrum.eigenfunctions().subcols(1, count).to_owned())
            }
            Self::Radial(kernel) => radial_basis(patch.mesh().positions(), count, kernel),
        }
    }
}

/// A rival that fully adopts the framework of manifold harmonics, as the paper's conclusion proposes: the signature in every patch, in the
/// chips of eqs. 11–13, added whatever the coefficients are, with the reconstruction difference (eq. 14), and read from the original (eq. 15).
///
/// Functions are scaled to mean square 1 over the patch's vertices, so that α has no unit: a chip adds α φ to the root mean square.
#[derive(Clone, Debug)]
pub struct Adapted {
    basis: Basis,
    chip_rate: usize,
}

impl Adapted {
    /// With the given functions, chip rate 3.
    pub fn new(basis: Basis) -> Self {
        Self { basis, chip_rate: 3 }
    }

    /// With eigenvectors of K.
    pub fn laplacian() -> Self {
        Self::new(Basis::Laplacian)
    }

    /// With the paper's radial functions.
    pub fn radial() -> Self {
        Self::new(Basis::Radial(Kernel::default()))
    }

    /// c, how often each bit is repeated in a patch; 3 by default.
    pub fn chip_rate(self, rate: usize) -> Self {
        Self {
            chip_rate: rate,
            ..self
        }
    }
}

impl Algorithm for Adapted {
    fn id(&self) -> AlgorithmId {
        match self.basis {
            Basis::Laplacian => AlgorithmId::new("lbf-adapted"),
            Basis::Radial(_) => AlgorithmId::new("rbf-adapted"),
        }
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![
            ("basis", format!("{:?}", self.basis)),
            ("chip rate", self.chip_rate.to_string()),
        ]
    }

    fn name(&self) -> String {
        format!("{}, adapted", self.basis.name())
    }

    fn reference(&self) -> Reference {
        Reference::Original
    }

    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        let original = subject.mesh.positions();
        check_vertices(subject.patches.labels().len(), original.len())?;
        let layout = ChipLayout::new(subject.bits, self.chip_rate)?;
        let mut carriers = Vec::with_capacity(subject.patches.len());
        job.begin(MarkStage::Harmonics)?;
        for (index, patch) in subject.patches.iter().enumerate() {
            let size = patch.size();
            let root_count = (patch.vertices().len() as f64).sqrt();
            carriers.push(Carrier {
                vertices: patch.vertices().to_vec(),
                functions: self.basis.functions(index, patch, layout.frequencies(), job)?,
                chips: chips(&layout, |_, axis| root_count * size[axis]),
            });
            job.progress((index + 1) as f64 / subject.patches.len() as f64)?;
        }
        Ok(Box::new(PreparedCarriers {
            bits: subject.bits,
            functions: match self.basis {
                Basis::Laplacian => layout.functions(),
                Basis::Radial(_) => layout.frequencies(),
            },
            base: original.to_vec(),
            original: original.to_vec(),
            carriers,
        }))
    }
}
