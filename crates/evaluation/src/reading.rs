//! From an attacked mesh to bits: the same way for every algorithm, which sees neither the signature nor the true pose.

use std::time::Instant;

use anyhow::Result;
use baselines::{Prepared, Reading};
use job::Job;
use mesh::{Similarity, TriMesh};
use registration::{AlignOptions, Aligner, Correspondence, MatchedBy};
use sigmark::mark::{Registered, Sampler};

/// A suspect as it was found to lie on the reference.
pub(crate) struct Found {
    pub(crate) transform: Similarity,
    pub(crate) aligned: bool,
    pub(crate) basis: MatchedBy,
    pub(crate) overlap: f64,
    survivors: Option<Correspondence>,
    pub(crate) seconds: f64,
}

/// What suspects are brought onto, with what does not depend on them.
pub(crate) struct Finder<'a> {
    pub(crate) reference: &'a TriMesh,
    aligner: Aligner,
    /// What it took to make it.
    pub(crate) seconds: f64,
}

impl<'a> Finder<'a> {
    pub(crate) fn new(reference: &'a TriMesh) -> Result<Self> {
        let begun = Instant::now();
        Ok(Self {
            reference,
            aligner: Aligner::new(reference, &AlignOptions::default())?,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// Brings the suspect onto the reference (section 4.4.1).
    pub(crate) fn find(&self, suspect: &TriMesh) -> Result<Found> {
        let begun = Instant::now();
        let found = self.aligner.align(suspect, &Job::default())?;
        Ok(Found {
            transform: found.transform,
            aligned: found.aligned,
            basis: found.matched_by,
            overlap: found.overlap,
            survivors: found.correspondence,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }
}

/// What the detectors read, and in how many seconds.
pub(crate) struct Read {
    pub(crate) readings: Vec<Reading>,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    pub(crate) seconds: f64,
}

/// A suspect that was found, ready to be read in any pose.
pub(crate) struct Reader<'a> {
    seen: Seen<'a>,
    /// What it took to make it.
    seconds: f64,
}

/// What of a suspect is looked at.
enum Seen<'a> {
    /// Where each of the reference's vertices went: all survived.
    Vertices(Vec<Option<[f64; 3]>>),
    Surface(Box<Sampler<'a>>),
}

impl<'a> Reader<'a> {
    pub(crate) fn new(reference: &'a TriMesh, suspect: &'a TriMesh, found: &'a Found) -> Self {
        let begun = Instant::now();
        let seen = match (found.basis, &found.survivors) {
            (MatchedBy::Connectivity, Some(map)) => Seen::Vertices(map.carry(suspect)),
            (_, Some(map)) => Seen::Surface(Box::new(Sampler::new(reference, suspect).survivors(map))),
            (_, None) => Seen::Surface(Box::new(Sampler::new(reference, suspect))),
        };
        Self {
            seen,
            seconds: begun.elapsed().as_secs_f64(),
        }
    }

    /// Samples the suspect at the reference's vertices under a transform, and reads it. Vertices that survived stand for themselves;
    /// elsewhere the surface is sampled along normals.
    pub(crate) fn read(&self, prepared: &dyn Prepared, alpha: f64, transform: &Similarity) -> Result<Read> {
        let begun = Instant::now();
        let registered = match &self.seen {
            Seen::Surface(sampler) => sampler.sample(transform, &Job::default())?,
            Seen::Vertices(places) => {
                let placed = places.iter().map(|place| place.map(|p| transform.apply(p)));
                Registered::by_vertices(placed.collect())
            }
        };
        let readings = prepared.extract(&registered, alpha, &Job::default())?;
        Ok(Read {
            readings,
            missing: registered.missing(),
            seconds: self.seconds + begun.elapsed().as_secs_f64(),
        })
    }
}
