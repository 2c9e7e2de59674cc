use std::{
    iter,
    sync::{Arc, OnceLock},
};

use job::Job;
use mesh::{
    Similarity, TriMesh,
    vector::{norm, sub},
};
use registration::{
    AlignOptions, Alignment, Correspondence, Difference, MatchedBy, RegistrationError, align,
    match_candidates,
};

use crate::{
    Certificate, ChipLayout, CoefficientDetector, Detector, GeometryDigest, Observer, Original, PatchBasis,
    PatchRecord, Patches, Registered, SigmarkError, SoftBits, Stage, Work,
    align::{Aligned, align as align_vertices},
    least_squares::Equations,
    resampling::Sampler,
    signature::{PublicKey, Scheme, Signature},
    statistics::{correlation, extraction_rate, p_value},
};

/// The answer to "is this our model?".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// The signature was read back from the shape, bit for bit, and checks against the public key.
    Verified,
    /// Not every bit could be read, but a mesh without the mark would agree this well with probability `p` at most.
    Detected {
        /// See [`p_value`].
        p: f64,
    },
    /// Nothing that chance does not explain.
    NotFound {
        /// See [`p_value`]; 1 where the suspect does not fit the original at all.
        p: f64,
    },
}

/// What was found, and how.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The answer.
    pub outcome: Outcome,
    /// ER (eq. 18), from 0 to 1; `None` if the suspect does not fit the original.
    pub extraction_rate: Option<f64>,
    /// The probability of such agreement without the mark, an upper bound; 1 if the suspect does not fit. Where the best of several
    /// readings was taken, since the suspect could lie in several ways or was read in two, it is multiplied by their number.
    pub p_value: f64,
    /// T = Σ sₜ xₜ / √(Σ xₜ²).
    pub correlation: f64,
    /// l.
    pub bits: usize,
    /// Bits read wrong; `None` if the suspect does not fit.
    pub bit_errors: Option<usize>,
    /// How the suspect was laid onto the original: by its vertices, or by its surface.
    pub basis: MatchedBy,
    /// In how many ways it could lie there; above 1 for symmetric shapes.
    pub poses: usize,
    /// Share of the suspect's surface that lies on the original, from 0 to 1; measured where it does not fit, too.
    pub overlap: f64,
    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    pub coverage: f64,
    /// Share of the original's vertices at which the suspect has no surface, from 0 to 1; 1 where it does not fit.
    pub missing: f64,
    /// RMS distance of corresponding points after alignment, as a fraction of the original's diagonal.
    pub residual: Option<f64>,
    /// Takes the suspect to the original.
    pub transform: Option<Similarity>,
    /// Why the suspect does not fit, in words.
    pub remark: Option<String>,
}

/// How many maps of a symmetric shape onto itself are tried: an icosphere has 120.
const MOST_MAPS: usize = 120;

/// Bases that take more are computed anew for every pass over them.
const KEPT_BYTES: usize = 1 << 30;

/// Judges suspects against one original and its certificate.
#[derive(Debug)]
pub struct Verifier<'a> {
    mesh: &'a TriMesh,
    certificate: &'a Certificate,
    p_bound: f64,
    threads: usize,
    detector: Option<&'a dyn Detector>,
    cut: OnceLock<Arc<Original>>,
}

impl<'a> Verifier<'a> {
    /// Checks that original, certificate and public key belong together.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherKey`] or [`SigmarkError::AnotherOriginal`] where they don't.
    pub fn new(
        original: &'a TriMesh,
        certificate: &'a Certificate,
        public_key: &PublicKey,
    ) -> Result<Self, SigmarkError> {
        if certificate.public_key() != public_key {
            return Err(SigmarkError::AnotherKey {
                certificate: certificate.public_key().fingerprint(),
                given: public_key.fingerprint(),
            });
        }
        check_digest(certificate, original)?;
        Ok(Self {
            mesh: original,
            certificate,
            p_bound: 1e-6,
            threads: 1,
            detector: None,
            cut: OnceLock::new(),
        })
    }

