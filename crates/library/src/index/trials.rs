//! Originals on which a suspect is laid, stage by stage.

use std::{cmp::Reverse, collections::HashSet};

use job::Job;

use super::laying::Guess;
use crate::{Library, LibraryError, OriginalId, Query, descriptor::Surface};

/// After each stage the suspect is laid on so many of all that were tried by then: where most samples lie near.
const LAID: usize = 10;

/// An original, and in which size the suspect is tried on it.
pub(super) type Try = (usize, usize);

/// What came of trying a suspect on originals.
pub(super) struct Trials<'a> {
    ids: &'a [OriginalId],
    library: &'a Library,
    query: &'a Query,
    /// Those on which it is not laid yet.
    guessed: Vec<Guessed>,
    /// Originals, and which share of the suspect lies there.
    pub(super) shares: Vec<(usize, f64)>,
}

/// How the suspect may lie there.
struct Guessed {
    tried: Try,
    surface: Surface,
    guess: Guess,
}

impl<'a> Trials<'a> {
    /// None yet; of some originals it counts that nothing of the suspect lies there.
    pub(super) fn new(
        ids: &'a [OriginalId],
        library: &'a Library,
        query: &'a Query,
        originals: impl Iterator<Item = usize>,
    ) -> Self {
        Self {
            ids,
            library,
            query,
            guessed: Vec::new(),
            shares: originals.map(|original| (original, 0.0)).collect(),
        }
    }

    /// Guesses how the suspect may lie on some more originals, and lays it on the likeliest of all.
    pub(super) fn go_on(&mut self, tries: &[Try], job: &Job) -> Result<(), LibraryError> {
        let surfaces = tries
            .iter()
            .map(|&(original, _)| self.library.surface(self.ids[original]));
        let surfaces: Vec<Vec<u8>> = surfaces.collect::<Result<_, _>>()?;
        let guessed = job.map(tries.len(), 1, |k| -> Result<Guessed, LibraryError> {
            let surface = Surface::of(&surfaces[k])?;
            let guess = Guess::of(&self.query.sizes[tries[k].1], &surface);
            Ok(Guessed {
                tried: tries[k],
                surface,
                guess,
            })
        })?;
        job.go_on()?;
        for guessed in guessed {
            self.guessed.push(guessed?);
        }
        self.lay(job)
    }

    /// Lays it where most samples lie near.
    fn lay(&mut self, job: &Job) -> Result<(), LibraryError> {
        self.guessed
            .sort_by_key(|guessed| (Reverse(guessed.guess.near), guessed.tried));
        let likeliest: Vec<Guessed> = self.guessed.drain(..LAID.min(self.guessed.len())).collect();
        let shares = job.map(likeliest.len(), 1, |k| {
            let Guessed {
                tried: (original, size),
                surface,
                guess,
            } = &likeliest[k];
            (*original, guess.share(&self.query.sizes[*size], surface))
        })?;
        job.go_on()?;
        self.shares.extend(shares);
        Ok(())
    }

    /// The largest share for each original.
    pub(super) fn best_shares(mut self) -> Vec<(usize, f64)> {
        self.shares
            .sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        self.shares.dedup_by_key(|(original, _)| *original);
        self.shares
    }
}

/// The first quarter of each list, the second, and the rest; each try once.
pub(super) fn stages(lists: &[Vec<Try>]) -> Vec<Vec<Try>> {
    let mut seen = HashSet::new();
    let stage = |[start, end]: [usize; 2]| {
        let of_list = |list: &Vec<Try>| {
            let cut = |quarters: usize| (quarters * list.len()).div_ceil(4);
            list[cut(start)..cut(end)].to_vec()
        };
        let mut tries: Vec<Try> = lists.iter().flat_map(of_list).collect();
        tries.retain(|&tried| seen.insert(tried));
        tries
    };
    [[0, 1], [1, 2], [2, 4]].map(stage).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_try_comes_once_and_the_first_of_each_list_come_first() {
        let list = |first: usize| {
            (first..first + 8)
                .map(|original| (original, 0))
                .collect::<Vec<Try>>()
        };
        let stages = stages(&[list(0), list(4), Vec::new()]);
        let originals = |tries: &[Try]| tries.iter().map(|tried| tried.0).collect::<Vec<usize>>();
        let stages: Vec<Vec<usize>> = stages.iter().map(|tries| originals(tries)).collect();
        assert_eq!(stages, [vec![0, 1, 4, 5], vec![2, 3, 6, 7], vec![8, 9, 10, 11]]);
    }
}
