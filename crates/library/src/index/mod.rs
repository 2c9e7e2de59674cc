//! All descriptors in memory, and the exact scan.

mod candidate;
mod laying;
mod tessellation;
mod trials;
mod votes;

use std::{cmp::Ordering, collections::HashSet};

use job::{Job, JobError};

use crate::{
    Library, LibraryError, OriginalId, Query,
    descriptor::{LOCAL_LENGTH, Summary, WHOLE_LENGTH, difference},
};
pub use candidate::{By, Candidate};
use candidate::{Measures, TENTH};
use tessellation::{Shared, Tessellations};
use trials::{Trials, Try, stages};
use votes::Votes;

/// Originals, with sizes, for which it is guessed how the suspect lies: those for which its places speak most.
const GUESSED: usize = 96;
/// The nearest by each of the others, for which it is guessed, too.
const NEAREST: usize = 16;
/// The first by each of what vertices say, for which it is guessed, too.
const SHARING: usize = 8;
/// Where an original's score is so high it is told: fewer others are tried, by places of which so many times fewer postings are visited. They may be in the suspect all the same.
const TOLD: f64 = 0.25;
const FEWER: usize = 4;

/// So many of the likeliest are worth an alignment whatever they score: of twisted and cropped models some come to nothing by each measure alone, and are the likeliest all the same.
const ALWAYS: usize = 3;
/// After these come so many that are nearest by the whole, if they score, and so many on which most of the suspect lies: parts of a suspect by themselves may resemble many others.
const BY_ONE: usize = 2;

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

    /// The originals that a suspect resembles most, `most` of them, the likeliest first. What scores, the first three whatever they score, and those two on which most of the suspect lies are [worth an alignment](Candidate::is_worth_a_look).
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
        let mut scored = self.scored(library, query, false, job)?;
        let mut near = nearest_by(By::Whole, &scored);
        near.retain(|candidate| candidate.is_worth_a_look);
        near.extend(nearest_by(By::Surface, &scored));
        for alone in &query.alone {
            let is_told = scored.iter().any(|(score, _)| *score > TOLD);
            scored.extend(self.scored(library, alone, is_told, job)?);
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.original.cmp(&b.1.original)));
        let mut found: Vec<Candidate> = scored.into_iter().map(|(_, candidate)| candidate).collect();
        let rest = found.split_off(ALWAYS.min(found.len()));
        found.extend(near);
        found
            .iter_mut()
            .for_each(|candidate| candidate.is_worth_a_look = true);
        found.extend(rest);
        let mut seen = HashSet::new();
        found.retain(|candidate| seen.insert(candidate.original));
        found.truncate(most);
        Ok(found)
    }

    /// The originals that may be meant, each with how far beyond its gate it is; one may be told already.
    fn scored(
        &self,
        library: &Library,
        query: &Query,
        is_told: bool,
        job: &Job,
    ) -> Result<Vec<(f64, Candidate)>, LibraryError> {
        let (whole, local): (Vec<u32>, Vec<u32>) = self
            .of_each(job, |summary| {
                let local = difference(&summary.local, &query.local);
                (query.distance_from_whole(summary), local)
            })?
            .into_iter()
            .unzip();
        let shared = self.tessellations.shared(&query.stars, job)?;
        let (near_whole, near_local) = (nearest(&whole, NEAREST), nearest(&local, NEAREST));

        let mean = |differences: &[u32], length: usize, i: usize| f64::from(differences[i]) / length as f64;
        let whole = |i: usize| mean(&whole, WHOLE_LENGTH, i);
        let local = |i: usize| mean(&local, LOCAL_LENGTH, i);
        let tenth = [
            near_whole.get(TENTH - 1).map_or(f64::INFINITY, |&i| whole(i)),
            near_local.get(TENTH - 1).map_or(f64::INFINITY, |&i| local(i)),
        ];
        let candidate = |&(i, share): &(usize, f64)| {
            let measures = Measures {
                whole: whole(i),
                local: local(i),
                share,
                tessellation: shared[i].score(),
            };
            measures.candidate(self.ids[i], tenth)
        };
        let tells = |laid: &(usize, f64)| candidate(laid).0 > TOLD;

        // What is near counts, whether or not the suspect is laid on it.
        let by_vertices = Shared::BY.map(|by| Tessellations::most(&shared, by, SHARING));
        let by_others = [near_whole, near_local];
        let near = by_vertices.iter().chain(&by_others).flatten();
        let mut trials = Trials::new(&self.ids, library, query, near.copied());
        let mut is_told = is_told || trials.shares.iter().any(tells);

        // First the nearest by the whole and by small shapes, in the suspect's own size: what is told by them spares most of the votes.
        let by_others = by_others.map(|near| near.into_iter().map(|i| (i, 0)).collect());
        let mut near = stages(&by_others);
        near.truncate(if is_told { 1 } else { near.len() });
        let near = near.concat();
        trials.go_on(&near, job)?;
        is_told |= trials.shares.iter().any(tells);

        let votes = self
            .votes
            .of_all(&query.sizes, if is_told { FEWER } else { 1 }, job)?;
        let likeliest = Votes::most(&votes, GUESSED).into_iter();
        let mut lists: Vec<Vec<Try>> = vec![likeliest.map(|vote| (vote.original, vote.size)).collect()];
        // The nearest by vertices in the size that places speak for.
        lists.extend(by_vertices.map(|near| near.into_iter().map(|i| (i, votes[i][0].size)).collect()));
        lists
            .iter_mut()
            .for_each(|list| list.retain(|tried| !near.contains(tried)));
        for tries in stages(&lists) {
            trials.go_on(&tries, job)?;
            is_told |= trials.shares.iter().any(tells);
            if is_told {
                break;
            }
        }
        Ok(trials.best_shares().iter().map(candidate).collect())
    }

    /// Something of each original.
    fn of_each<T: Send>(
        &self,
        job: &Job,
        of: impl Fn(&Summary) -> T + Sync + Send,
    ) -> Result<Vec<T>, JobError> {
        let chunks: Vec<&[Summary]> = self.summaries.chunks(AT_A_TIME).collect();
        let chunks = job.map(chunks.len(), 1, |chunk| {
            chunks[chunk].iter().map(&of).collect::<Vec<T>>()
        })?;
        job.go_on()?;
        Ok(chunks.into_iter().flatten().collect())
    }
}

