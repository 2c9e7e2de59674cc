//! A suspect whose parts went different ways: each is put back by itself, and what comes of it is read as one.

use std::collections::HashMap;

use job::Job;
use mesh::{Similarity, TriMesh};
use registration::{Alignment, Correspondence, MatchedBy, Piece, PiecePlace, Placement, PreparedMesh};

use super::{BroughtBack, Found, Reader, Reading, ReadingMethod, Wanted, near, readings::agreement};
use crate::mark::{MarkError, MarkLayout, MarkStage};

/// Parts of a suspect that are parts of the reference, each in all the places where it may belong.
pub struct FoundParts {
    reference: PreparedMesh,
    suspect: PreparedMesh,
    pieces: Vec<Piece>,
}

/// A part, and where it was put.
type Placed<'a> = (&'a Piece, &'a PiecePlace);

/// What was read of parts that were put back.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ReadParts {
    /// The bits; its transform is that of the largest part.
    pub reading: Reading,
    /// Number of each part of the reference that was found, as [`mesh::components`] numbers them, and what takes the suspect's part there.
    pub parts: Vec<(usize, Similarity)>,
    /// The share of the suspect's surface that those parts are, from 0 to 1.
    pub overlap: f64,
    /// The share of the reference's surface that those parts are, from 0 to 1.
    pub coverage: f64,
}

impl Reader {
    /// Looks for connected parts of a suspect that are parts of the reference, where a layout has patches. What is far from all the rest is passed over, as in [`find`](Self::find).
    ///
    /// # Errors
    /// As [`Aligner::pieces`](registration::Aligner::pieces).
    pub fn find_parts(
        &self,
        suspect: impl Into<PreparedMesh>,
        layout: &MarkLayout,
        job: &Job,
    ) -> Result<FoundParts, MarkError> {
        job.begin(MarkStage::Registration)?;
        let suspect = near(suspect.into());
        let is_marked: Vec<bool> = layout
            .original()
            .patches()
            .labels()
            .iter()
            .map(|&label| label > 0)
            .collect();
        Ok(FoundParts {
            pieces: self.aligner.pieces(&suspect, &is_marked, job)?,
            reference: self.reference().clone(),
            suspect,
        })
    }
}

impl FoundParts {
    /// Whether no part was found.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Puts the parts back and reads them together. Of the places of a part, the one is taken where it alone agrees best with the bits that are
    /// looked for, which counts as so many tries.
    ///
    /// # Errors
    /// As [`Found::read`].
    pub fn read(
        &self,
        method: &ReadingMethod,
        wanted: Wanted<'_>,
        job: &Job,
    ) -> Result<ReadParts, MarkError> {
        let mut chosen: Vec<Placed<'_>> = Vec::new();
        let mut choices = 1_usize;
        for piece in &self.pieces {
            let free = free_places(piece, &chosen);
            let place = match free.as_slice() {
                [] => continue,
                [one] => one,
                several => {
                    choices = choices.saturating_mul(several.len());
                    self.best_place(piece, several, method, wanted, job)?
                }
            };
            chosen.push((piece, place));
        }
        let reading = self.assembled(&chosen)?.read(method, wanted.of(choices), job)?;
        Ok(self.described(reading, &chosen))
    }

