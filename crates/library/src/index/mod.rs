//! All descriptors in memory, and the exact scan.

mod candidate;
mod laying;
mod tessellation;
mod votes;

use std::{cmp::Reverse, collections::HashSet};

use job::{Job, JobError};

use crate::{
    Library, LibraryError, OriginalId, Query,
    descriptor::{LOCAL_LENGTH, Summary, Surface, WHOLE_LENGTH, difference},
};
pub use candidate::{By, Candidate};
use candidate::{Measures, TENTH};
use laying::Guess;
use tessellation::{Shared, Tessellations};
use votes::Votes;

/// Originals, with sizes, for which it is guessed how the suspect lies: those for which its places speak most.
const GUESSED: usize = 96;
/// The nearest by each of the others, for which it is guessed, too.
const NEAREST: usize = 16;
/// The first by each of what vertices say, for which it is guessed, too.
const SHARING: usize = 8;
/// Where vertices, the whole, or small shapes tell by so much which it is, so many times fewer originals are tried: another may be in the suspect all the same.
const TOLD: f64 = 0.4;
const FEWER: usize = 4;
/// Of all these, those on which it is laid: where most samples lie near.
const LAID: usize = 40;

/// So many of the likeliest are worth an alignment whatever they score: of twisted and cropped models some come to nothing by each measure alone, and are the likeliest all the same.
const ALWAYS: usize = 3;

/// Originals that one thread compares at a time.
const AT_A_TIME: usize = 256;

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

    /// The originals that a suspect resembles most, `most` of them, the likeliest first. What scores, and the first three whatever they score, is [worth an alignment](Candidate::is_worth_a_look).
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
        let mut found = self.scored(library, query, job)?;
        for alone in &query.alone {
            found.extend(self.scored(library, alone, job)?);
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.original.cmp(&b.1.original)));
        let mut seen = HashSet::new();
        found.retain(|(_, candidate)| seen.insert(candidate.original));
        found.truncate(most);
        let mut found: Vec<Candidate> = found.into_iter().map(|(_, candidate)| candidate).collect();
        found
            .iter_mut()
            .take(ALWAYS)
            .for_each(|candidate| candidate.is_worth_a_look = true);
        Ok(found)
    }

    /// The originals that may be meant, each with how far beyond its gate it is.
    fn scored(
        &self,
        library: &Library,
        query: &Query,
        job: &Job,
    ) -> Result<Vec<(f64, Candidate)>, LibraryError> {
        let whole = self.of_each(job, |i| query.distance_from_whole(&self.summaries[i]))?;
        let local = self.of_each(job, |i| difference(&self.summaries[i].local, &query.local))?;
        let shared = self.tessellations.shared(&query.stars, job)?;
        let votes = self.votes.of_all(&query.sizes, job)?;
        let (near_whole, near_local) = (nearest(&whole, NEAREST), nearest(&local, NEAREST));

        let mean = |differences: &[u32], length: usize, i: usize| f64::from(differences[i]) / length as f64;
        let whole = |i: usize| mean(&whole, WHOLE_LENGTH, i);
        let local = |i: usize| mean(&local, LOCAL_LENGTH, i);
        let tenth = [
            near_whole.get(TENTH - 1).map_or(f64::INFINITY, |&i| whole(i)),
            near_local.get(TENTH - 1).map_or(f64::INFINITY, |&i| local(i)),
        ];
        let candidate = |i: usize, share: f64| {
            let measures = Measures {
                whole: whole(i),
                local: local(i),
                share,
                tessellation: shared[i].score(),
            };
            measures.candidate(self.ids[i], tenth)
        };

        // The nearest by each: by vertices in the size that places speak for, by the others in the suspect's own.
        let by_vertices = Shared::BY.iter().map(|&by| {
            let most = Tessellations::most(&shared, by, SHARING).into_iter();
            most.map(|i| Try::of(i, votes[i][0].size)).collect()
        });
        let by_others = [near_whole, near_local].into_iter();
        let by_others = by_others.map(|near| near.into_iter().map(|i| Try::of(i, 0)).collect());
        let near: Vec<Vec<Try>> = by_vertices.chain(by_others).collect();
        let mut nearest = near.iter().filter_map(|near| near.first());
        let fewer = match nearest.any(|tried| candidate(tried.original, 0.0).0 > TOLD) {
            true => FEWER,
            false => 1,
        };

        let likeliest = Votes::most(&votes, GUESSED / fewer).into_iter();
        let mut tried: Vec<Try> = likeliest.map(|vote| Try::of(vote.original, vote.size)).collect();
        for near in &near {
            tried.extend_from_slice(&near[..near.len().div_ceil(fewer)]);
        }
        tried.sort_unstable_by_key(|tried| (tried.original, tried.size));
        tried.dedup();
        self.lay(library, query, &mut tried, job)?;
        // What is near counts, whether or not it was laid.
        tried.extend(near.into_iter().flatten());
        tried.sort_by_key(|tried| tried.original);

        let of_one = |tries: &[Try]| {
            let share = tries.iter().fold(0.0, |most, tried| f64::max(most, tried.share));
            candidate(tries[0].original, share)
        };
        let by_original = tried.chunk_by(|a, b| a.original == b.original);
        Ok(by_original.map(of_one).collect())
    }

    /// Finds which share of the suspect lies on originals: guesses how it may lie on each, and lays it on those where most samples come near.
    fn lay(
        &self,
        library: &Library,
        query: &Query,
        tried: &mut [Try],
        job: &Job,
    ) -> Result<(), LibraryError> {
        let surfaces = tried
            .iter()
            .map(|tried| library.surface(self.ids[tried.original]));
        let surfaces: Vec<Vec<u8>> = surfaces.collect::<Result<_, _>>()?;
        let size = |k: usize| &query.sizes[tried[k].size];
        let guess = |k: usize| -> Result<(Surface, Guess), LibraryError> {
            let surface = Surface::of(&surfaces[k])?;
            let guess = Guess::of(size(k), &surface);
            Ok((surface, guess))
        };
        let guesses = job.map(tried.len(), 1, guess)?;
        job.go_on()?;
        let guesses: Vec<(Surface, Guess)> = guesses.into_iter().collect::<Result<_, _>>()?;
        let mut order: Vec<usize> = (0..tried.len()).collect();
        order.sort_by_key(|&k| (Reverse(guesses[k].1.near), k));
        order.truncate(LAID);
        let shares = job.map(order.len(), 1, |n| {
            let k = order[n];
            let (surface, guess) = &guesses[k];
            guess.share(size(k), surface)
        })?;
        job.go_on()?;
        for (k, share) in order.into_iter().zip(shares) {
            tried[k].share = share;
        }
        Ok(())
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

/// An original, in which size the suspect is tried on it, and which share came to lie there.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Try {
    original: usize,
    size: usize,
    share: f64,
}

impl Try {
    fn of(original: usize, size: usize) -> Self {
        Self {
            original,
            size,
            share: 0.0,
        }
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
