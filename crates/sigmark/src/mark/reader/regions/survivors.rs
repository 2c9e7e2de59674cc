//! Which triangles of the original are left in the suspect, by their order.

use std::num::NonZeroU32;

use job::Job;

use super::{CHUNK, Overlay, candidates::Candidates};
use crate::mark::MarkError;

/// A triangle of the original that a suspect's was.
#[derive(Clone, Copy)]
pub(super) struct Survivor {
    pub(super) triangle: u32,
    /// From 0 to 1: the likelihood of the best order with it beside those with each of the other candidates; 0 where it was not asked for.
    pub(super) certainty: f64,
}

/// The lightest subsequences that end with each candidate.
struct Subsequences {
    lightest: LightestBefore,
    /// One more than the number of the candidate before it; none where it is the first.
    before: Vec<Option<NonZeroU32>>,
    /// What they cost.
    up_to: Vec<f64>,
}

impl Subsequences {
    fn of(overlay: Overlay<'_>, candidates: &Candidates, job: &Job) -> Result<Self, MarkError> {
        let mut all = Self {
            lightest: LightestBefore::new(overlay.original.triangle_count()),
            before: Vec::with_capacity(candidates.count()),
            up_to: Vec::with_capacity(candidates.count()),
        };
        for s in 0..overlay.suspect.triangle_count() {
            if s.is_multiple_of(CHUNK) {
                job.go_on()?;
            }
            let (own, first) = (candidates.at(s), all.up_to.len());
            let before = all.lightest.before_each(own.iter().map(|&(t, _)| t));
            for (&(_, gain), Lightest { cost, link }) in own.iter().zip(before) {
                all.up_to.push(cost - f64::from(gain));
                all.before.push(link);
            }
            let costs = (first..).zip(&all.up_to[first..]);
            let put = own.iter().zip(costs).map(|(&(t, _), (i, &cost))| (t, cost, i));
            all.lightest.put_each(put);
        }
        Ok(all)
    }
}

/// For each triangle of the suspect, the original's that it was (#F); none where no one fits into the order.
pub(super) fn survivors(
    overlay: Overlay<'_>,
    candidates: &Candidates,
    how_certain: bool,
    job: &Job,
) -> Result<Vec<Option<Survivor>>, MarkError> {
    let Subsequences {
        lightest,
        before,
        up_to,
    } = Subsequences::of(overlay, candidates, job)?;
    let of_original = overlay.original.triangle_count();
    let mut survivors = vec![None; overlay.suspect.triangle_count()];
    let Lightest {
        cost: least,
        link: mut last,
    } = lightest.of_all();
    while let Some(link) = last.map(|link| link.get() as usize - 1) {
        let (triangle, place) = candidates.pair(link);
        survivors[place] = Some(Survivor {
            triangle,
            certainty: 0.0,
        });
        last = before[link];
    }
    drop(before);
    if how_certain {
        weigh(&mut survivors, of_original, candidates, &up_to, least, job)?;
    }
    Ok(survivors)
}

/// How likely each of a triangle's candidates is beside the others, by the lightest subsequence with each, of all candidates in turn. The logarithm of a likelihood is minus `sharpness` times what its subsequence costs more than the lightest.
pub(super) fn likelihoods(
    overlay: Overlay<'_>,
    candidates: &Candidates,
    sharpness: f64,
    job: &Job,
) -> Result<Vec<f32>, MarkError> {
    let up_to = Subsequences::of(overlay, candidates, job)?.up_to;
    let count = overlay.original.triangle_count();
    let mut after = LightestBefore::new(count);
    let mirrored = |t: u32| (count - 1) as u32 - t;
    let mut likelihoods = vec![0.0; up_to.len()];
    let (mut from, mut costs) = (Vec::<f64>::new(), Vec::<f64>::new());
    for s in (0..overlay.suspect.triangle_count()).rev() {
        if s.is_multiple_of(CHUNK) {
            job.go_on()?;
        }
        let (own, first) = (candidates.at(s), candidates.first(s));
        from.clear();
        from.extend(
            after
                .before_each(own.iter().map(|&(t, _)| mirrored(t)))
                .map(|lightest| lightest.cost),
        );
        costs.clear();
        costs.extend(from.iter().zip(&up_to[first..]).map(|(from, up_to)| from + up_to));
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        costs
            .iter_mut()
            .for_each(|cost| *cost = (sharpness * (least - *cost)).exp());
        let sum: f64 = costs.iter().sum();
        for (likelihood, of_it) in likelihoods[first..].iter_mut().zip(&costs) {
            *likelihood = (of_it / sum) as f32;
        }
        let put = own.iter().zip(&from).rev();
        after.put_each(put.map(|(&(t, gain), from)| (mirrored(t), from - f64::from(gain), 0)));
    }
    Ok(likelihoods)
}

