//! From an attacked mesh to bits: the same way for every algorithm, which sees neither the signature nor the true pose.

use std::time::Instant;

use anyhow::Result;
use baselines::{DetectorId, Prepared};
use job::Job;
use mesh::{Similarity, TriMesh};
use registration::{Alignment, PreparedMesh};
use sigmark::mark::{Reader, SoftBits, Suspect};

/// What suspects are brought onto.
pub(crate) struct Finder {
    reader: Reader,
    /// What it took to make it.
    pub(crate) seconds: f64,
}

/// A suspect that was brought onto the reference, ready to be read in any pose.
pub(crate) struct Found {
    pub(crate) alignment: Alignment,
    suspect: Suspect,
    pub(crate) seconds: f64,
}

/// What the detectors read, and in how many seconds.
pub(crate) struct Read {
    pub(crate) readings: Vec<(DetectorId, SoftBits)>,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    pub(crate) seconds: f64,
}

impl Finder {
    pub(crate) fn new(reference: &TriMesh) -> Result<Self> {
        let begun = Instant::now();
        Ok(Self {
            reader: Reader::new(reference)?,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// Brings the suspect onto the reference (section 4.4.1).
    pub(crate) fn find(&self, suspect: &TriMesh) -> Result<Found> {
        let begun = Instant::now();
        let suspect = PreparedMesh::from(suspect);
        let alignment = self.reader.align(&suspect, &Job::default())?;
        Ok(Found {
            suspect: self.reader.suspect(&suspect, &alignment),
            alignment,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }
}

impl Found {
    /// Samples the suspect at the reference's vertices under a transform, and reads it with each detector of the algorithm. As in the
    /// paper, the pose is not bettered by what is read.
    pub(crate) fn read(&self, prepared: &dyn Prepared, alpha: f64, transform: &Similarity) -> Result<Read> {
        let begun = Instant::now();
        let registered = self.suspect.sample(transform, &Job::default())?;
        let readings = prepared.extract(&registered, alpha, &Job::default())?;
        Ok(Read {
            readings,
            missing: registered.missing(),
            seconds: begun.elapsed().as_secs_f64(),
        })
    }
}
