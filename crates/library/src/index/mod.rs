//! All descriptors in memory, and the exact scan.

use std::collections::HashMap;

use job::{Job, JobError};

use crate::{
    Library, LibraryError, OriginalId, Query,
    descriptor::{Cut, Cuttable, LOCAL_LENGTH, PART_LENGTH, PARTS, WHOLE_LENGTH, difference},
};

/// Originals to whose parts planes are fitted: the nearest by what was described beforehand.
const FITTED: usize = 96;
/// Of these, the nearest to which they are fitted once more, with all samples.
const REFITTED: usize = 20;

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
    pub fn farthest(self) -> f64 {
        match self {
            // What was attacked as in Table 4 and simplified to a hundredth stays below 8, what was cropped below 8, what was posed below 13.
            Self::Whole | Self::Local => 16.0,
            Self::Part => 10.0,
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
    whole: Vec<[u8; WHOLE_LENGTH]>,
    local: Vec<[u8; LOCAL_LENGTH]>,
    /// [`PARTS`] of each original.
    parts: Vec<[u8; PART_LENGTH]>,
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
        library.each_descriptor(|id, whole, local, parts| {
            index.ids.push(id);
            index.whole.push(std::array::from_fn(|i| whole[i]));
            index.local.push(std::array::from_fn(|i| local[i]));
            index.parts.extend_from_slice(parts.as_chunks().0);
        })?;
        Ok(index)
    }

    /// How many originals.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Bytes of all descriptors.
    pub fn bytes(&self) -> usize {
        self.ids.len() * (WHOLE_LENGTH + LOCAL_LENGTH + PARTS * PART_LENGTH)
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
        Ok(Self::candidates(&self.lists(library, query, most, job)?, most))
    }

    /// The candidates that [lists](Self::lists) make: in turn from each.
    pub fn candidates(lists: &[Vec<(OriginalId, f64)>; 3], most: usize) -> Vec<Candidate> {
        let mut best: HashMap<OriginalId, Candidate> = HashMap::new();
        for (by, list) in By::ALL.into_iter().zip(lists) {
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
        chosen
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
        let whole = self.of_each(job, |i| difference(&self.whole[i], &query.whole))?;
        let local = self.of_each(job, |i| difference(&self.local[i], &query.local))?;
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
        let nearest_parts: Vec<NearestPart> = self.of_each(job, |i| {
            nearest_part(&self.parts[i * PARTS..(i + 1) * PARTS], &query.part)
        })?;
        let differences: Vec<u32> = nearest_parts.iter().map(|part| part.difference).collect();
        let chosen = nearest(&differences, FITTED.max(most));
        let samples = chosen.iter().map(|&i| library.samples(self.ids[i]));
        let samples: Vec<Vec<u8>> = samples.collect::<Result<_, _>>()?;
        let originals: Vec<Cuttable> = samples
            .iter()
            .map(|bytes| Cuttable::of(bytes))
            .collect::<Result<_, _>>()?;
        let rough = job.map(chosen.len(), 1, |k| {
            originals[k].fit(&query.fitted, nearest_parts[chosen[k]].part)
        })?;
        let mut order: Vec<usize> = (0..chosen.len()).collect();
        order.sort_by(|&a, &b| rough[a].distance.total_cmp(&rough[b].distance).then(a.cmp(&b)));
        order.truncate(REFITTED.max(most));
        let fitted = job.map(order.len(), 1, |i| {
            let k = order[i];
            let cut: Cut = originals[k].refit(&query.fitted, &rough[k]);
            (self.ids[chosen[k]], cut.distance)
        })?;
        let mut fitted = fitted;
        fitted.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        fitted.truncate(most);
        Ok(fitted)
    }

    /// Something of each original.
    fn of_each<T: Send>(&self, job: &Job, of: impl Fn(usize) -> T + Sync + Send) -> Result<Vec<T>, JobError> {
        let count = self.ids.len();
        let chunks = job.map(count.div_ceil(AT_A_TIME), 1, |chunk| {
            let first = chunk * AT_A_TIME;
            (first..(first + AT_A_TIME).min(count))
                .map(&of)
                .collect::<Vec<T>>()
        })?;
        job.go_on()?;
        Ok(chunks.into_iter().flatten().collect())
    }
}

fn nearest_part(parts: &[[u8; PART_LENGTH]], wanted: &[u8; PART_LENGTH]) -> NearestPart {
    let mut nearest = NearestPart {
        difference: u32::MAX,
        part: 0,
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
