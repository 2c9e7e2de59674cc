//! All descriptors in memory, and the exact scan.

mod laying;
mod tessellation;
mod votes;

use std::{
    cmp::Reverse,
    collections::{HashMap, HashSet},
};

use job::{Job, JobError};

use crate::{
    Library, LibraryError, OriginalId, Query,
    descriptor::{LOCAL_LENGTH, Summary, Surface, WHOLE_LENGTH, difference},
};
use laying::Guess;
use tessellation::Tessellations;
use votes::Votes;

/// Originals, with sizes, for which it is guessed how the suspect lies: those for which its places speak most.
const GUESSED: usize = 160;
/// Of these, those on which it is laid: where most samples lie near.
const LAID: usize = 40;

/// Originals that one thread compares at a time.
const AT_A_TIME: usize = 256;

/// By what an original is near.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum By {
    /// The whole shape.
    Whole,
    /// Its surface, on which the suspect lies.
    Surface,
    /// Small shapes, wherever they lie.
    Local,
    /// Vertices that the files have in common.
    Tessellation,
}

impl By {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Whole, Self::Surface, Self::Local, Self::Tessellation];

    /// The name in reports for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Surface => "surface",
            Self::Local => "local",
            Self::Tessellation => "tessellation",
        }
    }

    /// The distance at which nothing is said any more.
    pub fn farthest(self) -> f64 {
        match self {
            // What was attacked as in Table 4 stays below 4, what was posed below 6.
            Self::Whole => 8.0,
            Self::Local => 10.0,
            // A quarter of the suspect lies on the original.
            Self::Surface => 0.75,
            Self::Tessellation => 0.9,
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

/// What is known of all originals of a library, at the time when it was loaded.
#[derive(Debug, Default)]
pub struct Index {
    ids: Vec<OriginalId>,
    summaries: Vec<Summary>,
    votes: Votes,
    tessellations: Tessellations,
}

impl Index {
    /// Reads all descriptors of a library.
    ///
    /// # Errors
    /// When it can't be read, or a descriptor has another length.
    pub fn load(library: &Library) -> Result<Self, LibraryError> {
        let (mut index, mut words, mut stars) = (Self::default(), Vec::new(), Vec::new());
        library.each_summary(|id, mut summary| {
            index.ids.push(id);
            words.push(std::mem::take(&mut summary.words));
            stars.push(std::mem::take(&mut summary.stars));
            index.summaries.push(summary);
        })?;
        index.votes = Votes::of(&words);
        index.tessellations = Tessellations::of(&stars);
        Ok(index)
    }

    /// How many originals.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Bytes of all descriptors.
    pub fn bytes(&self) -> usize {
        self.ids.len() * (size_of::<OriginalId>() + size_of::<Summary>())
            + self.votes.bytes()
            + self.tessellations.bytes()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The originals that a suspect resembles most, `most` of them, the nearest first: in turn those nearest by the whole, by the surface, and by small shapes.
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
    pub fn candidates(lists: &[Vec<(OriginalId, f64)>; 4], most: usize) -> Vec<Candidate> {
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
    ) -> Result<[Vec<(OriginalId, f64)>; 4], LibraryError> {
        let whole = self.of_each(job, |i| query.distance_from_whole(&self.summaries[i]))?;
        let local = self.of_each(job, |i| difference(&self.summaries[i].local, &query.local))?;
        let of = |differences: &[u32], length: usize| -> Vec<(OriginalId, f64)> {
            let nearest = nearest(differences, most).into_iter();
            nearest
                .map(|i| (self.ids[i], f64::from(differences[i]) / length as f64))
                .collect()
        };
        Ok([
            of(&whole, WHOLE_LENGTH),
            self.by_surface(library, query, most, job)?,
            of(&local, LOCAL_LENGTH),
            self.by_tessellation(query, most),
        ])
    }

    /// Those that have vertices in common with the suspect.
    fn by_tessellation(&self, query: &Query, most: usize) -> Vec<(OriginalId, f64)> {
        let shared = self.tessellations.shared(&query.stars);
        let mut with: Vec<usize> = (0..shared.len()).filter(|&i| shared[i].alike > 0.0).collect();
        with.sort_by(|&a, &b| shared[b].alike.total_cmp(&shared[a].alike).then(a.cmp(&b)));
        with.truncate(most);
        with.into_iter()
            .map(|i| (self.ids[i], 1.0 - shared[i].score()))
            .collect()
    }

    /// Those on which most of the suspect lies.
    fn by_surface(
        &self,
        library: &Library,
        query: &Query,
        most: usize,
        job: &Job,
    ) -> Result<Vec<(OriginalId, f64)>, LibraryError> {
        let votes = self.votes.most(&query.sizes, GUESSED.max(most), job)?;
        let surfaces = votes.iter().map(|vote| library.surface(self.ids[vote.original]));
        let surfaces: Vec<Vec<u8>> = surfaces.collect::<Result<_, _>>()?;
        let surfaces = surfaces.iter().map(|bytes| Surface::of(bytes));
        let surfaces: Vec<Surface> = surfaces.collect::<Result<_, _>>()?;
        let size = |vote: usize| &query.sizes[votes[vote].size];
        let guesses = job.map(votes.len(), 1, |i| Guess::of(size(i), &surfaces[i]))?;
        job.go_on()?;
        let mut order: Vec<usize> = (0..votes.len()).collect();
        order.sort_by_key(|&i| (Reverse(guesses[i].near), i));
        order.truncate(LAID.max(most));
        let mut laid = job.map(order.len(), 1, |k| {
            let i = order[k];
            let share = guesses[i].share(size(i), &surfaces[i]);
            (self.ids[votes[i].original], 1.0 - share)
        })?;
        laid.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        // An original may have been tried in two sizes.
        let mut seen = HashSet::new();
        laid.retain(|(original, _)| seen.insert(*original));
        laid.truncate(most);
        Ok(laid)
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
