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
    /// When it can't be read, a descriptor has another length, or the job is cancelled.
    pub fn load(library: &Library, job: &Job) -> Result<Self, LibraryError> {
        let (mut index, mut words, mut stars) = (Self::default(), Vec::new(), Vec::new());
        library.each_summary(job, |id, mut summary| {
            index.ids.push(id);
            words.push(std::mem::take(&mut summary.words));
            stars.push(std::mem::take(&mut summary.stars));
            index.summaries.push(summary);
        })?;
        (index.votes, index.tessellations) = job.join(|| Votes::of(&words), || Tessellations::of(&stars))?;
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
        let compared = self.compared(query, job)?;
        // What is near counts, whether or not the suspect is laid on it.
        let by_vertices = Shared::BY.map(|by| Tessellations::most(&compared.shared, by, SHARING));
        let near = by_vertices.iter().chain(&compared.nearest).flatten();
        let mut trials = Trials::new(&self.ids, library, query, near.copied());
        let mut is_told = is_told || compared.tell(&trials);

        // First the nearest by the whole and by small shapes, in the suspect's own size: what is told by them spares most of the votes.
        let by_others: Vec<Vec<Try>> = compared
            .nearest
            .iter()
            .map(|near| near.iter().map(|&i| (i, 0)).collect())
            .collect();
        let mut near = stages(&by_others);
        near.truncate(if is_told { 1 } else { near.len() });
        let near = near.concat();
        trials.go_on(&near, job)?;
        is_told |= compared.tell(&trials);

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
            is_told |= compared.tell(&trials);
            if is_told {
                break;
            }
        }
        let shares = trials.best_shares();
        Ok(shares.iter().map(|share| compared.candidate(share)).collect())
    }

    /// Compares all originals with a suspect.
    fn compared(&self, query: &Query, job: &Job) -> Result<Compared<'_>, LibraryError> {
        let differences = self.of_each(job, |summary| {
            let local = difference(&summary.local, &query.local);
            (query.distance_from_whole(summary), local)
        })?;
        let (whole, local): (Vec<u32>, Vec<u32>) = differences.into_iter().unzip();
        Ok(Compared {
            ids: &self.ids,
            nearest: [&whole, &local].map(|differences| nearest(differences, NEAREST)),
            whole,
            local,
            shared: self.tessellations.shared(&query.stars, job)?,
        })
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

/// What each original has in common with a suspect, before this is laid on any.
struct Compared<'a> {
    ids: &'a [OriginalId],
    /// Differences from the whole and from small shapes.
    whole: Vec<u32>,
    local: Vec<u32>,
    /// Those with the least of each, the nearest first.
    nearest: [Vec<usize>; 2],
    /// By vertices.
    shared: Vec<Shared>,
}

impl Compared<'_> {
    fn whole(&self, original: usize) -> f64 {
        f64::from(self.whole[original]) / WHOLE_LENGTH as f64
    }

    fn local(&self, original: usize) -> f64 {
        f64::from(self.local[original]) / LOCAL_LENGTH as f64
    }

    /// How far beyond its gate an original is on which so much of the suspect lies, and what that is by.
    fn candidate(&self, &(original, share): &(usize, f64)) -> (f64, Candidate) {
        let [by_whole, by_local] = self.nearest.each_ref().map(|near| near.get(TENTH - 1));
        let tenth = [
            by_whole.map_or(f64::INFINITY, |&i| self.whole(i)),
            by_local.map_or(f64::INFINITY, |&i| self.local(i)),
        ];
        let measures = Measures {
            whole: self.whole(original),
            local: self.local(original),
            share,
            tessellation: self.shared[original].score(),
        };
        measures.candidate(self.ids[original], tenth)
    }

    /// Whether an original is told by what was tried.
    fn tell(&self, trials: &Trials<'_>) -> bool {
        trials.shares.iter().any(|share| self.candidate(share).0 > TOLD)
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
