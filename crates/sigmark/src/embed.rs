use std::sync::Arc;

use mesh::TriMesh;
use mhb_core::LaplacianKind;
use serde::{Deserialize, Serialize};

use crate::{
    Certificate, ChipLayout, CoefficientDetector, Detector, GeometryDigest, Observer, Original, PatchCount,
    Registered, SigmarkError, Stage, Work,
    certificate::{MarkRecord, OriginalRecord, PackedLabels, PatchRecord},
    signature::{Curve, Scheme, Signature, SigningKey},
    statistics::extraction_rate,
};

/// What the signature in the shape is a signature of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coverage {
    /// The message and the digest of the original's geometry. A forger who subtracts a mark of his own and calls the
    /// result the original would need a signature over a mesh that contains that very signature.
    #[default]
    MessageAndGeometry,
    /// The message alone, as in the paper.
    Message,
}

impl Coverage {
    /// The bytes that are signed.
    ///
    /// For message and geometry: the text `sigmark mark v1` and a zero byte, the 32 bytes of the digest, then the message.
    pub fn signed_bytes(self, message: &str, original: &GeometryDigest) -> Vec<u8> {
        match self {
            Self::Message => message.as_bytes().to_vec(),
            Self::MessageAndGeometry => {
                [b"sigmark mark v1\0", &original.as_bytes()[..], message.as_bytes()].concat()
            }
        }
    }
}

/// How strongly a mark is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Root mean square displacement of the marked surface, as a fraction of the bounding box's diagonal.
    Distortion(f64),
    /// α of eq. 12 for patches of unit area: the same for every patch, whatever the unit of the model.
    Alpha(f64),
    /// The α that the paper prints, in the model's unit of length: α/√(area) for each patch.
    PaperAlpha(f64),
}

impl Default for Strength {
    /// 4·10⁻⁴ of the diagonal: about what the paper's α does to the bunny (d_rmse 0.02 % of the diagonal).
    fn default() -> Self {
        Self::Distortion(4e-4)
    }
}

impl Strength {
    /// What a person calls it, and its number.
    fn named(self) -> (&'static str, f64) {
        match self {
            Self::Distortion(value) => ("distortion", value),
            Self::Alpha(value) => ("alpha", value),
            Self::PaperAlpha(value) => ("the paper's alpha", value),
        }
    }

    fn check(self) -> Result<(), SigmarkError> {
        let (what, value) = self.named();
        let sound = value > 0.0 && value.is_finite();
        if sound {
            Ok(())
        } else {
            Err(SigmarkError::NotPositive { what, value })
        }
    }
}

/// A mark that moves the surface by more than this part of the diagonal is not a watermark any more.
pub const MOST_DISTORTION: f64 = 0.1;

/// Signs a message and writes the signature into the shape of meshes.
///
/// Every choice has a default; [`embed`](Self::embed) does the work.
#[derive(Clone, Debug)]
pub struct Embedder<'k> {
    key: &'k SigningKey,
    scheme: Scheme,
    coverage: Coverage,
    message: String,
    chip_rate: usize,
    strength: Strength,
    patches: PatchCount,
    laplacian: LaplacianKind,
    threads: usize,
}

impl<'k> Embedder<'k> {
    /// An embedder for a key, with the scheme that suits the key's curve: SHA-256 on P-256; on the paper's curve SHA-1,
    /// and the signature covers the message alone.
    pub fn new(key: &'k SigningKey) -> Self {
        let (scheme, coverage) = match key.curve() {
            Curve::B163 => (Scheme::EcdsaB163Sha1, Coverage::Message),
            Curve::P256 => (Scheme::EcdsaP256Sha256, Coverage::MessageAndGeometry),
        };
        Self {
            key,
            scheme,
            coverage,
            message: String::new(),
            chip_rate: 3,
            strength: Strength::default(),
            patches: PatchCount::Auto,
            laplacian: LaplacianKind::default(),
            threads: 1,
        }
    }

    /// What is asserted: a text that will stand in the certificate. Empty by default.
    pub fn message(mut self, message: impl Into<String>) -> Self {
        self.message = message.into();
        self
    }

    /// The signature scheme; its curve must be the key's.
    pub fn scheme(mut self, scheme: Scheme) -> Self {
        self.scheme = scheme;
        self
    }

    /// What the signature covers.
    pub fn coverage(mut self, coverage: Coverage) -> Self {
        self.coverage = coverage;
        self
    }

