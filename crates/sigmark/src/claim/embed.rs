use std::sync::Arc;

use code::LISTS;
use job::Job;
use mesh::{Rig, TriMesh};
use mhb_core::LaplacianKind;

use super::{
    Certificate, PackedLabels, Prediction, Prepared, SigmarkError,
    keys::SigningKey,
    statement::{Carrier, OriginalRecord, Statement, chips_of},
};
use crate::{
    mark::{
        ChipLayout, CoefficientDetector, Detector, JointEstimate, Levelled, MarkError, MarkLayout, Original,
        PatchCount, Pool, Registered, SoftBits, Strength, extraction_rate,
    },
    payload::{Curve, GeometryDigest, PayloadKind, RigDigest, Scheme},
};

/// Chips of a mark, where there is room and nothing else was asked for.
const CHIPS: usize = 3072;

/// Of the margin at which a payload is read, so many times as much is predicted for a model that is to hold the whole signature: attacks that a mark should outlast are worse than
/// [the noise](super::QUOTED_NOISE) that predictions are for.
const AMPLE: f64 = 2.0;

/// So often a mark is taken back around triangles that rounding turns. Corners that stay where they were are held as they were, and others seldom turn by that.
const MOST_ROUNDS: usize = 8;

/// Signs a message and writes the signature into the shape of meshes.
///
/// Every choice has a default; [`embed`](Self::embed) does the work.
#[derive(Clone, Debug)]
pub struct Embedder {
    pub(super) key: SigningKey,
    scheme: Scheme,
    payload: Option<PayloadKind>,
    message: String,
    recipient: String,
    pub(super) original_name: String,
    rig: Option<RigDigest>,
    chip_rate: Option<usize>,
    pub(super) strength: Strength,
    patches: Option<usize>,
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
            payload: None,
            message: String::new(),
            recipient: String::new(),
            original_name: String::new(),
            rig: None,
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

