//! All descriptors in memory, and the exact scan.

use std::collections::HashMap;

use job::{Job, JobError};

use crate::{
    Library, LibraryError, OriginalId, Query,
    descriptor::{Cuttable, LOCAL_LENGTH, PART_LENGTH, PARTS, WHOLE_LENGTH, difference},
};

/// Planes are fitted to the parts of so many originals, the nearest by what was described beforehand.
const FITTED: usize = 64;

/// Originals that one thread compares at a time.
const AT_A_TIME: usize = 256;

/// By what an original is near.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum By {
    /// The whole shape.
    Whole,
    /// What a plane leaves of it.
    Part,
    /// Small shapes, wherever they lie.
    Local,
}

impl By {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Whole, Self::Part, Self::Local];

    /// The name in reports for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Part => "part",
            Self::Local => "local",
        }
    }

    /// The distance at which nothing is said any more.
    fn farthest(self) -> f64 {
        match self {
            Self::Whole => 24.0,
            Self::Part => 24.0,
            Self::Local => 24.0,
        }
    }
}

/// An original that a suspect may have been made of.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Candidate {
    /// Its number.
    pub original: OriginalId,
    /// What speaks most for it.
    pub by: By,
    /// How near it is by that, from 1, the same, to 0: no attack leaves an original so far away.
    pub score: f64,
}

/// The descriptors of all originals of a library, at the time when it was loaded.
#[derive(Debug, Default)]
pub struct Index {
    ids: Vec<OriginalId>,
    whole: Vec<u8>,
    parts: Vec<u8>,
    local: Vec<u8>,
}

/// How far the nearest part of an original is, and which it is.
#[derive(Clone, Copy)]
struct NearestPart {
    difference: u32,
    part: usize,
}

impl Index {
    /// Reads all descriptors of a library.
    ///
    /// # Errors
    /// When it can't be read, or a descriptor has another length.
    pub fn load(library: &Library) -> Result<Self, LibraryError> {
        let mut index = Self::default();
        let count = library.count()?;
        index.ids.reserve(count);
        index.parts.reserve(count * PARTS * PART_LENGTH);
        library.each_descriptor(|id, whole, parts, local| {
            index.ids.push(id);
            index.whole.extend_from_slice(whole);
            index.parts.extend_from_slice(parts);
            index.local.extend_from_slice(local);
        })?;
        Ok(index)
    }