    /// c, how often each bit is repeated in a patch; 3 by default.
    pub fn chip_rate(mut self, rate: usize) -> Self {
        self.chip_rate = rate;
        self
    }

    /// How strongly to mark.
    pub fn strength(mut self, strength: Strength) -> Self {
        self.strength = strength;
        self
    }

    /// Into how many patches the mesh is cut; each carries the whole signature.
    pub fn patches(mut self, count: PatchCount) -> Self {
        self.patches = count;
        self
    }

    /// Which Laplacian gives the harmonics: the cotangent one, as in the paper, by default. The intrinsic one also suits
    /// slivers and non-manifold edges.
    pub fn laplacian(mut self, kind: LaplacianKind) -> Self {
        self.laplacian = kind;
        self
    }

    /// How many threads may work; 1 by default. The mark does not depend on it.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// Signs the mesh.
    ///
    /// # Errors
    /// When the key does not fit the scheme, the strength is out of bounds, or the mesh has no patch with room for the signature.
    pub fn embed(&self, mesh: &TriMesh) -> Result<Signed, SigmarkError> {
        self.embed_observed(mesh, &())
    }

    /// As [`embed`](Self::embed), with an observer that sees the progress and may stop it.
    ///
    /// # Errors
    /// As [`embed`](Self::embed); [`SigmarkError::Cancelled`] when the observer stopped it.
    pub fn embed_observed(&self, mesh: &TriMesh, observer: &dyn Observer) -> Result<Signed, SigmarkError> {
        self.strength.check()?;
        let layout = ChipLayout::new(self.scheme.bits(), self.chip_rate)?;
        let work = Work {
            threads: self.threads,
            observer,
        };
        let original = Original::cut(mesh, layout, self.patches, work)?.with_laplacian(self.laplacian);
        self.embed_in(&Arc::new(original), work)
    }

    /// Signs a mesh that was cut into patches already, with the Laplacian chosen there. Who signs one model for many receivers calls
    /// [`Original::keep_bases`] first, so that they are computed once.
    ///
    /// # Errors
    /// As [`embed`](Self::embed); [`SigmarkError::Layout`] when `original` was cut for another number of bits or chips.
    pub fn embed_in(&self, original: &Arc<Original>, work: Work<'_>) -> Result<Signed, SigmarkError> {
        self.strength.check()?;
        original.check_layout(&ChipLayout::new(self.scheme.bits(), self.chip_rate)?)?;
        let mesh = original.mesh();
        let digest = GeometryDigest::of(mesh);
        let signature = self
            .key
            .sign(self.scheme, &self.coverage.signed_bytes(&self.message, &digest))?;
        let bits = signature.bits();
        let (alphas, distortion_rms) = self.alphas(original)?;
        let (displacements, patches) = original
            .map_bases(work, |index, patch, basis| {
                let alpha = alphas[index];
                let vertices = patch.vertices().len();
                let record = PatchRecord {
                    vertices,
                    alpha,
                    last_eigenvalue: basis.last_eigenvalue(),
                };
                (basis.displacement(original.layout(), &bits, alpha), record)
            })?
            .into_iter()
            .unzip();
        work.observer.stage(Stage::Embedding);
        let displacement = original.scatter(displacements);
        let positions = mesh.positions().iter().zip(&displacement);
        let positions = positions
            .map(|(p, d)| std::array::from_fn(|axis| p[axis] + d[axis]))
            .collect();
        let marked = mesh.with_positions(positions)?;

        let labels = PackedLabels::pack(original.patches().labels());
        let certificate = Certificate::issue(
            self.key,
            self.message.clone(),
            OriginalRecord {
                digest,
                vertices: mesh.vertex_count(),
                triangles: mesh.triangle_count(),
            },
            MarkRecord {
                coverage: self.coverage,
                signature,
                chip_rate: self.chip_rate,
                laplacian: original.laplacian(),
                labels,
                patches,
            },
        )?;
        Ok(Signed {
            marked,
            certificate,
            original: Arc::clone(original),
            signature,
            alphas,
            distortion_rms,
        })
    }