    /// What of the signature stands in the shape. By default the whole, or on models too small for it the [tag](PayloadKind::Tag), which a quarter of the chips carries: where there
    /// are fewer than two chips to a bit of the signature, or the predicted margin is less than twice the one at which it is read.
    pub fn payload(mut self, kind: Option<PayloadKind>) -> Self {
        self.payload = kind;
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

    /// What poses the original: it is signed with it, so that what is read of a suspect in another pose, [brought back by this rig](crate::Verifier::with_rig), is as good as what is read of others. By default nothing
    /// does.
    pub fn rig(mut self, rig: Option<&Rig>) -> Self {
        self.rig = rig.filter(|rig| !rig.is_empty()).map(RigDigest::of);
        self
    }

    /// How many chips there are to a bit of the payload in the whole mark, where there is room, by default as many as make 3072; in the paper's scheme c, how often each bit stands in
    /// each patch, by default 3.
    pub fn chip_rate(mut self, rate: usize) -> Self {
        self.chip_rate = Some(rate);
        self
    }

    /// How strongly to mark.
    pub fn strength(mut self, strength: Strength) -> Self {
        self.strength = strength;
        self
    }

    /// Into how many patches the mesh is cut, about; by default as many as make the harmonics cheap, and in the paper's scheme as few as
    /// stay below 30 000 vertices.
    pub fn patches(mut self, count: usize) -> Self {
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
    /// When the key or the payload does not fit the scheme, the strength is out of bounds, or the mesh has no patch with room for the signature;
    /// [`SigmarkError::Job`].
    pub fn embed(&self, mesh: &TriMesh, job: &Job) -> Result<Signed, SigmarkError> {
        self.embed_in(&Arc::new(self.cut(mesh, job)?), job)
    }

    /// Signs a mesh that was cut into patches already, with the Laplacian and the borders chosen there. Who signs one model for many recipients
    /// [prepares](Self::prepare) it.
    ///
    /// # Errors
    /// As [`embed`](Self::embed), and when `original` has no room for the mark, or its harmonics have other
    /// [`Borders`](crate::mark::Borders) than the scheme's.
    pub fn embed_in(&self, original: &Arc<Original>, job: &Job) -> Result<Signed, SigmarkError> {
        self.prepare_in(original)?.embed_for(&self.recipient, job)
    }

    /// All that signing a mesh for any recipient takes, bases included: a copy for one more costs little after that.
    ///
    /// # Errors
    /// As [`embed`](Self::embed).
    pub fn prepare(&self, mesh: &TriMesh, job: &Job) -> Result<Prepared, SigmarkError> {
        let prepared = self.prepare_in(&Arc::new(self.cut(mesh, job)?))?;
        prepared.keep_bases(job)?;
        Ok(prepared)
    }

    /// As [`prepare`](Self::prepare), of a mesh that was cut already, and without the bases, which take nearly all of the time:
    /// [`Prepared::keep_bases`] computes them.
    ///
    /// # Errors
    /// As [`embed_in`](Self::embed_in).
    pub fn prepare_in(&self, original: &Arc<Original>) -> Result<Prepared, SigmarkError> {
        Prepared::new(self, original)
    }

    /// Cuts a mesh as [`embed`](Self::embed) does; [`embed_in`](Self::embed_in) does the rest.
    ///
    /// # Errors
    /// As [`embed`](Self::embed).
    pub fn cut(&self, mesh: &TriMesh, job: &Job) -> Result<Original, SigmarkError> {
        self.strength.checked()?;
        self.check_payload()?;
        let original = match self.carrier() {
            Carrier::Harmonics { chip_rate } => {
                let count = self.patches.map_or(PatchCount::Paper, PatchCount::Exactly);
                let functions = ChipLayout::new(self.scheme.bits(), chip_rate)?.functions();
                Original::cut(mesh.clone(), functions, count, job)?
            }
            Carrier::PooledHarmonics => match self.payload {
                Some(kind) => self.pooled(mesh, kind, job)?,
                None => match self.pooled(mesh, PayloadKind::Signature, job) {
                    Err(MarkError::Room { .. }) => self.pooled(mesh, PayloadKind::Tag, job)?,
                    cut => cut?,
                },
            },
        };
        Ok(original
            .with_laplacian(self.laplacian)
            .with_borders(self.carrier().borders()))
    }

    /// How strong the mark will be, and what it survives.
    ///
    /// # Errors
    /// When the strength is out of bounds, or `original` has no room for the mark.
    pub fn predict(&self, original: &Arc<Original>) -> Result<Prediction, SigmarkError> {
        let (payload, layout) = self.payload_and_layout(original)?;
        Ok(self.predict_of(&layout, payload))
    }

    pub(super) fn predict_of(&self, layout: &MarkLayout, payload: PayloadKind) -> Prediction {
        Prediction::of(layout, self.scheme, payload)
    }

    pub(super) fn predict_levelled(
        &self,
        layout: &MarkLayout,
        payload: PayloadKind,
        levelled: &Levelled,
    ) -> Prediction {
        let margin_at = |noise| layout.margin_levelled(noise, levelled);
        Prediction::by_margin(layout, self.scheme, payload, margin_at)
    }

    fn check_payload(&self) -> Result<(), SigmarkError> {
        let scheme = self.scheme;
        match self.payload {
            Some(payload) if !payload.suits(scheme) => Err(SigmarkError::Payload { payload, scheme }),
            _ => Ok(()),
        }
    }

    /// What a mark in an original will hold, and where, but for the order of the chips, which is known when all else is.
    pub(super) fn payload_and_layout(
        &self,
        original: &Arc<Original>,
    ) -> Result<(PayloadKind, MarkLayout), SigmarkError> {
        self.check_payload()?;
        let fixed = match self.payload {
            Some(kind) => Some(kind),
            None if self.scheme.is_of_paper() => Some(PayloadKind::PlainSignature),
            None if chips_of(original.functions()) < 2 * self.scheme.bits() => Some(PayloadKind::Tag),
            None => None,
        };
        if let Some(kind) = fixed {
            return Ok((kind, self.layout_of(original, kind)?));
        }
        let whole = self.layout_of(original, PayloadKind::Signature)?;
        let predicted = self.predict_of(&whole, PayloadKind::Signature);
        match predicted.margin < AMPLE * predicted.margin_read {
            true => Ok((PayloadKind::Tag, self.layout_of(original, PayloadKind::Tag)?)),
            false => Ok((PayloadKind::Signature, whole)),
        }
    }

    fn layout_of(&self, original: &Arc<Original>, payload: PayloadKind) -> Result<MarkLayout, MarkError> {
        let functions = original.functions();
        let plan = self.carrier().plan(self.scheme, payload, functions, [0; 32])?;
        plan.check(functions)?;
        MarkLayout::with_strength(Arc::clone(original), plan, self.strength)
    }

    /// A mesh cut for a payload whose chips are pooled.
    fn pooled(&self, mesh: &TriMesh, payload: PayloadKind, job: &Job) -> Result<Original, MarkError> {
        let bits = payload.bits(self.scheme);
        let pool = Pool {
            repetitions: self.chip_rate.or(Some(CHIPS / bits)),
            patches: self.patches,
        };
        Original::pooled(mesh.clone(), bits, pool, job)
    }

    pub(super) fn carrier(&self) -> Carrier {
        match self.scheme.is_of_paper() {
            true => Carrier::Harmonics {
                chip_rate: self.chip_rate.unwrap_or(3),
            },
            false => Carrier::PooledHarmonics,
        }
    }

    /// What a mark for nobody states.
    pub(super) fn statement(&self, original: &Original, payload: PayloadKind, alphas: Vec<f64>) -> Statement {
        let mesh = original.mesh();
        Statement {
            public_key: self.key.public_key(),
            message: self.message.clone(),
            recipient: String::new(),
            original: OriginalRecord {
                digest: GeometryDigest::of(mesh),
                vertices: mesh.vertex_count(),
                triangles: mesh.triangle_count(),
                rig: self.rig,
            },
            scheme: self.scheme,
            payload,
            carrier: self.carrier(),
            laplacian: original.laplacian(),
            labels: PackedLabels::pack(original.patches().labels()),
            functions: original.functions().to_vec(),
            alphas,
        }
    }
}

/// Of a sound mark so many bits are right.
const SOUND: f64 = 0.95;

/// What is read of a mark in positions that a file can hold.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReadBack {
    /// ER (eq. 18) over the bits that have a chip, from 0 to 1.
    pub extraction_rate: f64,
    /// Whether the payload is read.
    pub is_read: bool,
}

impl ReadBack {
    /// Whether the file leaves the mark as good as whole: the payload is read, and of a hundred bits at most five are lost, so that what else happens to a copy may take most of what
    /// a code can mend.
    pub fn is_sound(&self) -> bool {
        self.is_read && self.extraction_rate >= SOUND
    }
}

/// A marked mesh with its certificate.
#[derive(Debug)]
pub struct Signed {
    pub(super) marked: TriMesh,
    pub(super) certificate: Certificate,
    pub(super) layout: Arc<MarkLayout>,
    /// What slivers took; none of the paper's scheme, which knows no slivers.
    pub(super) levelled: Option<Levelled>,
    pub(super) prediction: Prediction,
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

