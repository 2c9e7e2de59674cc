use job::Job;
use registration::PreparedMesh;

use super::{SigmarkError, Verdict, Verifier};

/// Which of two claims came first, by what stands in the originals.
///
/// Who takes a model that was published, and claims it, has for an "original" something that was made from it: so the mark of the one who
/// published it is in there, while his own mark can't be in an original that he never had in his hands. Marks count that are
/// [evidence](Verdict::is_evidence) against a stranger; a mark can be removed from an "original" by spoiling it, but none can be brought
/// into another's.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Dispute {
    /// The answer.
    pub outcome: Precedence,
    /// How the first claim's mark is read in the second's original.
    pub first_in_second: Verdict,
    /// How the second claim's mark is read in the first's original.
    pub second_in_first: Verdict,
    /// How the first's and the second's mark are read in the suspect, if there is one.
    pub in_suspect: Option<[Verdict; 2]>,
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

    fn of(first_in_second: &Verdict, second_in_first: &Verdict) -> Self {
        let aligned = |verdict: &Verdict| verdict.mismatch.is_none();
        match (first_in_second.is_evidence(), second_in_first.is_evidence()) {
            (true, false) => Self::First,
            (false, true) => Self::Second,
            (true, true) => Self::Undecided(Tie::Both),
            _ if aligned(first_in_second) || aligned(second_in_first) => Self::Undecided(Tie::Neither),
            _ => Self::Undecided(Tie::Unrelated),
        }
    }
}

impl Dispute {
    /// Reads the mark of each of two claims in the other's original, and both in a suspect.
    ///
    /// # Errors
    /// As [`Verifier::verify`].
    pub fn between(
        first: &Verifier,
        second: &Verifier,
        suspect: Option<&PreparedMesh>,
        job: &Job,
    ) -> Result<Self, SigmarkError> {
        let first_in_second = first.verify(second.original().clone(), job)?;
        let second_in_first = second.verify(first.original().clone(), job)?;
        let in_suspect = match suspect {
            None => None,
            Some(suspect) => Some([
                first.verify(suspect.clone(), job)?,
                second.verify(suspect.clone(), job)?,
            ]),
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
        let verdicts = self.in_suspect.as_ref()?;
        Some(verdicts.each_ref().map(Verdict::is_evidence))
    }
}
