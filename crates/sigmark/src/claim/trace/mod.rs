//! Whose copy was it: which of many marks of one original a suspect carries.
//!
//! All copies have one layout, and each its own statement h: its own bits, through its own rotation. What the suspect says of the coefficients is read once, whatever marks may be in it. A mark that has
//! nothing to do with it agrees by a sum of fair coins, whatever was done to the copies that it was made of: its bits were added to a stream of h, which nobody could know who had not the original.
//! So p of each is an upper bound, times the number of all that are asked for.
//!
//! Where several gave their copies together, the mark that is there most surely is taken out, and the others are asked for once more. Who is innocent is not in what is taken out,
//! so that his chance stays what it is.
//!
//! ```
//! use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
//! use job::Job;
//! use sigmark::{Curve, Embedder, SigningKey, claim::Tracer};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (original, job) = (mesh::shapes::bumpy_sphere(4, 1), Job::default());
//! let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([7; 32])); // for real keys: the system's generator
//! let prepared = Embedder::new(&key).message("© 2026 Studio").prepare(&original, &job)?;
//! let mut tracer = Tracer::new(&original, &key.public_key())?;
//! let mut copies = Vec::new();
//! for recipient in ["Anna", "Bert"] {
//!     let signed = prepared.embed_for(recipient, &job)?;
//!     tracer.add(&signed.certificate().clone().into())?;
//!     copies.push(signed.mesh().clone());
//! }
//! let trace = tracer.trace(&copies[1], &job)?;
//! assert_eq!(trace.accused.iter().map(|accused| accused.candidate).collect::<Vec<_>>(), [1]);
//! # Ok(())
//! # }
//! ```

mod answer;
mod residue;

pub use answer::{Accused, Trace};
pub use residue::{Order, Pattern, Residue};

use std::{borrow::Cow, sync::Arc};

use job::Job;
use mesh::{LargeParts, Rig, TriMesh, components};
use registration::PreparedMesh;

use super::{
    Certificate, Issued, SigmarkError, Statement,
    error::check_bound,
    keys::PublicKey,
    statistics::{margin_of, rademacher_tail},
    verify::{check_digest, check_key, cut_as},
};
use crate::{
    mark::{Found, JointEstimator, MarkLayout, MarkStage, Reader, ReadingMethod},
    payload::{GeometryDigest, RigDigest, Signature},
};

/// In how many ways parts that belong to several places are put back at most.
const WAYS_OF_PARTS: usize = 8;

/// Candidates that one thread asks for at a time.
const AT_A_TIME: usize = 64;

/// Names the copies that a suspect was made of, among those for which certificates were issued.
///
/// What it computes of the original is kept for the next suspect.
#[derive(Debug)]
pub struct Tracer {
    original: TriMesh,
    digest: GeometryDigest,
    public_key: PublicKey,
    reader: Reader,
    rig: Option<(RigDigest, Rig)>,
    lots: Vec<Lot>,
    candidates: Vec<Candidate>,
    decoys: Option<Decoys>,
    p_bound: f64,
}

/// The key that signed the certificate of a copy, where nobody said whose copies are asked for: none is taken from a certificate that another may have written, or that is of another original.
///
/// # Errors
/// [`SigmarkError::AnotherOriginal`] where it is not of the original with this digest; [`SigmarkError::PaperProfile`], as [`Tracer::add`]; [`SigmarkError::Certificate`] where the key that it names did not sign it.
pub fn signer_of(issued: &Issued, original: GeometryDigest) -> Result<PublicKey, SigmarkError> {
    let certificate = issued.unchecked();
    check_copy(certificate, original)?;
    certificate.check()?;
    Ok(*certificate.public_key())
}

/// Whether a certificate is of an original with this digest, and of a mark that tells copies apart.
fn check_copy(certificate: &Certificate, original: GeometryDigest) -> Result<(), SigmarkError> {
    check_digest(certificate, original)?;
    match certificate.statement().binds_original() {
        true => Ok(()),
        false => Err(SigmarkError::PaperProfile),
    }
}

/// Patterns that nobody has, of the first lot: numbered after the candidates, and made when they are asked for.
#[derive(Clone, Copy, Debug)]
struct Decoys {
    seed: u64,
    count: usize,
}

/// Copies of one layout: one reading serves all.
#[derive(Debug)]
struct Lot {
    /// The statement of its first copy; what distinguishes the others does not count.
    of: Statement,
    eigenvalues: Vec<f64>,
    method: ReadingMethod,
    order: Arc<Order>,
}