    /// How strong the mark is, and what it survives: as [foretold](Prepared::prediction), or less where [slivers](MarkLayout::level_slivers) took a part of it.
    pub fn prediction(&self) -> &Prediction {
        &self.prediction
    }

    /// What `write` makes of the marked positions, a file for instance, whose own `positions` are rounded. The mark is taken [back](MarkLayout::level_rounded) around triangles that are so small
    /// that rounding turns them by more than 20 degrees, and the file is made anew.
    ///
    /// # Errors
    /// Those of `write`.
    pub fn hold<F, E: From<SigmarkError>>(
        &mut self,
        write: impl Fn(&[[f64; 3]]) -> Result<F, E>,
        positions: impl Fn(&F) -> &[[f64; 3]],
    ) -> Result<F, E> {
        let mut file = write(self.positions())?;
        for _ in 0..MOST_ROUNDS {
            let Some(levelled) = &mut self.levelled else {
                break;
            };
            let mut marked = self.marked.positions().to_vec();
            if !self.layout.level_rounded(&mut marked, positions(&file), levelled) {
                break;
            }
            let mesh = self.marked.with_positions(marked);
            self.marked = mesh.map_err(|error| SigmarkError::from(MarkError::from(error)))?;
            file = write(self.positions())?;
        }
        Ok(file)
    }

