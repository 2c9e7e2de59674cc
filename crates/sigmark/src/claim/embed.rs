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
    chip_rate: Option<usize>,
    strength: Strength,
    patches: Option<PatchCount>,
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
            chip_rate: None,
            strength: Strength::default(),
            patches: None,
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

    /// c, how often each bit is repeated in a patch; by default 1, and 3 in the paper's scheme.
    pub fn chip_rate(mut self, rate: usize) -> Self {
        self.chip_rate = Some(rate);
        self
    }

    /// How strongly to mark.
    pub fn strength(mut self, strength: Strength) -> Self {
        self.strength = strength;
        self
    }

    /// Into how many patches the mesh is cut, each of which carries the whole signature; by default [`PatchCount::Auto`], and [`PatchCount::Paper`] in
    /// the paper's scheme.
    pub fn patches(mut self, count: PatchCount) -> Self {
        self.patches = Some(count);
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
        let auto = match self.scheme.is_of_paper() {
            true => PatchCount::Paper,
            false => PatchCount::Auto,
        };
        let original = Original::cut(mesh.clone(), self.layout()?, self.patches.unwrap_or(auto), job)?;
        let original = original
            .with_laplacian(self.laplacian)
            .with_borders(self.carrier().borders());
        self.embed_in(&Arc::new(original), job)
    }

    /// Signs a mesh that was cut into patches already, with the Laplacian and the borders chosen there. Who signs one model for many receivers calls
    /// [`Original::keep_bases`] first, so that they are computed once.
    ///
    /// # Errors
    /// As [`embed`](Self::embed), and when `original` was cut for another number of bits or chips, or its harmonics have other
    /// [`Borders`](crate::mark::Borders) than the scheme's.
    pub fn embed_in(&self, original: &Arc<Original>, job: &Job) -> Result<Signed, SigmarkError> {
        self.strength.checked()?;
        original.layout().check(&self.layout()?)?;
        original.check_borders(self.carrier().borders())?;
        let layout = MarkLayout::with_strength(Arc::clone(original), self.strength)?;
        let statement = self.statement(&layout);
        let hash = statement.hash()?;
        let signature = self.key.sign(self.scheme, &statement.signed_bytes(&hash))?;
        let layout = layout.with_order(statement.carrier.order(hash));
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
        Ok(ChipLayout::new(self.scheme.bits(), self.rate())?)
    }

    fn rate(&self) -> usize {
        self.chip_rate
            .unwrap_or(if self.scheme.is_of_paper() { 3 } else { 1 })
    }

    fn carrier(&self) -> Carrier {
        match self.scheme.is_of_paper() {
            true => Carrier::Harmonics,
            false => Carrier::KeyedHarmonics,
        }
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
            carrier: self.carrier(),
            chip_rate: self.rate(),
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