    /// How many originals.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Bytes of all descriptors.
    pub fn bytes(&self) -> usize {
        self.whole.len() + self.parts.len() + self.local.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The originals that a suspect resembles most, `most` of them, the nearest first: in turn those nearest by the whole, by a part, and by small shapes.
    ///
    /// # Errors
    /// When samples can't be read from the library, or the job is cancelled.
    pub fn search(
        &self,
        library: &Library,
        query: &Query,
        most: usize,
        job: &Job,
    ) -> Result<Vec<Candidate>, LibraryError> {
        let lists = self.lists(library, query, most, job)?;
        let mut best: HashMap<OriginalId, Candidate> = HashMap::new();
        for (by, list) in By::ALL.into_iter().zip(&lists) {
            for &(original, distance) in list {
                let score = (1.0 - distance / by.farthest()).max(0.0);
                let found = Candidate { original, by, score };
                let known = best.entry(original).or_insert(found);
                if score > known.score {
                    *known = found;
                }
            }
        }
        let turns = lists.iter().map(Vec::len).max().unwrap_or(0);
        let in_turn = (0..turns).flat_map(|i| lists.iter().filter_map(move |list| list.get(i)));
        let mut chosen = Vec::new();
        for (original, _) in in_turn {
            if chosen.len() < most
                && let Some(candidate) = best.remove(original)
            {
                chosen.push(candidate);
            }
        }
        chosen.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.original.cmp(&b.original)));
        Ok(chosen)
    }

    /// For each of [`By::ALL`] the nearest originals with their distances, the nearest first.
    ///
    /// # Errors
    /// As [`search`](Self::search).
    pub fn lists(
        &self,
        library: &Library,
        query: &Query,
        most: usize,
        job: &Job,
    ) -> Result<[Vec<(OriginalId, f64)>; 3], LibraryError> {
        let whole = self.distances::<WHOLE_LENGTH>(&self.whole, &query.whole, job)?;
        let local = self.distances::<LOCAL_LENGTH>(&self.local, &query.local, job)?;
        let of = |differences: &[u32], length: usize| -> Vec<(OriginalId, f64)> {
            let nearest = nearest(differences, most).into_iter();
            nearest
                .map(|i| (self.ids[i], f64::from(differences[i]) / length as f64))
                .collect()
        };
        Ok([
            of(&whole, WHOLE_LENGTH),
            self.by_part(library, query, most, job)?,
            of(&local, LOCAL_LENGTH),
        ])
    }

    /// The nearest by a part: first by those that were described, then with the plane fitted.
    fn by_part(
        &self,
        library: &Library,
        query: &Query,
        most: usize,
        job: &Job,
    ) -> Result<Vec<(OriginalId, f64)>, LibraryError> {
        let parts: Vec<NearestPart> = self.in_chunks(job, |i| {
            let own = &self.parts[i * PARTS * PART_LENGTH..(i + 1) * PARTS * PART_LENGTH];
            nearest_part(own, &query.part)
        })?;
        let differences: Vec<u32> = parts.iter().map(|part| part.difference).collect();
        let chosen = nearest(&differences, FITTED.max(most));
        let samples = chosen.iter().map(|&i| library.samples(self.ids[i]));
        let samples: Vec<Vec<u8>> = samples.collect::<Result<_, _>>()?;
        let fitted = job.map(chosen.len(), 1, |k| {
            let cuttable = Cuttable::of(&samples[k])?;
            Ok((self.ids[chosen[k]], cuttable.fit(&query.fitted, parts[chosen[k]].part)))
        })?;
        let mut fitted = fitted.into_iter().collect::<Result<Vec<_>, LibraryError>>()?;
        fitted.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        fitted.truncate(most);
        Ok(fitted)
    }

    fn distances<const N: usize>(&self, all: &[u8], wanted: &[u8], job: &Job) -> Result<Vec<u32>, JobError> {
        let (all, _) = all.as_chunks::<N>();
        let (wanted, _) = wanted.as_chunks::<N>();
        let Some(wanted) = wanted.first() else {
            return Ok(Vec::new());
        };
        self.in_chunks(job, |i| difference(&all[i], wanted))
    }

    /// Something of each original.
    fn in_chunks<T: Send>(&self, job: &Job, of: impl Fn(usize) -> T + Sync + Send) -> Result<Vec<T>, JobError> {
        let count = self.ids.len();
        let chunks = job.map(count.div_ceil(AT_A_TIME), 1, |chunk| {
            let first = chunk * AT_A_TIME;
            (first..(first + AT_A_TIME).min(count)).map(&of).collect::<Vec<T>>()
        })?;
        job.go_on()?;
        Ok(chunks.into_iter().flatten().collect())
    }
}

fn nearest_part(parts: &[u8], wanted: &[u8]) -> NearestPart {
    let mut nearest = NearestPart {
        difference: u32::MAX,
        part: 0,
    };
    let (parts, _) = parts.as_chunks::<PART_LENGTH>();
    let (wanted, _) = wanted.as_chunks::<PART_LENGTH>();
    let Some(wanted) = wanted.first() else {
        return nearest;
    };
    for (i, part) in parts.iter().enumerate() {
        let difference = difference(part, wanted);
        if difference < nearest.difference {
            nearest = NearestPart { difference, part: i };
        }
    }
    nearest
}

/// The places of the least numbers, the least first.
fn nearest(differences: &[u32], most: usize) -> Vec<usize> {
    let mut places: Vec<usize> = (0..differences.len()).collect();
    let by = |&i: &usize| (differences[i], i);
    if most < places.len() {
        places.select_nth_unstable_by_key(most, by);
        places.truncate(most);
    }
    places.sort_unstable_by_key(by);
    places
}
