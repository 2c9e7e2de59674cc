//! From an attacked mesh to bits: the same way for every algorithm, which sees neither the signature nor the true pose.

use std::time::Instant;

use anyhow::Result;
use baselines::{Prepared, Reading};
use mesh::{Similarity, TriMesh};
use registration::{AlignOptions, Basis, Correspondence, align};
use sigmark::{Registered, Sampler, Work};

/// A suspect as it was found to lie on the reference.
pub(crate) struct Found {
    pub(crate) transform: Similarity,
    pub(crate) aligned: bool,
    pub(crate) basis: Basis,
    pub(crate) overlap: f64,
    survivors: Option<Correspondence>,
    pub(crate) seconds: f64,
}

/// Brings the suspect onto the reference (section 4.4.1).
pub(crate) fn find(reference: &TriMesh, suspect: &TriMesh) -> Result<Found> {
    let begun = Instant::now();
    let found = align(reference, suspect, &AlignOptions::default())?;
    Ok(Found {
        transform: found.transform,
        aligned: found.aligned,
        basis: found.basis,
        overlap: found.overlap,
        survivors: found.correspondence,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// What the detectors read, and in how many seconds.
pub(crate) struct Read {
    pub(crate) readings: Vec<Reading>,
    /// The share of the reference's vertices that were not seen.
    pub(crate) missing: f64,
    pub(crate) seconds: f64,
}

/// Samples the suspect at the reference's vertices under a transform, and reads it. Vertices that survived stand for themselves;
/// elsewhere the surface is sampled along normals.
pub(crate) fn read(
    prepared: &dyn Prepared,
    alpha: f64,
    reference: &TriMesh,
    suspect: &TriMesh,
    found: &Found,
    transform: &Similarity,
) -> Result<Read> {
    let begun = Instant::now();
    let registered = registered(reference, suspect, found, transform)?;
    let readings = prepared.extract(&registered, alpha, Work::default())?;
    Ok(Read {
        readings,
        missing: registered.missing(),
        seconds: begun.elapsed().as_secs_f64(),
    })
}

fn registered(
    reference: &TriMesh,
    suspect: &TriMesh,
    found: &Found,
    transform: &Similarity,
) -> Result<Registered> {
    if let (Basis::Connectivity, Some(map)) = (found.basis, &found.survivors) {
        let seen = map.carry(suspect);
        let placed = seen.into_iter().map(|seen| seen.map(|p| transform.apply(p)));
        return Ok(Registered::by_vertices(placed.collect()));
    }
    let sampler = Sampler::new(suspect);
    let sampler = match &found.survivors {
        Some(map) => sampler.survivors(map),
        None => sampler,
    };
    Ok(sampler.sample(reference, transform, Work::default())?)
}
