use std::sync::Arc;

use job::Job;
use mesh::TriMesh;
use mhb_core::LaplacianKind;

use super::{
    Certificate, PackedLabels, SigmarkError,
    certificate::Contents,
    keys::SigningKey,
    statement::{Carrier, OriginalRecord, Statement},
};
use crate::{
    mark::{
        ChipLayout, CoefficientDetector, Detector, MarkError, MarkLayout, MarkStage, Original, PatchCount,
        Registered, Strength, extraction_rate,
    },
    payload::{Curve, GeometryDigest, Scheme},
};

/// Signs a message and writes the signature into the shape of meshes.
///
/// Every choice has a default; [`embed`](Self::embed) does the work.
#[derive(Clone, Debug)]
pub struct Embedder {
    key: SigningKey,
    scheme: Scheme,
    message: String,
    recipient: String,
    original_name: String,
    chip_rate: usize,
    strength: Strength,
    patches: PatchCount,
    laplacian: LaplacianKind,
}

impl Embedder {
    /// An embedder for a key, with the scheme that suits the key's curve: SHA-256 on P-256; on the paper's curve SHA-1,
    /// and the signature covers the message alone.
    pub fn new(key: &SigningKey) -> Self {
        let scheme = match key.curve() {
            #[cfg(feature = "paper")]
            Curve::B163 => Scheme::EcdsaB163Sha1,
            Curve::P256 => Scheme::EcdsaP256Sha256,
        };
        Self {
            key: key.clone(),
            scheme,
            message: String::new(),
            recipient: String::new(),
            original_name: String::new(),
            chip_rate: 3,
            strength: Strength::default(),
            patches: PatchCount::Auto,
            laplacian: LaplacianKind::default(),
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

    /// Whom this copy is for: a text that will stand in the certificate. Empty by default.
    pub fn recipient(mut self, recipient: impl Into<String>) -> Self {
        self.recipient = recipient.into();
        self
    }

    /// The original's file name, which helps to find it again; it changes no bit of the mark. Empty by default.
    pub fn original_name(mut self, name: impl Into<String>) -> Self {
        self.original_name = name.into();
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

    /// Signs the mesh.
    ///
    /// # Errors
    /// When the key does not fit the scheme, the strength is out of bounds, or the mesh has no patch with room for the signature;
    /// [`SigmarkError::Job`].
    pub fn embed(&self, mesh: &TriMesh, job: &Job) -> Result<Signed, SigmarkError> {
        self.strength.checked()?;
        let original = Original::cut(mesh.clone(), self.layout()?, self.patches, job)?;
        self.embed_in(&Arc::new(original.with_laplacian(self.laplacian)), job)
    }

    /// Signs a mesh that was cut into patches already, with the Laplacian chosen there. Who signs one model for many receivers calls
    /// [`Original::keep_bases`] first, so that they are computed once.
    ///
    /// # Errors
    /// As [`embed`](Self::embed), and when `original` was cut for another number of bits or chips.
    pub fn embed_in(&self, original: &Arc<Original>, job: &Job) -> Result<Signed, SigmarkError> {
        self.strength.checked()?;
        original.layout().check(&self.layout()?)?;
        let layout = MarkLayout::with_strength(Arc::clone(original), self.strength)?;
        let statement = self.statement(&layout);
        let hash = statement.hash()?;
        let signature = self.key.sign(self.scheme, &statement.signed_bytes(&hash))?;
        let layout = layout.with_order(statement.order(hash));
        let written = layout.write(&statement.payload(hash).bits(&signature), job)?;
        job.begin(MarkStage::Embedding)?;
        let marked = original.mesh().with_positions(written.positions(original));
        let contents = Contents {
            statement,
            name: self.original_name.clone(),
            signature,
            eigenvalues: written.last_eigenvalues,
        };
        let certificate = Certificate::issue(&self.key, contents)?;
        Ok(Signed {
            marked: marked.map_err(MarkError::from)?,
            certificate,
            layout: Arc::new(layout),
        })
    }

    fn layout(&self) -> Result<ChipLayout, SigmarkError> {
        Ok(ChipLayout::new(self.scheme.bits(), self.chip_rate)?)
    }

    fn statement(&self, layout: &MarkLayout) -> Statement {
        let original = layout.original();
        let mesh = original.mesh();
        Statement {
            public_key: self.key.public_key(),
            message: self.message.clone(),
            recipient: self.recipient.clone(),
            original: OriginalRecord {
                digest: GeometryDigest::of(mesh),
                vertices: mesh.vertex_count(),
                triangles: mesh.triangle_count(),
            },
            scheme: self.scheme,
            carrier: match self.scheme.is_of_paper() {
                true => Carrier::Harmonics,
                false => Carrier::KeyedHarmonics,
            },
            chip_rate: self.chip_rate,
            laplacian: original.laplacian(),
            labels: PackedLabels::pack(original.patches().labels()),
            alphas: layout.alphas().to_vec(),
        }
    }
}

/// A marked mesh with its certificate.
#[derive(Debug)]
pub struct Signed {
    marked: TriMesh,
    certificate: Certificate,
    layout: Arc<MarkLayout>,
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

    /// Where the mark lies, and how strong it is.
    pub fn layout(&self) -> &Arc<MarkLayout> {
        &self.layout
    }

    /// The original with its patches and bases.
    pub fn original(&self) -> &Arc<Original> {
        self.layout.original()
    }

    /// Extraction rate from positions in the original's frame, such as the marked ones rounded to a file's precision.
    ///
    /// Positions so near the marked ones that no bit can be lost need no bases: by the Cauchy–Schwarz inequality an error
    /// field ε changes a coefficient by ‖ε‖ at most, over unit area.
    ///
    /// # Errors
    /// As [`Original::map_bases`].
    pub fn read_back(&self, positions: &[[f64; 3]], job: &Job) -> Result<f64, SigmarkError> {
        if self.is_surely_readable(positions) {
            return Ok(1.0);
        }
        let registered = Registered::by_vertices(positions.iter().copied().map(Some).collect());
        let soft = CoefficientDetector::new(&self.layout).detect(&registered, job)?;
        Ok(extraction_rate(&self.certificate.bits(), &soft.hard()))
    }

    fn is_surely_readable(&self, positions: &[[f64; 3]]) -> bool {
        let (mut written, mut lost) = ([0.0; 3], [0.0; 3]);
        for (patch, alpha) in self.original().patches().iter().zip(self.layout.alphas()) {
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
