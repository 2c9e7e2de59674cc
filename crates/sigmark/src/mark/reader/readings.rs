use std::sync::OnceLock;

use job::Job;
use mesh::Similarity;
use registration::{Correspondence, Placement};

use super::{Found, Reading, ReadingMethod, Suspect, by_vertices, suspect::SeenBy};
use crate::mark::{MarkError, MarkStage, SoftBits, correlation};

/// All that can be read of a suspect, whatever the bits are that are looked for: one suspect can be asked for many.
///
/// Nothing in here depends on bits but the choice of the [best](Self::best), and that counts all that it could have chosen.
pub struct Readings<'a> {
    found: &'a Found,
    method: &'a ReadingMethod,
    by: ReadBy<'a>,
}

enum ReadBy<'a> {
    /// By each of the maps of the vertices, and once more by the joint estimate when it is asked for.
    Vertices {
        maps: &'a [Correspondence],
        first: Vec<(Similarity, SoftBits)>,
        again: Vec<OnceLock<Reading>>,
    },
    /// In each pose.
    Surface(Vec<Reading>),
}

impl<'a> Readings<'a> {
    pub(super) fn of(found: &'a Found, method: &'a ReadingMethod, job: &Job) -> Result<Self, MarkError> {
        method.layout().original().keep_small_bases(job)?;
        let by = match &found.placement {
            Placement::ByVertices(maps) => {
                job.begin(MarkStage::Detection)?;
                let read = |map| by_vertices::first_look(&found.suspect, map, method, job);
                ReadBy::Vertices {
                    first: maps.iter().map(read).collect::<Result<_, _>>()?,
                    again: maps.iter().map(|_| OnceLock::new()).collect(),
                    maps,
                }
            }
            Placement::BySurface(alignment) => {
                let seen_by = SeenBy::Surface(alignment.correspondence.clone());
                let suspect = Suspect::new(found.reference.clone(), found.suspect.clone(), seen_by);
                let poses = std::iter::once(&alignment.transform).chain(&alignment.alternatives);
                let readings = poses.map(|pose| suspect.read(method, pose, job));
                ReadBy::Surface(readings.collect::<Result<_, _>>()?)
            }
        };
        Ok(Self { found, method, by })
    }

    /// The reading that agrees best with the bits that are looked for; the first of equals.
    ///
    /// By vertices, the best of the first looks, which are cheap, is taken if it reads all bits; if not, the joint estimate reads once
    /// more in its pose.
    ///
    /// # Errors
    /// As [`Found::read`].
    pub fn best(&self, expected: &[bool], job: &Job) -> Result<Reading, MarkError> {
        let agreement = |soft: &SoftBits| correlation(expected, &soft.0);
        match &self.by {
            ReadBy::Surface(readings) => {
                let best = first_of_best(readings.iter().map(|reading| agreement(&reading.soft)));
                Ok(Reading {
                    tries: readings.len(),
                    ..readings.get(best).ok_or(MarkError::Alignment)?.clone()
                })
            }
            ReadBy::Vertices { maps, first, again } => {
                let best = first_of_best(first.iter().map(|(_, soft)| agreement(soft)));
                let (pose, soft) = first.get(best).ok_or(MarkError::Alignment)?;
                let Found {
                    reference, suspect, ..
                } = self.found;
                let look = || by_vertices::reading(reference, suspect, &maps[best], pose, soft);
                let tries = 2 * maps.len();
                if soft.hard() == expected {
                    return Ok(Reading { tries, ..look() });
                }
                let again = match again[best].get() {
                    Some(reading) => reading,
                    None => {
                        let reading = by_vertices::read_again(reference, &look(), self.method, job)?;
                        again[best].get_or_init(|| reading)
                    }
                };
                let better = agreement(&again.soft) > agreement(soft);
                // Any map might have been the one that is read twice.
                Ok(Reading {
                    tries,
                    ..if better { again.clone() } else { look() }
                })
            }
        }
    }
}

/// The index of the largest, the first of equals.
fn first_of_best(agreements: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (i, agreement) in agreements.enumerate() {
        if agreement > best.1 {
            best = (i, agreement);
        }
    }
    best.0
}
