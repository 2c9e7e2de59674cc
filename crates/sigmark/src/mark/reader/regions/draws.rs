//! Regions as they may be, drawn by decimating the original again with marks of random bits.
//!
//! Whoever knew the mark would get the suspect's regions to the last vertex. Another mark changes which edges are the cheapest, and few triangles are left alike; but those that are left of many draws are likelier to be
//! left of one more, which the suspect is. So survivors are told by where they lie, by their order, by how often draws leave them, and by which regions their corners come to in draws that
//! knew nothing of them. Then each draw takes survivors as likely as they are, and what becomes of all other vertices follows from decimating with another mark.
//!
//! A suspect of another decimator has other triangles left, fewer of those that draws leave than chance would have it: nothing is drawn then.

use std::ops::Range;

use job::Job;
use mesh::TriMesh;

use super::{
    COARSER, Overlay, Regions,
    candidates::Candidates,
    repetition::{Part, known},
    survivors::{Survivor, likelihoods, survivors},
};
use crate::mark::{MarkError, MarkLayout, MarkStage};

/// How many draws there are. In a sketch that knew what is left, T₀ of horse and igea at 1 % was 0.9 of it with eight; that of a horse was the same with 64.
const DRAWS: usize = 16;

/// How often survivors are told from draws, and how many draws they are told from.
const TURNS: usize = 2;
const DRAWS_A_TURN: usize = 8;

/// How much likelier a candidate is than another, for a difference of 1 in what the orders with them cost: the cheapest order stands for all of them.
const SHARPNESS: f64 = 1.5;

/// What a candidate is worth more for each corner that comes to the right region.
const WORTH_OF_A_CORNER: f32 = 1.0;

/// How much likelier a suspect of this decimator is by what draws say of its survivors, in the mean logarithm over triangles, if they say something: copies by fast-simplification of six meshes at 1 % are by 0.09 to 0.93, but for the horse, of which draws say nothing (-0.02); those by MeshLab are less likely by it (-0.03 of the horse, else -0.08 to -1.3).
const LIKELIER: f64 = 0.05;

/// Regions of a suspect as they may be.
pub(in crate::mark::reader) struct Draws {
    /// Each is all that the suspect has.
    pub(in crate::mark::reader) regions: Vec<Regions>,
    /// Whether the suspect is of the decimator that draws them; where that is not sure, they say nothing of it.
    pub(in crate::mark::reader) is_sure: bool,
}

/// Draws of the suspect's regions; none where it is hardly coarser or of another decimator, its order is lost, nothing was seen as a whole, or bases are too large to be [kept](crate::mark::Original::keeps).
pub(in crate::mark::reader) fn draws(
    overlay: Overlay<'_>,
    layout: &MarkLayout,
    job: &Job,
) -> Result<Option<Draws>, MarkError> {
    if overlay.triangles_left() >= COARSER.end {
        return Ok(None);
    }
    let mut candidates = Candidates::of(overlay, job)?;
    if overlay
        .certainty(&survivors(overlay, &candidates, false, job)?)
        .is_none()
    {
        return Ok(None);
    }
    let Some(part) = Part::seen(overlay.original, overlay.places) else {
        return Ok(None);
    };
    let drawing = Drawing {
        overlay,
        layout,
        part,
        job,
    };
    let Some(worth) = drawing.worth_of_triangles()? else {
        return Ok(None);
    };
    let of = |candidates: &Candidates| likelihoods(overlay, candidates, SHARPNESS, job);
    let evidence = drawing.evidence(&candidates, &of(&candidates)?, &worth);
    if evidence < -LIKELIER {
        return Ok(None);
    }
    candidates.add(&worth);
    let mut likely = of(&candidates)?;
    for turn in 0..TURNS {
        // Half of the triangles have no part in a draw, and it may say something of them.
        let first = DRAWS + turn * DRAWS_A_TURN;
        let is_left_out = |draw: usize, s: usize| chance(!draw, s) < 0.5;
        let regions = drawing.regions(first..first + DRAWS_A_TURN, |draw, s| {
            let taken = taken(&candidates, &likely, draw, s);
            taken.filter(|_| !is_left_out(draw, s))
        })?;
        let mut told = candidates.clone();
        told.prefer(
            overlay,
            &regions,
            |i, s| is_left_out(first + i, s),
            WORTH_OF_A_CORNER,
        );
        likely = of(&told)?;
    }
    let draw = |draw: usize, s: usize| taken(&candidates, &likely, draw, s);
    Ok(Some(Draws {
        regions: drawing.regions(0..DRAWS, draw)?,
        is_sure: evidence > LIKELIER,
    }))
}

/// What draws are made of.
struct Drawing<'a> {
    overlay: Overlay<'a>,
    layout: &'a MarkLayout,
    part: Part,
    job: &'a Job,
}