/// The candidates that are nearest by one measure.
fn nearest_by(by: By, scored: &[(f64, Candidate)]) -> Vec<Candidate> {
    let likeness = scored
        .iter()
        .map(|(_, candidate)| candidate.likeness[by as usize]);
    let near = greatest(likeness, BY_ONE);
    near.into_iter().map(|i| scored[i].1).collect()
}

/// The places of the greatest numbers beyond 0, the greatest first.
fn greatest(numbers: impl Iterator<Item = f64>, most: usize) -> Vec<usize> {
    let numbers = numbers.enumerate().filter(|(_, number)| *number > 0.0);
    let first = first_by(numbers, most, |a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    first.into_iter().map(|(i, _)| i).collect()
}

/// The places of the least numbers, the least first.
fn nearest(differences: &[u32], most: usize) -> Vec<usize> {
    let differences = differences.iter().zip(0..);
    let first = first_by(differences, most, Ord::cmp);
    first.into_iter().map(|(_, i)| i).collect()
}

/// The first of many things by a strict order, so many at most, the first first.
fn first_by<T: Copy>(
    things: impl Iterator<Item = T>,
    most: usize,
    order: impl Fn(&T, &T) -> Ordering,
) -> Vec<T> {
    let mut first = Vec::new();
    let mut last: Option<T> = None;
    for thing in things {
        if last.is_none_or(|last| order(&thing, &last).is_lt()) {
            first.push(thing);
        }
        // What comes after so many others needs no look any more.
        if first.len() > 2 * most {
            let (_, &mut nth, _) = first.select_nth_unstable_by(most, &order);
            first.truncate(most);
            last = Some(nth);
        }
    }
    first.sort_unstable_by(order);
    first.truncate(most);
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_first_of_many_are_those_of_all_in_order(numbers in prop::collection::vec(0..50_u32, 0..200), most in 0..20_usize) {
            let mut all: Vec<(u32, usize)> = numbers.iter().copied().zip(0..).collect();
            let first = first_by(all.iter().copied(), most, Ord::cmp);
            all.sort_unstable();
            all.truncate(most);
            prop_assert_eq!(first, all);
        }
    }
}