    /// The largest p-value that counts as detected; 10⁻⁶ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
        self
    }

    /// How many threads may work; 1 by default. The verdict does not depend on it.
    pub fn threads(mut self, threads: usize) -> Self {
        self.threads = threads;
        self
    }

    /// The detector that reads the bits. By default it is the paper's ([`CoefficientDetector`]) for marks of the paper's
    /// profile, and [`LeastSquaresDetector`](crate::LeastSquaresDetector) for others. Where all vertices were found again, the paper's, being cheap, comes
    /// first.
    pub fn detector(mut self, detector: &'a dyn Detector) -> Self {
        self.detector = Some(detector);
        self
    }

    /// Takes an original that was cut into patches already, with its bases if it keeps them.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherOriginal`], [`SigmarkError::Layout`] or [`SigmarkError::AnotherCut`] if it is not the original
    /// of the certificate.
    pub fn original(self, original: &Arc<Original>) -> Result<Self, SigmarkError> {
        let mark = self.certificate.mark();
        original.check_layout(&ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?)?;
        check_digest(self.certificate, original.mesh())?;
        let labels = mark.labels.unpack(original.mesh().vertex_count())?;
        if labels != original.patches().labels() || mark.laplacian != original.laplacian() {
            return Err(SigmarkError::AnotherCut);
        }
        Ok(Self {
            cut: OnceLock::from(Arc::clone(original)),
            ..self
        })
    }

    /// Judges a suspect. The original's bases are computed the first time that they are needed, and kept if they are not huge.
    ///
    /// # Errors
    /// When the original's bases can't be computed or are not those of the certificate.
    pub fn verify(&self, suspect: &TriMesh) -> Result<Verdict, SigmarkError> {
        self.verify_observed(suspect, &())
    }

    /// As [`verify`](Self::verify), with an observer that sees the progress and may stop it.
    ///
    /// # Errors
    /// As [`verify`](Self::verify); [`SigmarkError::Cancelled`] when the observer stopped it.
    pub fn verify_observed(
        &self,
        suspect: &TriMesh,
        observer: &dyn Observer,
    ) -> Result<Verdict, SigmarkError> {
        let work = Work {
            threads: self.threads,
            observer,
        };
        observer.stage(Stage::Registration);
        match match_candidates(self.mesh, suspect, MOST_MAPS, &Job::new(self.threads)) {
            Ok(maps) => self.by_vertices(suspect, &maps, work),
            Err(Difference::Job(error)) => Err(RegistrationError::Job(error).into()),
            Err(_) => self.by_surface(suspect, work),
        }
    }

    /// Judges a suspect that has the original's connectivity, its vertices being the original's by one of these maps.
    fn by_vertices(
        &self,
        suspect: &TriMesh,
        maps: &[Correspondence],
        work: Work<'_>,
    ) -> Result<Verdict, SigmarkError> {
        let (original, alphas) = (self.prepared(work)?, self.alphas());
        work.observer.stage(Stage::Detection);
        let detector = self.detector.unwrap_or(&CoefficientDetector);
        let readings = maps.iter().map(|map| {
            let check = |i: usize, basis: &PatchBasis| self.check_basis(i, basis);
            let aligned = align_vertices(original, &alphas, suspect, map, work, check)?;
            self.read(aligned, detector, work)
        });
        let mut reading = self.best(readings)?;
        if reading.soft.hard() != self.certificate.mark().signature.bits() {
            let Aligned {
                registered,
                transform,
                ..
            } = &reading.aligned;
            let together = self.together(registered.clone(), transform, work)?;
            let again = match self.alone() {
                Some(detector) => {
                    self.read(together.aligned.carried(self.mesh, transform), detector, work)?
                }
                None => together,
            };
            reading = self.better_of(reading, again);
        }
        let options = AlignOptions::default();
        let overlap = self.in_place(&reading.aligned.registered, &options);
        let fit = Fit {
            basis: MatchedBy::Connectivity,
            poses: maps.len(),
            overlap,
            coverage: overlap,
        };
        let mut verdict = self.judge(&reading, fit)?;
        if matches!(verdict.outcome, Outcome::NotFound { .. }) && overlap < options.least_overlap {
            verdict.remark = Some(format!(
                "another shape: it has the original's triangles, but {:.1} % of its vertices lie where those of the original do",
                100.0 * overlap
            ));
        }
        Ok(verdict)
    }

    /// The share of the vertices that lie near where they belong.
    fn in_place(&self, registered: &Registered, options: &AlignOptions) -> f64 {
        let bound = options.tolerance * self.mesh.bounding_box().diagonal();
        let pairs = registered.positions.iter().zip(self.mesh.positions());
        let distances: Vec<f64> = pairs.filter_map(|(r, &v)| r.map(|r| norm(sub(r, v)))).collect();
        let near = distances.iter().filter(|&&distance| distance <= bound);
        near.count() as f64 / distances.len().max(1) as f64
    }

    /// Judges a suspect by its surface.
    fn by_surface(&self, suspect: &TriMesh, work: Work<'_>) -> Result<Verdict, SigmarkError> {
        let options = AlignOptions::default();
        let alignment = align(self.mesh, suspect, &options, &Job::new(self.threads))?;
        let fit = Fit::of(&alignment);
        if !alignment.aligned {
            return Ok(self.does_not_align(fit, &options));
        }
        let (original, alphas) = (self.prepared(work)?, self.alphas());
        let mut sampler = Sampler::new(self.mesh, suspect);
        if let Some(survivors) = &alignment.correspondence {
            sampler = sampler.survivors(survivors);
        }
        let poses = iter::once(&alignment.transform).chain(&alignment.alternatives);
        let readings = poses.map(|pose| {
            let check = |i: usize, basis: &PatchBasis| self.check_basis(i, basis);
            let Some(detector) = self.alone() else {
                let (registered, soft, transform) =
                    sampler.read_checked(original, &alphas, pose, work, check)?;
                return Ok(Reading {
                    aligned: Aligned::new(self.mesh, registered, transform),
                    soft,
                    tries: 1,
                });
            };
            work.observer.stage(Stage::Resampling);
            let transform = sampler.refine_checked(original, &alphas, pose, work, check)?;
            let registered = sampler.sample(&transform, work)?;
            self.read(Aligned::new(self.mesh, registered, transform), detector, work)
        });
        let reading = self.best(readings)?;
        self.judge(&reading, fit)
    }

    /// The detector that reads bits by itself, if it is not to be least squares, which estimates a misalignment with them.
    fn alone(&self) -> Option<&dyn Detector> {
        self.detector
            .or(match self.certificate.mark().signature.scheme() {
                Scheme::EcdsaB163Sha1 => Some(&CoefficientDetector),
                _ => None,
            })
    }

    fn read(
        &self,
        aligned: Aligned,
        detector: &dyn Detector,
        work: Work<'_>,
    ) -> Result<Reading, SigmarkError> {
        work.observer.stage(Stage::Detection);
        let soft = detector.detect(self.cut()?, &self.alphas(), &aligned.registered, work)?;
        Ok(Reading {
            aligned,
            soft,
            tries: 1,
        })
    }

    /// Bits and misalignment of vertices that lie by this pose, by least squares.
    fn together(
        &self,
        registered: Registered,
        pose: &Similarity,
        work: Work<'_>,
    ) -> Result<Reading, SigmarkError> {
        work.observer.stage(Stage::Detection);
        let check = |i: usize, basis: &PatchBasis| self.check_basis(i, basis);
        let estimate = Equations::of(self.cut()?, &self.alphas(), &registered, work, check)?.solve()?;
        let transform = pose.then(&estimate.misalignment.inverse());
        Ok(Reading {
            aligned: Aligned::new(self.mesh, registered, transform),
            soft: SoftBits(estimate.bits),
            tries: 1,
        })
    }

    /// The reading that agrees best with the signature.
    fn best(
        &self,
        readings: impl Iterator<Item = Result<Reading, SigmarkError>>,
    ) -> Result<Reading, SigmarkError> {
        let mut best: Option<Reading> = None;
        for reading in readings {
            let reading = reading?;
            best = Some(match best {
                Some(best) => self.better_of(best, reading),
                None => reading,
            });
        }
        best.ok_or(SigmarkError::Alignment)
    }

    /// The one that agrees better with the signature, having taken the tries of both.
    fn better_of(&self, first: Reading, second: Reading) -> Reading {
        let expected = self.certificate.mark().signature.bits();
        let tries = first.tries + second.tries;
        let [t, u] = [&first, &second].map(|reading| correlation(&expected, &reading.soft.0));
        let better = if u > t { second } else { first };
        Reading { tries, ..better }
    }

    /// The original with its bases, if they are not huge.
    fn prepared(&self, work: Work<'_>) -> Result<&Original, SigmarkError> {
        let original = self.cut()?;
        if original.basis_bytes() <= KEPT_BYTES {
            original.keep_bases(work)?;
        }
        Ok(original)
    }

    fn alphas(&self) -> Vec<f64> {
        let patches = &self.certificate.mark().patches;
        patches.iter().map(|patch| patch.alpha).collect()
    }

    /// The original cut as the certificate says, the first time.
    fn cut(&self) -> Result<&Original, SigmarkError> {
        if let Some(original) = self.cut.get() {
            return Ok(original);
        }
        let mark = self.certificate.mark();
        let layout = ChipLayout::new(mark.signature.scheme().bits(), mark.chip_rate)?;
        let patches = Patches::from_labels(self.mesh, &mark.labels.unpack(self.mesh.vertex_count())?)?;
        if patches.len() != mark.patches.len() {
            return Err(SigmarkError::AnotherCut);
        }
        let original = Original::with_patches(self.mesh, layout, patches).with_laplacian(mark.laplacian);
        Ok(self.cut.get_or_init(|| Arc::new(original)))
    }

    /// The verdict on the best of several readings: choosing it by T gives chance as many tries.
    fn judge(&self, reading: &Reading, fit: Fit) -> Result<Verdict, SigmarkError> {
        let Reading { aligned, soft, tries } = reading;
        let mark = self.certificate.mark();
        let expected = mark.signature.bits();
        let extracted = soft.hard();
        let p = (p_value(&expected, &soft.0) * *tries as f64).min(1.0);
        let read = Signature::from_bits(mark.signature.scheme(), &extracted)?;
        let checks = self
            .certificate
            .public_key()
            .verify(&self.certificate.signed_bytes(), &read)
            .is_ok();
        let outcome = match (checks, p <= self.p_bound) {
            (true, _) => Outcome::Verified,
            (false, true) => Outcome::Detected { p },
            (false, false) => Outcome::NotFound { p },
        };
        Ok(Verdict {
            outcome,
            extraction_rate: Some(extraction_rate(&expected, &extracted)),
            p_value: p,
            correlation: correlation(&expected, &soft.0),
            bits: expected.len(),
            bit_errors: Some(expected.iter().zip(&extracted).filter(|(s, e)| s != e).count()),
            basis: fit.basis,
            poses: fit.poses,
            overlap: fit.overlap,
            coverage: fit.coverage,
            missing: aligned.registered.missing(),
            residual: Some(aligned.residual / self.mesh.bounding_box().diagonal()),
            transform: Some(aligned.transform),
            remark: None,
        })
    }

    fn does_not_align(&self, fit: Fit, options: &AlignOptions) -> Verdict {
        let remark = format!(
            "does not align: in the best position, {:.1} % of the suspect's surface lies on the original; {:.0} % are needed",
            100.0 * fit.overlap,
            100.0 * options.least_overlap
        );
        Verdict {
            outcome: Outcome::NotFound { p: 1.0 },
            extraction_rate: None,
            p_value: 1.0,
            correlation: 0.0,
            bits: self.certificate.mark().signature.scheme().bits(),
            bit_errors: None,
            basis: fit.basis,
            poses: 0,
            overlap: fit.overlap,
            coverage: fit.coverage,
            missing: 1.0,
            residual: None,
            transform: None,
            remark: Some(remark),
        }
    }

    fn check_basis(&self, patch: usize, basis: &PatchBasis) -> Result<(), SigmarkError> {
        check_basis(patch, &self.certificate.mark().patches[patch], basis)
    }
}

