//! From an attacked mesh to bits: the same way for every algorithm of `baselines`, which sees neither the signature nor the true pose.
//!
//! The paper's rule reads in the one pose that the surfaces agree on best, as the paper prints it. An algorithm's other methods read as
//! `sigmark verify` does, by the same code: in all the poses that there are, which they better.

use std::time::Instant;

use anyhow::Result;
use baselines::{DetectorId, Prepared};
use job::Job;
use mesh::{Similarity, TriMesh};
use registration::{Alignment, PreparedMesh};
use sigmark::mark::{self, Reader, SoftBits, Suspect};

/// What suspects are brought onto.
pub(crate) struct Finder {
    reader: Reader,
    /// What it took to make it.
    pub(crate) seconds: f64,
}

/// A suspect that was brought onto the reference.
pub(crate) struct Found {
    /// For the paper's rule.
    pub(crate) alignment: Alignment,
    /// For the other methods.
    poses: mark::Found,
    /// In any pose.
    pub(crate) suspect: Suspect,
    pub(crate) seconds: f64,
}

/// What was read, and in how many seconds.
pub(crate) struct Read {
    /// The paper's rule first.
    pub(crate) readings: Vec<Reading>,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    pub(crate) seconds: f64,
}

/// What one way to read gave.
pub(crate) struct Reading {
    pub(crate) detector: DetectorId,
    pub(crate) soft: SoftBits,
    /// Of how many readings they could have been chosen.
    pub(crate) tries: usize,
}

impl Finder {
    pub(crate) fn new(reference: impl Into<PreparedMesh>) -> Result<Self> {
        let begun = Instant::now();
        Ok(Self {
            reader: Reader::new(reference)?,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// Brings the suspect onto the reference (section 4.4.1).
    pub(crate) fn find(&self, suspect: &TriMesh) -> Result<Found> {
        let (begun, job) = (Instant::now(), Job::default());
        let poses = self.reader.find(suspect, &job)?;
        let suspect = poses.suspect();
        // Found by its vertices, it may have many poses, none of which the surfaces have judged.
        let alignment = match poses.alignment() {
            Some(alignment) => alignment.clone(),
            None => self.reader.align(suspect, &job)?,
        };
        Ok(Found {
            suspect: self.reader.suspect(suspect, &alignment),
            poses,
            alignment,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// A suspect of which no vertex is taken to be found again.
    pub(crate) fn surface(&self, found: &Found) -> Suspect {
        self.reader.surface(found.poses.suspect().clone())
    }
}

impl Found {
    /// Reads the suspect with the algorithm's rule and by each of its methods. Of several poses, a method takes the one in which it agrees
    /// best with the bits that are `expected`.
    pub(crate) fn read(&self, prepared: &dyn Prepared, alpha: f64, expected: &[bool]) -> Result<Read> {
        let (begun, job) = (Instant::now(), Job::default());
        let registered = self.suspect.sample_positions(&self.alignment.transform, &job)?;
        let mut readings = vec![Reading {
            detector: DetectorId::PAPER,
            soft: prepared.extract(&registered, alpha, &job)?,
            tries: 1,
        }];
        for (detector, method) in prepared.methods(alpha)? {
            let reading = self.poses.read(&method, expected, &job)?;
            readings.push(Reading {
                detector,
                soft: reading.soft,
                tries: reading.tries,
            });
        }
        Ok(Read {
            readings,
            missing: registered.missing(),
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// The bits of the algorithm's rule in a known pose.
    pub(crate) fn read_in(
        &self,
        pose: &Similarity,
        prepared: &dyn Prepared,
        alpha: f64,
    ) -> Result<Vec<bool>> {
        let job = Job::default();
        let registered = self.suspect.sample_positions(pose, &job)?;
        Ok(prepared.extract(&registered, alpha, &job)?.hard())
    }
}
