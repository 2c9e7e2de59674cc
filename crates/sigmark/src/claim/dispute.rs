use std::sync::Arc;

use job::Job;
use registration::PreparedMesh;

use super::{SigmarkError, Verdict, Verifier};

/// Which of two claims came first, by what stands in the originals.
///
/// Who takes a model that was published, and claims it, has for an "original" something that was made from it: so the mark of the one who
/// published it is in there, while his own mark can't be in an original that he never had in his hands. Marks count that are
/// [evidence](Verdict::is_evidence) against a stranger; a mark can be removed from an "original" by spoiling it, but none can be brought
/// into another's.
///
/// A claim whose mark can't be read has proved nothing, and takes nothing from the other: else who is about to come second would spoil his own certificate.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Dispute {
    /// The answer.
    pub outcome: Precedence,
    /// How the first claim's mark is read in the second's original.
    pub first_in_second: Read,
    /// How the second claim's mark is read in the first's original.
    pub second_in_first: Read,
    /// How the first's and the second's mark are read in the suspect, if there is one.
    pub in_suspect: Option<[Read; 2]>,
}

/// How a claim's mark is read in a mesh, or why it can't be.
pub type Read = Result<Verdict, Arc<SigmarkError>>;

fn is_evidence(read: &Read) -> bool {
    read.as_ref().is_ok_and(Verdict::is_evidence)
}

/// Which of two claims came first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Precedence {
    /// The first claim's mark is in the second's original, and not the other way round.
    First,
    /// The second claim's mark is in the first's original, and not the other way round.
    Second,
    /// The originals don't say.
    Undecided(Tie),
}

/// Why the originals don't say which claim came first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tie {
    /// Each bears the other's mark: both are copies of something that was signed before.
    Both,
    /// The same shape, and neither bears the other's mark.
    Neither,
    /// Two shapes that don't lie on each other.
    Unrelated,
    /// A claim's mark can't be read, and the other's is not in its original.
    Unread,
}

impl Precedence {
    /// The name in JSON reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "first",
            Self::Second => "second",
            Self::Undecided(_) => "undecided",
        }
    }

    fn of(first_in_second: &Read, second_in_first: &Read) -> Self {
        match (is_evidence(first_in_second), is_evidence(second_in_first)) {
            (true, false) => Self::First,
            (false, true) => Self::Second,
            (true, true) => Self::Undecided(Tie::Both),
            (false, false) => Self::Undecided(match (first_in_second, second_in_first) {
                (Ok(first), Ok(second)) if first.mismatch.is_some() && second.mismatch.is_some() => {
                    Tie::Unrelated
                }
                (Ok(_), Ok(_)) => Tie::Neither,
                _ => Tie::Unread,
            }),
        }
    }
}

impl Dispute {
    /// Reads the mark of each of two claims in the other's original, and both in a suspect.
    ///
    /// # Errors
    /// [`SigmarkError::Job`]; what else goes wrong is part of the answer.
    pub fn between(
        first: &Verifier,
        second: &Verifier,
        suspect: Option<&PreparedMesh>,
        job: &Job,
    ) -> Result<Self, SigmarkError> {
        let first_in_second = read(first, second.original(), job)?;
        let second_in_first = read(second, first.original(), job)?;
        let in_suspect = match suspect {
            None => None,
            Some(suspect) => Some([read(first, suspect, job)?, read(second, suspect, job)?]),
        };
        Ok(Self {
            outcome: Precedence::of(&first_in_second, &second_in_first),
            first_in_second,
            second_in_first,
            in_suspect,
        })
    }

    /// Whether the first's and the second's mark stand in the suspect, as evidence; none without a suspect.
    pub fn suspect_bears(&self) -> Option<[bool; 2]> {
        Some(self.in_suspect.as_ref()?.each_ref().map(is_evidence))
    }
}

/// Judges by a claim; fails where nothing could be judged by any.
fn read(claim: &Verifier, suspect: impl Into<PreparedMesh>, job: &Job) -> Result<Read, SigmarkError> {
    match claim.verify(suspect, job) {
        Err(error @ SigmarkError::Job(_)) => Err(error),
        verdict => Ok(verdict.map_err(Arc::new)),
    }
}