    /// Puts the parts back in every way in which they may belong, and reads each whatever the bits are. Of parts that have several places, the largest first, some stay away where there would be more ways than `most`.
    ///
    /// # Errors
    /// As [`Found::read`].
    pub fn read_every_way(
        &self,
        method: &ReadingMethod,
        most: usize,
        job: &Job,
    ) -> Result<Vec<ReadParts>, MarkError> {
        let read = |way: &Vec<Placed<'_>>| -> Result<Vec<ReadParts>, MarkError> {
            let found = self.assembled(way)?;
            let readings = found.readings(method, job)?;
            let readings = readings.of_every_way(job)?;
            Ok(readings
                .into_iter()
                .map(|reading| self.described(reading.clone(), way))
                .collect())
        };
        let read: Result<Vec<_>, MarkError> = self.ways(most).iter().map(read).collect();
        Ok(read?.into_iter().flatten().collect())
    }

    /// The ways in which the parts may belong.
    fn ways(&self, most: usize) -> Vec<Vec<Placed<'_>>> {
        let mut ways: Vec<Vec<Placed<'_>>> = vec![Vec::new()];
        for piece in &self.pieces {
            let mut grown = Vec::new();
            for way in &ways {
                let places = free_places(piece, way);
                if places.is_empty() {
                    grown.push(way.clone());
                }
                let put = |place| way.iter().copied().chain([(piece, place)]).collect();
                grown.extend(places.into_iter().map(put));
            }
            if grown.len() <= most {
                ways = grown;
            }
        }
        ways.retain(|way| !way.is_empty());
        ways
    }

    /// What was read of parts that were put back, with where they were put.
    fn described(&self, mut reading: Reading, chosen: &[Placed<'_>]) -> ReadParts {
        if let Some((_, largest)) = chosen.first() {
            reading.transform = largest.transform;
        }
        let area: f64 = chosen.iter().map(|(piece, _)| piece.area).sum();
        let there: f64 = chosen
            .iter()
            .map(|(piece, place)| piece.area * place.transform.scale.powi(2))
            .sum();
        ReadParts {
            reading,
            parts: chosen
                .iter()
                .map(|(_, place)| (place.part, place.transform))
                .collect(),
            overlap: (area / self.suspect.mesh().area()).min(1.0),
            coverage: (there / self.reference.mesh().area()).min(1.0),
        }
    }

    fn best_place<'a>(
        &self,
        piece: &Piece,
        places: &[&'a PiecePlace],
        method: &ReadingMethod,
        wanted: Wanted<'_>,
        job: &Job,
    ) -> Result<&'a PiecePlace, MarkError> {
        let mut best = (f64::NEG_INFINITY, places[0]);
        for place in places {
            let reading = self.assembled(&[(piece, place)])?.read(method, wanted, job)?;
            let agreement = agreement(&reading, wanted);
            if agreement > best.0 {
                best = (agreement, place);
            }
        }
        Ok(best.1)
    }

    /// The parts where they belong, as a suspect that lies on the reference.
    fn assembled(&self, parts: &[Placed<'_>]) -> Result<Found, MarkError> {
        let suspect = self.suspect.mesh();
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        let mut suspect_of = vec![None; self.reference.mesh().vertex_count()];
        for (piece, place) in parts {
            let mut numbers = HashMap::new();
            let mut number = |v: u32| {
                *numbers.entry(v).or_insert_with(|| {
                    positions.push(place.transform.apply(suspect.positions()[v as usize]));
                    positions.len() as u32 - 1
                })
            };
            triangles.extend(piece.triangles.iter().map(|corners| corners.map(&mut number)));
            for &[v, of_suspect] in &place.pairs {
                suspect_of[v as usize] = Some(number(of_suspect));
            }
        }
        let is_seen = suspect_of.iter().any(Option::is_some);
        let alignment = Alignment {
            transform: Similarity::IDENTITY,
            matched_by: MatchedBy::Parts,
            overlap: 1.0,
            coverage: 1.0,
            residual: 0.0,
            aligned: true,
            correspondence: is_seen.then_some(Correspondence { suspect_of }),
            alternatives: Vec::new(),
            free_directions: 0,
        };
        Ok(Found {
            reference: self.reference.clone(),
            suspect: TriMesh::new(positions, triangles)
                .map_err(|_| MarkError::Alignment)?
                .into(),
            placement: Placement::BySurface(alignment),
            brought_back: BroughtBack::AsItIs,
        })
    }
}

/// The places of a part where none was put before.
fn free_places<'a>(piece: &'a Piece, chosen: &[Placed<'_>]) -> Vec<&'a PiecePlace> {
    let is_free = |place: &&PiecePlace| chosen.iter().all(|(_, other)| other.part != place.part);
    piece.places.iter().filter(is_free).collect()
}