/// A copy for which a certificate was issued.
#[derive(Clone, Debug)]
struct Candidate {
    lot: usize,
    pattern: Pattern,
    signed: Vec<u8>,
    signature: Signature,
    sealed: Vec<u8>,
    seal: Signature,
}

/// A suspect as it was read, in every way in which it may lie on the original.
#[derive(Debug)]
pub struct TracedSuspect {
    /// Of each lot, one a way.
    residues: Vec<Vec<Residue>>,
    /// In how many ways it may be read: as a whole, brought back by a rig, by its parts, by each large one of them alone, in local frames. p counts all, whichever this is.
    looks: usize,
    trace: Trace,
}

impl Tracer {
    /// One that knows nobody yet. Nothing is computed.
    ///
    /// # Errors
    /// None that the options of this library can cause.
    pub fn new(original: &TriMesh, public_key: &PublicKey) -> Result<Self, SigmarkError> {
        Ok(Self {
            digest: GeometryDigest::of(original),
            original: original.clone(),
            public_key: *public_key,
            reader: Reader::new(original)?,
            rig: None,
            lots: Vec::new(),
            candidates: Vec::new(),
            decoys: None,
            p_bound: 1e-5,
        })
    }

    /// The largest p-value by which somebody is named; 10⁻⁵ by default.
    pub fn p_bound(mut self, bound: f64) -> Self {
        self.p_bound = bound;
        self
    }

    /// What poses the original: a suspect that it posed is read as it was before, where nobody is named otherwise. Copies whose certificates [don't bind it](Certificate::binds) are not read so.
    pub fn with_rig(mut self, rig: Option<Rig>) -> Self {
        self.rig = rig.map(|rig| (RigDigest::of(&rig), rig));
        self
    }

    /// Adds one who has a copy, and returns his number, from 0. Who is added twice is asked for once, under the first number that the key signed: an edited certificate shields nobody.
    ///
    /// # Errors
    /// [`SigmarkError::AnotherKey`], [`SigmarkError::AnotherOriginal`] where the certificate is of another claim; [`SigmarkError::PaperProfile`], since marks of the paper's profile tell no copies apart;
    /// [`SigmarkError::AnotherCut`]; [`SigmarkError::Certificate`] for the first of a layout that the key did not sign, so that nobody makes a reader take up a layout of his own.
    pub fn add(&mut self, issued: &Issued) -> Result<usize, SigmarkError> {
        let certificate = issued.unchecked();
        let statement = certificate.statement();
        check_key(certificate, &self.public_key)?;
        check_copy(certificate, self.digest)?;
        let hash = *certificate.statement_hash();
        let (signature, sealed, seal) = certificate.parts();
        let lot = match self.lot_of(certificate) {
            Some(lot) => lot,
            None => {
                certificate.check()?;
                self.open_lot(certificate)?
            }
        };
        self.candidates.push(Candidate {
            lot,
            pattern: Pattern {
                hash,
                bits: certificate.bits(),
            },
            signed: statement.signed_bytes(&hash),
            signature,
            sealed,
            seal,
        });
        Ok(self.candidates.len() - 1)
    }

    /// Asks for so many patterns too that nobody has, in the layout of the first candidate. They count as candidates in all probabilities, and show that those are right (Furon and Desoubeaux 2014): one that would be named stands among the
    /// [unsigned](Trace::unsigned), numbered after the candidates.
    pub fn with_decoys(mut self, count: usize, seed: u64) -> Self {
        self.decoys = Some(Decoys { seed, count });
        self
    }

    /// How many were added.
    pub fn candidates(&self) -> usize {
        self.candidates.len()
    }

    /// The lot of a certificate's layout, if there is one.
    fn lot_of(&self, certificate: &Certificate) -> Option<usize> {
        let (statement, eigenvalues) = (certificate.statement(), certificate.last_eigenvalues());
        let is_same = |lot: &Lot| {
            lot.of.labels == statement.labels
                && lot.of.functions == statement.functions
                && lot.of.alphas == statement.alphas
                && lot.of.laplacian == statement.laplacian
                && lot.of.carrier == statement.carrier
                && (lot.of.scheme, lot.of.payload) == (statement.scheme, statement.payload)
                && lot.of.original.rig == statement.original.rig
                && lot.eigenvalues == eigenvalues
        };
        self.lots.iter().position(is_same)
    }

