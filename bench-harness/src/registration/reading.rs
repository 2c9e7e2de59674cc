//! What is read of a suspect in the pose that was found, and in the true one.

use anyhow::{Context, Result};
use job::Job;
use mesh::{Similarity, TriMesh};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use registration::{Alignment, MatchedBy};
use serde::{Deserialize, Serialize};
use sigmark::{
    Curve, Embedder, Signed, SigningKey, Verifier,
    mark::{
        CoefficientDetector, Detector, LeastSquaresDetector, Registered, Sampler, SoftBits, extraction_rate,
    },
};

use super::suspects::misfit;

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
        let known = Vec::new();
        Ok(Self { signed, known })
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
                    let rates = read(&self.signed, suspect, &place, found, truth)?;
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
}

/// Extraction rates of a suspect in the pose before it was moved: as the verifier reads it under a transform that is nearly right,
/// and under none, if these are not `known`. The transform is bettered for the paper's rule, as the verifier does it.
fn read(
    signed: &Signed,
    suspect: &TriMesh,
    place: &Similarity,
    found: &Alignment,
    known: Option<BitRates>,
) -> Result<BitRates> {
    let (original, job) = (signed.original(), &Job::default());
    let records = &signed.certificate().mark().patches;
    let alphas: Vec<f64> = records.iter().map(|patch| patch.alpha).collect();
    let rate = |bits: SoftBits| extraction_rate(&signed.signature().bits(), &bits.hard());
    let both = |registered: &Registered| {
        let by = |detector: &dyn Detector| detector.detect(original, &alphas, registered, job).map(rate);
        anyhow::Ok([by(&LeastSquaresDetector)?, by(&CoefficientDetector)?])
    };
    let (read, truth) =
        if let (MatchedBy::Connectivity, Some(map)) = (found.matched_by, &found.correspondence) {
            // The verifier fits corresponding vertices anew, from no first guess.
            let certificate = signed.certificate();
            let verifier = Verifier::with_original(original, certificate, certificate.public_key())?;
            let verdict = verifier.verify(suspect, job)?;
            let fitted = verdict.transform.context("the verifier read nothing")?;
            let seen = map.carry(suspect);
            let placed = seen.iter().map(|seen| seen.map(|p| fitted.apply(p)));
            let placed = Registered::by_vertices(placed.collect());
            (both(&placed)?, Registered::by_vertices(seen))
        } else {
            let mut sampler = Sampler::new(original.mesh(), suspect);
            if let Some(survivors) = &found.correspondence {
                sampler = sampler.survivors(survivors);
            }
            let (_, bits, _) = sampler.read(original, &alphas, place, job)?;
            let better = sampler.refine(original, &alphas, place, job)?;
            let paper = CoefficientDetector.detect(original, &alphas, &sampler.sample(&better, job)?, job)?;
            (
                [rate(bits), rate(paper)],
                sampler.sample(&Similarity::IDENTITY, job)?,
            )
        };
    let truth = match known {
        Some(rates) => [rates.least_squares[1], rates.paper[1]],
        None => both(&truth)?,
    };
    Ok(BitRates {
        least_squares: [read[0], truth[0]],
        paper: [read[1], truth[1]],
    })
}