impl Drawing<'_> {
    /// What `f` makes of the number of each draw and of the original with its mark; nothing where bases are too large to be kept.
    fn map<T: Send>(
        &self,
        draws: Range<usize>,
        f: impl Fn(usize, &TriMesh, &Job) -> Result<T, MarkError> + Sync + Send,
    ) -> Result<Vec<T>, MarkError> {
        let at_once = self.job.threads().max(1);
        let mut all = Vec::with_capacity(draws.len());
        let alone = self.job.alone().quiet();
        for first in draws.clone().step_by(at_once) {
            let numbers = first..draws.end.min(first + at_once);
            let marked = self.layout.likenesses(numbers, self.overlay.places, self.job)?;
            self.job.begin(MarkStage::Resampling)?;
            let of = |i: usize| f(first + i, &marked[i], &alone);
            for made in self.job.quiet().map(marked.len(), 1, of)? {
                all.push(made?);
            }
        }
        Ok(all)
    }

    /// What it is worth that a survivor is this triangle of the original, by how often draws leave it (#F); none where there are no draws.
    fn worth_of_triangles(&self) -> Result<Option<Vec<f32>>, MarkError> {
        let seen = self.overlay.seen_triangles().into_iter();
        let target = seen.filter(|is_seen| *is_seen).count();
        let left = |_: usize, marked: &TriMesh, job: &Job| self.part.survivors(marked, target, job);
        let left = self.map(0..DRAWS, left)?;
        if left.len() < DRAWS {
            return Ok(None);
        }
        let mut counts = vec![0; self.overlay.original.triangle_count()];
        left.iter().flatten().for_each(|&t| counts[t as usize] += 1);
        let worth = worth_of_counts(&counts, self.part.triangle_count());
        Ok(Some(counts.into_iter().map(|count| worth[count]).collect()))
    }

    /// How much likelier the suspect is by what its survivors are worth, in the mean logarithm over its triangles.
    fn evidence(&self, candidates: &Candidates, likely: &[f32], worth: &[f32]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for s in 0..self.overlay.suspect.triangle_count() {
            let own = candidates.at(s).iter().zip(&likely[candidates.first(s)..]);
            let times: f32 = own
                .map(|(&(t, _), likely)| likely * worth[t as usize].exp())
                .sum();
            if times > 0.0 {
                sum += f64::from(times.ln());
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    }

    /// Regions of draws, by the survivor that each takes for a triangle of the suspect.
    fn regions(
        &self,
        draws: Range<usize>,
        survivor: impl Fn(usize, usize) -> Option<Survivor> + Sync + Send,
    ) -> Result<Vec<Regions>, MarkError> {
        let of = |draw: usize, marked: &TriMesh, job: &Job| {
            let all = 0..self.overlay.suspect.triangle_count();
            let survivors: Vec<Option<Survivor>> = all.map(|s| survivor(draw, s)).collect();
            let known = known(self.overlay, &survivors, 0.0);
            self.part.decimated_as(marked, &known, job)
        };
        self.map(draws, of)
    }
}

/// The survivor that a draw takes for a triangle of the suspect, as likely as it is.
fn taken(candidates: &Candidates, likely: &[f32], draw: usize, triangle: usize) -> Option<Survivor> {
    let mut left = chance(draw, triangle);
    let own = candidates.at(triangle).iter();
    own.zip(&likely[candidates.first(triangle)..])
        .find_map(|(&(t, _), &likely)| {
            let certainty = f64::from(likely);
            left -= certainty;
            (left < 0.0).then_some(Survivor {
                triangle: t,
                certainty,
            })
        })
}

/// A number from 0 to 1 for a triangle in a draw (SplitMix64, Steele, Lea and Flood 2014).
fn chance(draw: usize, triangle: usize) -> f64 {
    let seed = (draw as u64).wrapping_shl(40) ^ triangle as u64;
    let mut x = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ x >> 31) as f64 / u64::MAX as f64
}

/// What it is worth that a triangle was left by so many draws: the logarithm of how much likelier one more draw leaves it, too. Each draw is the one more for the others.
fn worth_of_counts(counts: &[usize], triangles: usize) -> Vec<f32> {
    // How many triangles were left so often.
    let mut with = [0.0; DRAWS + 2];
    counts.iter().for_each(|&count| with[count] += 1.0);
    with[0] = triangles as f64 - with[1..].iter().sum::<f64>();
    let left: f64 = (1..=DRAWS).map(|count| count as f64 * with[count]).sum();
    let usual = left / (DRAWS * triangles) as f64;
    let worth = |count: usize| {
        let again = (count + 1) as f64 * with[count + 1];
        let all = (DRAWS - count) as f64 * with[count] + again;
        // As if one more had been left as usual: few are left by most draws.
        ((again + 1.0) / (all * usual + 1.0)).ln() as f32
    };
    (0..=DRAWS).map(worth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_are_spread_evenly_and_differ_from_draw_to_draw() {
        let of_draw = |draw: usize| (0..1000).map(move |s| chance(draw, s));
        for draw in [0, 1, DRAWS, !0] {
            let all: Vec<f64> = of_draw(draw).collect();
            assert!(all.iter().all(|c| (0.0..=1.0).contains(c)));
            for bound in [0.1, 0.5, 0.9] {
                let below = all.iter().filter(|&&c| c < bound).count() as f64 / 1000.0;
                assert!((below - bound).abs() < 0.05, "{below} for {bound}");
            }
        }
        let product = of_draw(0).zip(of_draw(1)).map(|(a, b)| (a - 0.5) * (b - 0.5));
        assert!((product.sum::<f64>() / 1000.0).abs() < 0.01);
    }

    #[test]
    fn what_draws_leave_is_worth_as_much_as_it_is_likelier_to_be_left() {
        // Of each thousand triangles ten are left by every draw, and one of the others by each.
        let mut counts = vec![0; 1000];
        counts[..10].fill(DRAWS);
        counts[10..10 + DRAWS].fill(1);
        let worth = worth_of_counts(&counts, 1000);
        let usual: f64 = 11.0 / 1000.0;
        let always = (160.0 + 1.0) / (160.0 * usual + 1.0);
        assert!(
            (f64::from(worth[DRAWS - 1]) - f64::ln(always)).abs() < 1e-6,
            "{worth:?}"
        );
        // One draw in turn left what none of the others did, of 974 that none left.
        let never = (16.0 + 1.0) / ((974.0 * 16.0 + 16.0) * usual + 1.0);
        assert!((f64::from(worth[0]) - f64::ln(never)).abs() < 1e-6, "{worth:?}");
    }
}
