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
            let first = all.up_to.len();
            for &(t, gain) in candidates.at(s) {
                let (cost, link) = all.lightest.before(t);
                all.up_to.push(cost - f64::from(gain));
                all.before.push(link);
            }
            for (i, &(t, _)) in (first..).zip(candidates.at(s)) {
                all.lightest.put(t, all.up_to[i], i);
            }
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
    let (least, mut last) = lightest.before(of_original as u32);
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
        from.extend(own.iter().map(|&(t, _)| after.before(mirrored(t)).0));
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
        for (&(t, gain), from) in own.iter().zip(&from) {
            after.put(mirrored(t), from - f64::from(gain), 0);
        }
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
        from.extend(own.iter().map(|&(t, _)| lightest.before(mirrored(t)).0));
        if let Some(survivor) = survivor {
            let costs = up_to[candidates.first(s)..].iter().zip(&from);
            let likelihoods = costs.map(|(up_to, from)| (least - up_to - from).exp());
            survivor.certainty = 1.0 / likelihoods.sum::<f64>().max(1.0);
        }
        for (&(t, gain), from) in own.iter().zip(&from) {
            lightest.put(mirrored(t), from - f64::from(gain), 0);
        }
    }
    Ok(())
}

/// The lightest of what was put at smaller indices (Fenwick's tree): its cost, and which it is.
struct LightestBefore {
    costs: Vec<f64>,
    /// One more than the number of each.
    links: Vec<Option<NonZeroU32>>,
}

impl LightestBefore {
    fn new(count: usize) -> Self {
        Self {
            costs: vec![0.0; count + 1],
            links: vec![None; count + 1],
        }
    }

    /// Its cost, and one more than its number.
    fn before(&self, index: u32) -> (f64, Option<NonZeroU32>) {
        let (mut i, mut lightest) = (index as usize, 0);
        while i > 0 {
            if self.costs[i] < self.costs[lightest] {
                lightest = i;
            }
            i &= i - 1;
        }
        (self.costs[lightest], self.links[lightest])
    }

    fn put(&mut self, index: u32, cost: f64, link: usize) {
        let mut i = index as usize + 1;
        // Who has more below it is no heavier.
        while i < self.costs.len() && cost < self.costs[i] {
            self.costs[i] = cost;
            self.links[i] = NonZeroU32::new(link as u32 + 1);
            i += i & i.wrapping_neg();
        }
    }
}