    /// α of every patch, and the RMS displacement as a fraction of the diagonal that they cause on the marked surface.
    fn alphas(&self, original: &Original) -> Result<(Vec<f64>, f64), SigmarkError> {
        let patches = original.patches();
        let areas: Vec<f64> = patches.iter().map(|patch| patch.mesh().area()).collect();
        if let Some(patch) = areas.iter().position(|&area| area == 0.0) {
            return Err(SigmarkError::NoArea { patch });
        }
        let diagonal = original.mesh().bounding_box().diagonal();
        let rms = |alphas: &[f64]| {
            let squares = patches.iter().zip(&areas).zip(alphas);
            let squares = squares
                .map(|((p, area), alpha)| area * alpha * alpha * p.unit_mean_square(original.layout()));
            (squares.sum::<f64>() / areas.iter().sum::<f64>()).sqrt() / diagonal
        };
        // For a strength of 1; everything grows linearly with it.
        let unit: Vec<f64> = match self.strength {
            Strength::Distortion(_) => vec![1.0 / rms(&vec![1.0; patches.len()]); patches.len()],
            Strength::Alpha(_) => vec![1.0; patches.len()],
            Strength::PaperAlpha(_) => areas.iter().map(|area| 1.0 / area.sqrt()).collect(),
        };
        let (what, value) = self.strength.named();
        let most = MOST_DISTORTION / rms(&unit);
        if value > most {
            return Err(SigmarkError::TooStrong { what, value, most });
        }
        let alphas: Vec<f64> = unit.iter().map(|alpha| value * alpha).collect();
        let distortion = rms(&alphas);
        Ok((alphas, distortion))
    }
}

/// A marked mesh with its certificate.
#[derive(Debug)]
pub struct Signed {
    marked: TriMesh,
    certificate: Certificate,
    original: Arc<Original>,
    signature: Signature,
    alphas: Vec<f64>,
    distortion_rms: f64,
}

impl Signed {
    /// The marked mesh: the original's triangles over new positions.
    pub fn mesh(&self) -> &TriMesh {
        &self.marked
    }

    /// The marked positions, one a vertex of the original.
    pub fn positions(&self) -> &[[f64; 3]] {
        self.marked.positions()
    }

    /// What a verifier needs besides the original and the public key.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }

    /// The original with its patches and bases.
    pub fn original(&self) -> &Arc<Original> {
        &self.original
    }

    /// The signature that was written.
    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// α in the scale-free convention: the same for every patch, or, when the paper's α was given, the root mean square
    /// over the marked surface.
    pub fn alpha(&self) -> f64 {
        let areas = self.original.patches().iter().map(|patch| patch.mesh().area());
        let square: f64 = areas
            .clone()
            .zip(&self.alphas)
            .map(|(area, alpha)| area * alpha * alpha)
            .sum();
        (square / areas.sum::<f64>()).sqrt()
    }

    /// Root mean square displacement of the marked surface, as a fraction of the bounding box's diagonal.
    pub fn distortion_rms(&self) -> f64 {
        self.distortion_rms
    }

    /// Extraction rate from positions in the original's frame, such as the marked ones rounded to a file's precision.
    ///
    /// Positions so near the marked ones that no bit can be lost need no bases: by the Cauchy–Schwarz inequality an error
    /// field ε changes a coefficient by ‖ε‖ at most, over unit area.
    ///
    /// # Errors
    /// As [`Original::map_bases`].
    pub fn read_back(&self, positions: &[[f64; 3]], work: Work<'_>) -> Result<f64, SigmarkError> {
        if self.is_surely_readable(positions) {
            return Ok(1.0);
        }
        let registered = Registered::by_vertices(positions.iter().copied().map(Some).collect());
        let extracted = CoefficientDetector
            .detect(&self.original, &self.alphas, &registered, work)?
            .hard();
        Ok(extraction_rate(&self.signature.bits(), &extracted))
    }

    fn is_surely_readable(&self, positions: &[[f64; 3]]) -> bool {
        let (mut written, mut lost) = ([0.0; 3], [0.0; 3]);
        for (patch, alpha) in self.original.patches().iter().zip(&self.alphas) {
            let (marked, held) = (patch.gather(self.positions()), patch.gather(positions));
            for axis in 0..3 {
                // The largest error bounds the root of its mean square.
                let error = marked
                    .iter()
                    .zip(&held)
                    .map(|(m, h)| (m[axis] - h[axis]).abs())
                    .fold(0.0, f64::max);
                written[axis] += alpha * patch.size()[axis];
                lost[axis] += error;
            }
        }
        (0..3).all(|axis| lost[axis] < written[axis])
    }
}