    /// A lot for a certificate's layout.
    fn open_lot(&mut self, certificate: &Certificate) -> Result<usize, SigmarkError> {
        let (statement, eigenvalues) = (certificate.statement(), certificate.last_eigenvalues());
        let original = cut_as(&self.original, statement)?.expecting(eigenvalues.to_vec())?;
        let plan = statement.plan([0; 32])?;
        let layout = MarkLayout::new(Arc::new(original), plan, statement.alphas.clone())?;
        let layout = Arc::new(layout);
        self.lots.push(Lot {
            of: statement.clone(),
            eigenvalues: eigenvalues.to_vec(),
            method: ReadingMethod::joint(JointEstimator::of_coefficients(&layout).into()),
            order: Order::of(&layout).into(),
        });
        Ok(self.lots.len() - 1)
    }

    /// Names those whose copies are in a suspect: as a whole, or where that names nobody, in its connected parts, each put back by itself, by each of its large parts alone, or brought back from its pose.
    ///
    /// # Errors
    /// When the original's bases can't be computed or are not those of the certificates; [`SigmarkError::Bound`]; [`SigmarkError::Job`].
    pub fn trace(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Trace, SigmarkError> {
        check_bound(self.p_bound)?;
        let suspect = suspect.into();
        let has_parts = self.has_parts(suspect.mesh());
        let found = self.reader.find(&suspect, job)?;
        let (bent, large) = (self.bent(&found, job)?, LargeParts::of(suspect.mesh()));
        let is_bent = bent.is_some() || found.may_be_bent();
        let looks = self.looks(has_parts, is_bent, large.count());
        let trace = self.accuse(self.read_found(&found, looks, job)?, job)?;
        if trace.is_found() {
            return Ok(trace);
        }
        if let Some((_, rig)) = self.rig.as_ref().filter(|_| self.is_posed_by_rig())
            && let Some(unposed) = found.unposed(rig, job)?
        {
            let by_rig = self.accuse(self.read_found(&unposed, looks, job)?, job)?;
            if by_rig.is_found() {
                return Ok(by_rig);
            }
        }
        if has_parts && let Some(parts) = self.parts_read(&suspect, looks, job)? {
            let of_parts = self.accuse(parts, job)?;
            if of_parts.is_found() {
                return Ok(of_parts);
            }
        }
        // A cropped copy may stand among other things.
        for part in large.meshes() {
            let share = part.area() / suspect.mesh().area();
            let found = self.reader.find(part, job)?;
            let mut alone = self.accuse(self.read_found(&found, looks, job)?, job)?;
            if alone.is_found() {
                alone.overlap *= share;
                return Ok(alone);
            }
        }
        // Last, since parts that were put back say where each went.
        if let Some(bent) = bent {
            let in_frames = self.accuse(self.read_found(&bent, looks, job)?, job)?;
            if in_frames.is_found() {
                return Ok(in_frames);
            }
        }
        if let Some(unbent) = found.unbent(job)? {
            let by_surface = self.accuse(self.read_found(&unbent, looks, job)?, job)?;
            if by_surface.is_found() {
                return Ok(by_surface);
            }
        }
        Ok(trace)
    }

    /// Reads a suspect as a whole, whoever may have had it.
    ///
    /// # Errors
    /// As [`trace`](Self::trace).
    pub fn read(&self, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<TracedSuspect, SigmarkError> {
        let suspect = suspect.into();
        let has_parts = self.has_parts(suspect.mesh());
        let large = LargeParts::of(suspect.mesh()).count();
        let found = self.reader.find(suspect, job)?;
        let looks = self.looks(has_parts, self.is_bent(&found, job)?, large);
        self.read_found(&found, looks, job)
    }

    fn has_parts(&self, suspect: &TriMesh) -> bool {
        [&self.original, suspect]
            .map(|mesh| components(mesh).count > 1)
            .contains(&true)
    }

    /// Whether any copy was signed with what poses the original.
    fn is_posed_by_rig(&self) -> bool {
        self.lots.iter().any(|lot| self.binds_rig(lot))
    }

    fn binds_rig(&self, lot: &Lot) -> bool {
        let bound = lot.of.original.rig;
        bound.is_some() && bound == self.rig.as_ref().map(|(digest, _)| *digest)
    }

    /// A suspect in local frames, if something bent it.
    fn bent(&self, found: &Found, job: &Job) -> Result<Option<Found>, SigmarkError> {
        match self.lots.first() {
            Some(lot) => Ok(found.in_local_frames(lot.method.layout(), job)?),
            None => Ok(None),
        }
    }

    /// Whether it is looked at in local frames, too, by its vertices or by its surface.
    fn is_bent(&self, found: &Found, job: &Job) -> Result<bool, SigmarkError> {
        Ok(self.bent(found, job)?.is_some() || found.may_be_bent())
    }

    /// How many ways there are to the same coefficients: as a whole, by its parts together, in local frames, by the rig of the copies, and by each of its large parts alone.
    fn looks(&self, has_parts: bool, is_bent: bool, large_parts: usize) -> usize {
        let ways = [has_parts, is_bent, self.is_posed_by_rig()];
        1 + large_parts + ways.into_iter().map(usize::from).sum::<usize>()
    }

    fn read_found(&self, found: &Found, looks: usize, job: &Job) -> Result<TracedSuspect, SigmarkError> {
        let mut traced = TracedSuspect {
            residues: Vec::new(),
            looks,
            trace: Trace::unread(found, self.candidates.len()),
        };
        if traced.trace.mismatch.is_some() {
            return Ok(traced);
        }
        for lot in &self.lots {
            if found.matched_by().is_by_rig() && !self.binds_rig(lot) {
                traced.residues.push(Vec::new());
                continue;
            }
            let readings = found.readings(&lot.method, job)?;
            let readings = readings.of_every_way(job)?;
            traced.trace.describe(&readings, found.alignment().is_none());
            let residues = readings
                .iter()
                .filter_map(|reading| Residue::of(reading, &lot.order));
            traced.residues.push(residues.collect());
        }
        Ok(traced)
    }

    /// Reads parts of a suspect together that are parts of the original, wherever they went; none where there are none.
    ///
    /// # Errors
    /// As [`trace`](Self::trace).
    pub fn read_parts(
        &self,
        suspect: impl Into<PreparedMesh>,
        job: &Job,
    ) -> Result<Option<TracedSuspect>, SigmarkError> {
        let suspect = suspect.into();
        let found = self.reader.find(&suspect, job)?;
        let large = LargeParts::of(suspect.mesh()).count();
        let looks = self.looks(true, self.is_bent(&found, job)?, large);
        self.parts_read(&suspect, looks, job)
    }

    fn parts_read(
        &self,
        suspect: &PreparedMesh,
        looks: usize,
        job: &Job,
    ) -> Result<Option<TracedSuspect>, SigmarkError> {
        let mut traced = TracedSuspect {
            residues: Vec::new(),
            looks,
            trace: Trace::of_parts(self.candidates.len()),
        };
        for lot in &self.lots {
            let found = self.reader.find_parts(suspect, lot.method.layout(), job)?;
            let ways = found.read_every_way(&lot.method, WAYS_OF_PARTS, job)?;
            traced.trace.describe_parts(&ways);
            let residues = ways
                .iter()
                .filter_map(|way| Residue::of(&way.reading, &lot.order));
            traced.residues.push(residues.collect());
        }
        let is_read = traced.residues.iter().any(|ways| !ways.is_empty());
        Ok(is_read.then_some(traced))
    }

    /// Names those whose copies are in a suspect that was read.
    ///
    /// # Errors
    /// [`SigmarkError::Job`].
    pub fn accuse(&self, suspect: TracedSuspect, job: &Job) -> Result<Trace, SigmarkError> {
        let TracedSuspect {
            mut residues,
            looks,
            mut trace,
        } = suspect;
        if trace.mismatch.is_some() {
            return Ok(trace);
        }
        job.begin(MarkStage::Detection)?;
        let ways = residues.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let mut asked: Vec<usize> = self.distinct();
        trace.candidates = asked.len();
        let tries = (asked.len() * ways * looks) as f64;
        while !asked.is_empty() {
            let Some(Best { candidate, way, t }) = self.best(&asked, &residues, job)? else {
                break;
            };
            let p_value = (rademacher_tail(t) * tries * share_of_round(trace.accused.len())).min(1.0);
            if p_value > self.p_bound {
                break;
            }
            asked.retain(|&other| other != candidate);
            if !self.is_signed(candidate) {
                trace.unsigned.push(candidate);
                continue;
            }
            let (lot, pattern) = self.pattern(candidate);
            let margin = margin_of(t, residues[lot][way].bits_seen(&pattern));
            trace.accused.push(Accused {
                candidate,
                p_value,
                correlation: t,
                margin,
            });
            // The suspect lies in one way, and this is it.
            residues[lot].swap(0, way);
            residues[lot].truncate(1);
            residues[lot][0].take_out(&pattern);
        }
        if trace.accused.is_empty() {
            trace.altered = self.altered(&asked, job)?;
        }
        Ok(trace)
    }

    /// Of some candidates those whose certificates the key did not sign.
    fn altered(&self, asked: &[usize], job: &Job) -> Result<Vec<usize>, SigmarkError> {
        const AT_ONCE: usize = 64;
        let has_certificate = |number: &usize| *number < self.candidates.len();
        let candidates: Vec<usize> = asked.iter().copied().filter(has_certificate).collect();
        let is_signed = job.map(candidates.len(), AT_ONCE, |i| self.is_signed(candidates[i]))?;
        let pairs = candidates.into_iter().zip(is_signed);
        Ok(pairs
            .filter(|(_, is_signed)| !is_signed)
            .map(|(number, _)| number)
            .collect())
    }

    /// The lot and the pattern of a candidate, or of a decoy.
    fn pattern(&self, number: usize) -> (usize, Cow<'_, Pattern>) {
        match (self.candidates.get(number), self.decoys) {
            (Some(candidate), _) => (candidate.lot, Cow::Borrowed(&candidate.pattern)),
            (None, decoys) => {
                let seed = decoys.map_or(0, |decoys| decoys.seed);
                let bits = self.lots.first().map_or(0, |lot| lot.order.bits());
                (0, Cow::Owned(Pattern::decoy(seed, number as u64, bits)))
            }
        }
    }

    /// The candidates, each once, and the decoys.
    fn distinct(&self) -> Vec<usize> {
        let mut numbers: Vec<usize> = (0..self.candidates.len()).collect();
        let hash = |&i: &usize| self.candidates[i].pattern.hash;
        numbers.sort_by_key(|i| (hash(i), *i));
        numbers.dedup_by(|later, kept| {
            let is_same = hash(later) == hash(kept);
            if is_same && !self.is_signed(*kept) && self.is_signed(*later) {
                *kept = *later;
            }
            is_same
        });
        numbers.sort_unstable();
        let decoys = self.decoys.map_or(0, |decoys| decoys.count);
        numbers.extend((0..decoys).map(|i| self.candidates.len() + i));
        numbers
    }

    /// The candidate, among some, whose mark is there most surely, and in which way.
    fn best(
        &self,
        asked: &[usize],
        residues: &[Vec<Residue>],
        job: &Job,
    ) -> Result<Option<Best>, SigmarkError> {
        let best_of = |chunk: &[usize]| {
            let all = chunk.iter().flat_map(|&candidate| {
                let (lot, pattern) = self.pattern(candidate);
                let residues = residues[lot].iter().enumerate();
                residues.map(move |(way, residue)| Best {
                    candidate,
                    way,
                    t: residue.correlation(&pattern),
                })
            });
            all.max_by(|a, b| a.t.total_cmp(&b.t))
        };
        let chunks: Vec<&[usize]> = asked.chunks(AT_A_TIME).collect();
        let best = job.map_reported(chunks.len(), 1, |i| best_of(chunks[i]))?;
        Ok(best.into_iter().flatten().max_by(|a, b| a.t.total_cmp(&b.t)))
    }

    /// Whether signature and seal are the key's.
    fn is_signed(&self, candidate: usize) -> bool {
        let Some(Candidate {
            signed,
            signature,
            sealed,
            seal,
            ..
        }) = self.candidates.get(candidate)
        else {
            return false;
        };
        let key = &self.public_key;
        key.verify(signed, signature).is_ok() && key.verify(sealed, seal).is_ok()
    }
}

/// The best of some candidates.
struct Best {
    candidate: usize,
    way: usize,
    t: f64,
}

/// How many times the chance of a round counts after so many were found, so that those of all rounds add up to one: 1 / 0.8, then 5 k (k − 1) in round k.
fn share_of_round(found: usize) -> f64 {
    match found {
        0 => 1.25,
        _ => 5.0 * ((found + 1) * found) as f64,
    }
}

impl TracedSuspect {
    /// What was read for the copies of one layout, the first by default, in each way in which the suspect may lie.
    pub fn residues(&self) -> &[Vec<Residue>] {
        &self.residues
    }
}