    /// What is read from positions in the original's frame, such as the marked ones rounded to a file's precision; at least, where no bases are computed.
    ///
    /// Patches whose positions are so near the marked ones that no chip can be lost need none: by the Cauchy–Schwarz inequality an error
    /// field ε changes a coefficient by ‖ε‖ at most, over unit area. Where they alone are as good as the whole mark, the others are left out.
    ///
    /// # Errors
    /// As [`Original::map_bases`].
    pub fn read_back(&self, positions: &[[f64; 3]], job: &Job) -> Result<ReadBack, SigmarkError> {
        let bits = self.certificate.bits();
        let (mut is_borne, mut is_sure) = (vec![false; bits.len()], vec![false; bits.len()]);
        for patch in 0..self.original().patches().len() {
            let is_patch_sure = self.is_surely_readable(patch, positions);
            for chip in self.layout.chips(patch) {
                is_borne[chip.bit] = true;
                is_sure[chip.bit] |= is_patch_sure;
            }
        }
        let borne = |of: &[bool]| -> Vec<bool> {
            let chosen = of.iter().zip(&is_borne).filter(|&(_, &is_borne)| is_borne);
            chosen.map(|(&bit, _)| bit).collect()
        };
        let count = |of: &[bool]| of.iter().filter(|&&is_it| is_it).count();
        let known = count(&is_sure) as f64 / count(&is_borne).max(1) as f64;
        if known >= SOUND {
            let ratio = |(&bit, &is_sure): (&bool, &bool)| match (is_sure, bit) {
                (false, _) => 0.0,
                (true, true) => JointEstimate::MOST_CERTAIN,
                (true, false) => -JointEstimate::MOST_CERTAIN,
            };
            let soft = SoftBits::ratios(bits.iter().zip(&is_sure).map(ratio).collect());
            if self.certificate.is_read(&soft, &LISTS) {
                return Ok(ReadBack {
                    extraction_rate: known,
                    is_read: true,
                });
            }
        }
        let registered = Registered::by_vertices(positions.iter().copied().map(Some).collect());
        let soft = CoefficientDetector::new(&self.layout).detect(&registered, job)?;
        Ok(ReadBack {
            extraction_rate: extraction_rate(&borne(&bits), &borne(&soft.hard())),
            is_read: self.certificate.is_read(&soft, &LISTS),
        })
    }

    /// Whether positions leave every chip of a patch its sign.
    fn is_surely_readable(&self, patch: usize, positions: &[[f64; 3]]) -> bool {
        let of_patch = &self.original().patches()[patch];
        let (marked, held) = (of_patch.gather(self.positions()), of_patch.gather(positions));
        let amplitude = self.layout.amplitude(patch);
        let levelled = self.levelled.as_ref();
        let taken = levelled.map_or([0.0; 3], |levelled| levelled.taken[patch]);
        (0..3).all(|axis| {
            // The largest error bounds the root of its mean square.
            let errors = marked.iter().zip(&held).map(|(m, h)| (m[axis] - h[axis]).abs());
            errors.fold(taken[axis], |sum, error| sum.max(taken[axis] + error)) < amplitude[axis]
        })
    }
}