/// How a suspect and the original cover each other.
#[derive(Clone, Copy)]
struct Fit {
    basis: MatchedBy,
    /// In how many ways.
    poses: usize,
    overlap: f64,
    coverage: f64,
}

impl Fit {
    fn of(alignment: &Alignment) -> Self {
        Self {
            basis: alignment.matched_by,
            poses: 1 + alignment.alternatives.len(),
            overlap: alignment.overlap,
            coverage: alignment.coverage,
        }
    }
}

/// The best of several readings.
struct Reading {
    aligned: Aligned,
    soft: SoftBits,
    tries: usize,
}

fn check_digest(certificate: &Certificate, original: &TriMesh) -> Result<(), SigmarkError> {
    let (expected, found) = (certificate.original().digest, GeometryDigest::of(original));
    if expected == found {
        return Ok(());
    }
    Err(SigmarkError::AnotherOriginal {
        expected: expected.to_string(),
        found: found.to_string(),
    })
}

fn check_basis(patch: usize, record: &PatchRecord, basis: &PatchBasis) -> Result<(), SigmarkError> {
    if record.matches(basis) {
        return Ok(());
    }
    let (recorded, found) = (record.last_eigenvalue, basis.last_eigenvalue());
    Err(SigmarkError::BasisMismatch {
        patch,
        recorded,
        found,
    })
}