/// Sets how certain survivors are, given how many triangles the original has, and what the lightest subsequence costs up to each candidate and in all.
fn weigh(
    survivors: &mut [Option<Survivor>],
    count: usize,
    candidates: &Candidates,
    up_to: &[f64],
    least: f64,
    job: &Job,
) -> Result<(), MarkError> {
    let mut lightest = LightestBefore::new(count);
    let mirrored = |t: u32| (count - 1) as u32 - t;
    let mut from: Vec<f64> = Vec::new();
    for (s, survivor) in survivors.iter_mut().enumerate().rev() {
        if s.is_multiple_of(CHUNK) {
            job.go_on()?;
        }
        let own = candidates.at(s);
        from.clear();
        from.extend(
            lightest
                .before_each(own.iter().map(|&(t, _)| mirrored(t)))
                .map(|lightest| lightest.cost),
        );
        if let Some(survivor) = survivor {
            let costs = up_to[candidates.first(s)..].iter().zip(&from);
            let likelihoods = costs.map(|(up_to, from)| (least - up_to - from).exp());
            survivor.certainty = 1.0 / likelihoods.sum::<f64>().max(1.0);
        }
        let put = own.iter().zip(&from).rev();
        lightest.put_each(put.map(|(&(t, gain), from)| (mirrored(t), from - f64::from(gain), 0)));
    }
    Ok(())
}

/// Neighbouring indices that are kept together.
const BLOCK: usize = 32;

/// The lightest of what was put at smaller indices. Each index keeps that of its block up to it, and Fenwick's tree those of whole blocks: it is small enough to stay near the processor.
struct LightestBefore {
    within: Vec<Lightest>,
    of_blocks: Vec<Lightest>,
}

#[derive(Clone, Copy)]
struct Lightest {
    cost: f64,
    /// One more than its number; none where nothing lighter than 0 was put.
    link: Option<NonZeroU32>,
}

impl Lightest {
    const NONE: Self = Self {
        cost: 0.0,
        link: None,
    };

    /// The lighter of two; the first of equals.
    fn or(self, other: Self) -> Self {
        match other.cost < self.cost {
            true => other,
            false => self,
        }
    }
}

impl LightestBefore {
    fn new(count: usize) -> Self {
        Self {
            within: vec![Lightest::NONE; count],
            of_blocks: vec![Lightest::NONE; count.div_ceil(BLOCK) + 1],
        }
    }

    /// That of each of some indices. Between neighbours in one block nothing of whole blocks changes.
    fn before_each(&self, indices: impl Iterator<Item = u32>) -> impl Iterator<Item = Lightest> {
        let (mut last, mut of_blocks) = (usize::MAX, Lightest::NONE);
        indices.map(move |index| {
            let (index, block) = (index as usize, index as usize / BLOCK);
            if block != last {
                (last, of_blocks) = (block, self.before_block(block));
            }
            match index % BLOCK {
                0 => of_blocks,
                _ => self.within[index - 1].or(of_blocks),
            }
        })
    }

    /// That of all that was put.
    fn of_all(&self) -> Lightest {
        self.before_block(self.of_blocks.len() - 1)
    }

    fn before_block(&self, block: usize) -> Lightest {
        let (mut i, mut lightest) = (block, Lightest::NONE);
        while i > 0 {
            lightest = lightest.or(self.of_blocks[i]);
            i &= i - 1;
        }
        lightest
    }

    /// Puts costs at ascending indices, with their numbers. One that is not lighter than another at a smaller index will never be asked for.
    fn put_each(&mut self, all: impl Iterator<Item = (u32, f64, usize)>) {
        let mut least = f64::INFINITY;
        for (index, cost, number) in all {
            if cost < least {
                least = cost;
                self.put(index as usize, cost, number);
            }
        }
    }

    fn put(&mut self, index: usize, cost: f64, number: usize) {
        let put = Lightest {
            cost,
            link: NonZeroU32::new(number as u32 + 1),
        };
        let block = index / BLOCK;
        let end = ((block + 1) * BLOCK).min(self.within.len());
        // Who has more before it is no heavier.
        let is_heavier = |lightest: &&mut Lightest| cost < lightest.cost;
        let after = self.within[index..end].iter_mut();
        after.take_while(is_heavier).for_each(|lightest| *lightest = put);
        let mut i = block + 1;
        while i < self.of_blocks.len() && cost < self.of_blocks[i].cost {
            self.of_blocks[i] = put;
            i += i & i.wrapping_neg();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lightest_before_an_index_is_the_least_of_all_that_was_put_there() {
        let count = 5 * BLOCK + 3;
        let (mut lightest, mut put) = (LightestBefore::new(count), Vec::<(usize, f64)>::new());
        let mut seed = 7_u64;
        let mut below = |most: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (seed >> 33) as usize % most
        };
        for _ in 0..60 {
            let mut indices: Vec<u32> = (0..4).map(|_| below(count) as u32).collect();
            indices.sort_unstable();
            indices.dedup();
            let first = put.len();
            put.extend(indices.iter().map(|&t| (t as usize, -(below(1000) as f64))));
            let numbered = put.iter().enumerate().skip(first);
            lightest.put_each(numbered.map(|(i, &(t, cost))| (t as u32, cost, i)));
            let found = lightest.before_each(0..count as u32).chain([lightest.of_all()]);
            for (index, Lightest { cost, link }) in found.enumerate() {
                let before = put.iter().filter(|(t, _)| *t < index);
                assert_eq!(cost, before.map(|&(_, cost)| cost).fold(0.0, f64::min));
                let own = link.map_or(0.0, |link| put[link.get() as usize - 1].1);
                assert_eq!(cost, own);
            }
        }
    }
}
