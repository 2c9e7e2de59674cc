//! What is read of a suspect in the pose that was found, and in the true one.

use std::sync::Arc;

use anyhow::{Context, Result};
use job::Job;
use mesh::{Similarity, TriMesh};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::{Alignment, MatchedBy, PreparedMesh};
use serde::{Deserialize, Serialize};
use sigmark::{
    Curve, Embedder, Signed, SigningKey,
    mark::{CoefficientDetector, Detector, JointEstimator, Reader, ReadingMethod, SoftBits, extraction_rate},
};

use crate::suspects::misfit;

/// Transforms that bring the suspect's vertices nearer to each other than this fraction of the diagonal, root mean square, read
/// the same: a thousandth of a mark.
const SAME_PLACE: f64 = 1e-7;

/// How bits are read.
#[derive(Clone, Copy)]
pub(crate) enum ReadingRule {
    /// As `sigmark verify` reads surfaces.
    LeastSquares,
    Paper,
}

/// Extraction rates with the found transform and with the true one.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct BitRates {
    least_squares: [f64; 2],
    paper: [f64; 2],
}

impl BitRates {
    /// With the found transform and with the true one, by this rule.
    pub(crate) fn by(&self, rule: ReadingRule) -> [f64; 2] {
        match rule {
            ReadingRule::LeastSquares => self.least_squares,
            ReadingRule::Paper => self.paper,
        }
    }
}

/// The marked original, and what was read of its suspects.
pub(crate) struct MarkedMesh {
    signed: Signed,
    reader: Reader,
    joint: Arc<JointEstimator>,
    known: Vec<KnownRates>,
}

/// What was read of a suspect in a place.
struct KnownRates {
    suspect: String,
    place: Similarity,
    rates: BitRates,
}

impl MarkedMesh {
    /// Marks a mesh as `sigmark embed` does it by default.
    pub(crate) fn new(original: &TriMesh) -> Result<Self> {
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::seed_from_u64(2012));
        let signed = Embedder::new(&key).embed(original, &Job::default())?;
        signed.original().keep_bases(&Job::default())?;
        Ok(Self {
            reader: Reader::new(signed.original().mesh())?,
            joint: Arc::new(JointEstimator::new(signed.layout())),
            signed,
            known: Vec::new(),
        })
    }

    pub(crate) fn mesh(&self) -> &TriMesh {
        self.signed.mesh()
    }

    /// Extraction rates of the suspect of this name; with the best of all poses that were found, as the verifier has it.
    pub(crate) fn rates(
        &mut self,
        name: &str,
        suspect: &TriMesh,
        moved: &Similarity,
        found: &Alignment,
    ) -> Result<BitRates> {
        let near = SAME_PLACE * self.signed.original().mesh().bounding_box().diagonal();
        let mut best: Option<BitRates> = None;
        for pose in std::iter::once(&found.transform).chain(&found.alternatives) {
            let place = moved.then(pose);
            let known = self.known.iter().find(|known| {
                let between = known.place.then(&place.inverse());
                known.suspect == name && misfit(suspect, &between) <= near
            });
            let rates = match known {
                Some(known) => known.rates,
                None => {
                    let same = |known: &&KnownRates| known.suspect == name;
                    let truth = self.known.iter().find(same).map(|known| known.rates);
                    let rates = self.read(suspect, &place, found, truth)?;
                    self.known.push(KnownRates {
                        suspect: name.into(),
                        place,
                        rates,
                    });
                    rates
                }
            };
            if best.is_none_or(|best| rates.least_squares[0] > best.least_squares[0]) {
                best = Some(rates);
            }
        }
        best.context("no pose")
    }

    /// Extraction rates of a suspect in the pose before it was moved: as the verifier reads it in a pose that is nearly right, and as
    /// detectors read it in the true one, if these rates are not `known`.
    fn read(
        &self,
        suspect: &TriMesh,
        place: &Similarity,
        found: &Alignment,
        known: Option<BitRates>,
    ) -> Result<BitRates> {
        let job = &Job::default();
        let suspect = PreparedMesh::from(suspect);
        let bits = self.signed.certificate().bits();
        let rate = |soft: &SoftBits| extraction_rate(&bits, &soft.hard());
        let seen = self.reader.suspect(&suspect, found);
        let read = self.methods().map(|method| match found.matched_by {
            // The verifier fits corresponding vertices anew, from no first guess.
            MatchedBy::Connectivity => self.reader.find(&suspect, job)?.read(&method, &bits, job),
            _ => seen.read(&method, place, job),
        });
        let [joint, paper] = read.map(|reading| reading.map(|reading| rate(&reading.soft)));
        let [true_joint, true_paper] = match known {
            Some(rates) => [rates.least_squares[1], rates.paper[1]],
            None => {
                let registered = seen.sample(&Similarity::IDENTITY, job)?;
                let paper = CoefficientDetector::new(self.signed.layout());
                [
                    rate(&self.joint.detect(&registered, job)?),
                    rate(&paper.detect(&registered, job)?),
                ]
            }
        };
        Ok(BitRates {
            least_squares: [joint?, true_joint],
            paper: [paper?, true_paper],
        })
    }

    /// The joint estimate, and the paper's rule in the pose that it betters.
    fn methods(&self) -> [ReadingMethod; 2] {
        let joint = ReadingMethod::joint(Arc::clone(&self.joint));
        [joint.clone(), joint.with_papers_rule()]
    }
}
