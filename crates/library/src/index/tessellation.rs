//! Which originals have a suspect's vertices.
//!
//! Stars of all originals lie sorted by their words. A star of an original whose word a suspect has says as much for it as its shape is the suspect's: fully where it is the same, nothing from [`FAR`] on.

use crate::descriptor::{Star, difference};

/// Shapes that differ by so much say nothing.
const FAR: f64 = 48.0;
/// Fewer words that two models have in common may be chance.
const FEW: f64 = 8.0;
/// The first bits of a word's hash, by which one begins to look.
const PREFIX: u32 = 16;

/// Stars by words.
#[derive(Debug, Default)]
pub(super) struct Tessellations {
    starts: Vec<u32>,
    postings: Vec<Posting>,
    count: usize,
}

#[derive(Clone, Copy, Debug)]
struct Posting {
    star: Star,
    original: u32,
}

/// What speaks for an original.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shared {
    /// Words that it has in common with the suspect.
    pub(super) words: u32,
    /// How like their shapes are, 1 for each that is the same.
    pub(super) alike: f32,
}

impl Shared {
    /// The mean likeness of what they share, from 0 to 1.
    pub(super) fn score(&self) -> f64 {
        f64::from(self.alike) / f64::from(self.words).max(FEW)
    }
}

impl Tessellations {
    /// Of the stars of each original.
    pub(super) fn of(stars: &[Vec<Star>]) -> Self {
        let mut postings: Vec<Posting> = Vec::with_capacity(stars.iter().map(Vec::len).sum());
        for (original, stars) in stars.iter().enumerate() {
            postings.extend(stars.iter().map(|&star| Posting {
                star,
                original: original as u32,
            }));
        }
        postings.sort_unstable_by_key(|posting| (spread(posting.star.word), posting.original));
        let mut starts = vec![0_u32; (1 << PREFIX) + 1];
        for posting in &postings {
            starts[prefix(posting.star.word) + 1] += 1;
        }
        for i in 0..1 << PREFIX {
            starts[i + 1] += starts[i];
        }
        Self {
            starts,
            postings,
            count: stars.len(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        4 * self.starts.len() + size_of::<Posting>() * self.postings.len()
    }

    /// What a suspect's stars, sorted, have in common with each original.
    pub(super) fn shared(&self, suspect: &[Star]) -> Vec<Shared> {
        let mut shared = vec![Shared::default(); self.count];
        if self.postings.is_empty() {
            return shared;
        }
        for alike in suspect.chunk_by(|a, b| a.word == b.word) {
            for posting in self.with(alike[0].word) {
                let distance = |star: &Star| difference(&star.shape, &posting.star.shape);
                let least = alike.iter().map(distance).min().unwrap_or(u32::MAX);
                let of_it = &mut shared[posting.original as usize];
                of_it.words += 1;
                of_it.alike += (1.0 - f64::from(least) / FAR).max(0.0) as f32;
            }
        }
        shared
    }

    fn with(&self, word: u32) -> &[Posting] {
        let first = prefix(word);
        let near = &self.postings[self.starts[first] as usize..self.starts[first + 1] as usize];
        let start = near.partition_point(|posting| spread(posting.star.word) < spread(word));
        let count = near[start..].partition_point(|posting| posting.star.word == word);
        &near[start..start + count]
    }
}

/// Words that are kept are small ones; these are spread over all numbers (by an odd factor, so that none is lost).
fn spread(word: u32) -> u32 {
    word.wrapping_mul(0x9e37_79b1)
}

fn prefix(word: u32) -> usize {
    (spread(word) >> (32 - PREFIX)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn star(word: u32, shape: u8) -> Star {
        Star {
            word,
            shape: [shape; 8],
        }
    }

    proptest! {
        #[test]
        fn an_original_shares_all_of_its_stars_with_itself_and_none_of_others(words in prop::collection::btree_set(any::<u32>(), 2..60)) {
            let words: Vec<u32> = words.into_iter().collect();
            let (own, others) = words.split_at(words.len() / 2);
            let stars = |words: &[u32]| words.iter().map(|&word| star(word, 9)).collect::<Vec<Star>>();
            let index = Tessellations::of(&[stars(own), stars(others)]);
            let shared = index.shared(&stars(own));
            prop_assert_eq!((shared[0].words, shared[1].words), (own.len() as u32, 0));
            prop_assert_eq!(shared[0].alike, own.len() as f32);
        }
    }

    #[test]
    fn of_two_with_the_same_triangles_the_one_with_the_same_shapes_is_nearer() {
        let of = |shape: u8| (0..20).map(|word| star(word, shape)).collect::<Vec<Star>>();
        let shared = Tessellations::of(&[of(100), of(104), of(120)]).shared(&of(100));
        assert_eq!(shared[0].score(), 1.0);
        assert!(shared[1].score() > 0.2 && shared[1].score() < 0.5);
        assert_eq!(shared[2].score(), 0.0);
    }

    #[test]
    fn few_words_in_common_are_little() {
        let shared = Tessellations::of(&[vec![star(5, 1)]]).shared(&[star(5, 1)]);
        assert!(shared[0].score() < 0.2);
        assert!(Tessellations::default().shared(&[star(5, 1)]).is_empty());
    }
}
