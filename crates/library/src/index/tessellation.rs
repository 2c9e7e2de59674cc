//! Which originals have a suspect's vertices.
//!
//! Stars of all originals lie sorted by their words. A star of an original whose word a suspect has says as much for it as its shape is the suspect's, and as few others are as near: fully where it is the same and the only one, nothing from [`FAR`] on.
//!
//! Three things are told apart. A crop that kept its vertices has the very shapes of those that lie in it, and nothing of the others: a few that are the same are enough. Noise and poses change shapes a little everywhere, and what counts is how like all of them are.
//! Whoever pulls a model out of shape and leaves its triangles alone keeps nothing but words: where nearly all of an original's are there, and few others have them, shapes are not asked.

use job::{Job, JobError};

use super::greatest;
use crate::descriptor::{SAME, Star, difference};

/// Shapes that differ by so much say nothing.
const FAR: u32 = 48;
/// A small library is as good as one of so many originals.
const NOMINAL: usize = 1000;
/// Fewer words that two models have in common may be chance.
const FEW: f64 = 8.0;
/// One begins to look by the first bits of a word's hash, so many that this number of stars has the same.
const ALIKE: usize = 8;

/// So many stars that are the same, and that nobody else has, make a score of one half: of strangers made of the models of a library of 30 000 none had more than four with one original.
const HALF: f64 = 4.5;

/// Of originals with fewer stars than this, words alone say little.
const FEW_STARS: u32 = 32;

/// What words by themselves make of a score at most.
const BY_WORDS: f64 = 0.6;

/// Words that one thread looks up at a time.
const AT_A_TIME: usize = 512;
/// Of words of which there are more pairs of stars, only those with the same shape are looked for: they are found by their [sums](Star::sums), the first in cells.
const COMPARED: usize = 1 << 16;
const CELL: u16 = 2 * SAME;

/// Stars by words.
#[derive(Debug, Default)]
pub(super) struct Tessellations {
    /// By the first `bits` of a word's hash.
    starts: Vec<u32>,
    bits: u32,
    postings: Vec<Posting>,
    /// How many stars each original has.
    stars: Vec<u32>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Posting {
    star: Star,
    original: u32,
}

/// What speaks for an original.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shared {
    /// Words that it has in common with the suspect.
    words: u32,
    /// How like their shapes are, 1 for each that is the same.
    alike: f32,
    /// How rare it is to have such a word with so like a shape, 1 for each that nobody else has.
    rare: f32,
    /// The same, of those alone whose shape [is the same](Star::is_same).
    same: f32,
    /// How many are the likest, each shared with all originals that are as like.
    likest: f32,
    /// How rare words are, whatever their shapes, and how many the original has.
    rare_words: f32,
    all: u32,
}

impl Shared {
    /// From 0 to 1: what shapes say, or with that what words say by themselves. Of several models with the same triangles the one with the likest shapes comes first.
    pub(super) fn score(&self) -> f64 {
        let shapes = self.by_shapes();
        shapes.max(BY_WORDS * self.by_words() + (1.0 - BY_WORDS) * shapes)
    }

    /// The mean rarity times the mean likeness of what they share, or how many stars are the same.
    fn by_shapes(&self) -> f64 {
        let words = f64::from(self.words).max(FEW);
        let by_all = f64::from(self.rare) / words * (f64::from(self.alike) / words);
        let same = f64::from(self.same).powi(2);
        by_all.max(same / (same + HALF * HALF))
    }

    /// The share of the original's stars whose words the suspect has, times how rare these are.
    fn by_words(&self) -> f64 {
        f64::from(self.rare_words) / f64::from(self.all.max(FEW_STARS))
    }

    /// By what an original may have the most: a crop by what is the same, a noisy or a posed suspect by what is the likest, one that was pulled out of shape by words.
    pub(super) const BY: [fn(&Self) -> f64; 4] = [
        Self::by_shapes,
        |shared| shared.same.into(),
        |shared| shared.likest.into(),
        Self::by_words,
    ];
}

/// What a star of an original says.
struct Said {
    original: u32,
    alike: f32,
    rare: f32,
    likest: f32,
    rare_word: f32,
    is_same: bool,
}

impl Tessellations {
    /// Of the stars of each original.
    pub(super) fn of(stars: &[Vec<Star>]) -> Self {
        let count = stars.iter().map(Vec::len).sum::<usize>();
        let bits = (count / ALIKE).max(2).ilog2();
        let mut starts = vec![0_u32; (1 << bits) + 1];
        for star in stars.iter().flatten() {
            starts[prefix(star.word, bits) + 1] += 1;
        }
        for i in 0..1 << bits {
            starts[i + 1] += starts[i];
        }
        // First to those with the same first bits, each original's after those of the one before; these are sorted then.
        let (mut next, mut postings) = (starts.clone(), vec![Posting::default(); count]);
        for (original, stars) in (0..).zip(stars) {
            for &star in stars {
                let next = &mut next[prefix(star.word, bits)];
                postings[*next as usize] = Posting { star, original };
                *next += 1;
            }
        }
        for ends in starts.windows(2) {
            let alike = &mut postings[ends[0] as usize..ends[1] as usize];
            alike.sort_by_cached_key(|posting| (spread(posting.star.word), cell_and_sum(&posting.star)));
        }
        Self {
            starts,
            bits,
            postings,
            stars: stars.iter().map(|stars| stars.len() as u32).collect(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        4 * (self.starts.len() + self.stars.len()) + size_of::<Posting>() * self.postings.len()
    }

    /// What a suspect's stars, sorted, have in common with each original.
    pub(super) fn shared(&self, suspect: &[Star], job: &Job) -> Result<Vec<Shared>, JobError> {
        let words: Vec<&[Star]> = suspect.chunk_by(|a, b| a.word == b.word).collect();
        let count = words.len().div_ceil(AT_A_TIME);
        let said = job.map(count, 1, |chunk| {
            let words = words.iter().skip(chunk * AT_A_TIME).take(AT_A_TIME);
            words.flat_map(|alike| self.said(alike)).collect::<Vec<Said>>()
        })?;
        job.go_on()?;
        let none = |&all: &u32| Shared {
            all,
            ..Shared::default()
        };
        let mut shared: Vec<Shared> = self.stars.iter().map(none).collect();
        for said in said.into_iter().flatten() {
            let of_it = &mut shared[said.original as usize];
            of_it.words += 1;
            of_it.alike += said.alike;
            of_it.rare += said.rare;
            of_it.likest += said.likest;
            of_it.rare_words += said.rare_word;
            of_it.same += if said.is_same { said.rare } else { 0.0 };
        }
        Ok(shared)
    }

    /// The originals for which most speaks by one of [`Shared::BY`], the most first.
    pub(super) fn most(shared: &[Shared], by: fn(&Shared) -> f64, most: usize) -> Vec<usize> {
        greatest(shared.iter().map(by), most)
    }

    /// What all stars with the word of some of a suspect's say.
    fn said(&self, alike: &[Star]) -> Vec<Said> {
        let postings = self.with(alike[0].word);
        match postings.len() * alike.len() <= COMPARED {
            true => self.said_by_all(postings, alike),
            false => self.said_by_the_same(postings, alike),
        }
    }

    /// What each says, by how far its shape is from the suspect's nearest.
    fn said_by_all(&self, postings: &[Posting], alike: &[Star]) -> Vec<Said> {
        let nearest = |posting: &Posting| {
            let distances = alike
                .iter()
                .map(|star| difference(&star.shape, &posting.star.shape));
            distances.min().unwrap_or(FAR).min(FAR)
        };
        let distances: Vec<u32> = postings.iter().map(nearest).collect();
        // How many are as near.
        let mut nearer = [0_usize; FAR as usize + 1];
        distances
            .iter()
            .for_each(|&distance| nearer[distance as usize] += 1);
        for distance in 0..FAR as usize {
            nearer[distance + 1] += nearer[distance];
        }
        let rare_word = self.rarity(postings.len(), postings);
        let said = |(posting, &distance): (&Posting, &u32)| {
            let (as_near, says) = (nearer[distance as usize], distance < FAR);
            Said {
                original: posting.original,
                alike: 1.0 - distance as f32 / FAR as f32,
                rare: if says { self.rarity(as_near, postings) } else { 0.0 },
                likest: if says { 1.0 / as_near as f32 } else { 0.0 },
                rare_word,
                is_same: says && alike.iter().any(|star| is_same(star, &posting.star)),
            }
        };
        postings.iter().zip(&distances).map(said).collect()
    }

    /// What those say that have the shape of one of the suspect's; the others nothing.
    fn said_by_the_same(&self, postings: &[Posting], alike: &[Star]) -> Vec<Said> {
        let mut same: Vec<usize> = Vec::new();
        for star in alike {
            let [first, second] = star.sums();
            for cell in first.saturating_sub(SAME) / CELL..=(first + SAME) / CELL {
                let low = (cell, second.saturating_sub(SAME));
                let high = (cell, second + SAME);
                let start = postings.partition_point(|posting| cell_and_sum(&posting.star) < low);
                let near = postings[start..]
                    .iter()
                    .take_while(|posting| cell_and_sum(&posting.star) <= high);
                same.extend(
                    near.enumerate()
                        .filter(|(_, posting)| is_same(star, &posting.star))
                        .map(|(i, _)| start + i),
                );
            }
        }
        same.sort_unstable();
        same.dedup();
        let said = |&i: &usize| Said {
            original: postings[i].original,
            alike: 1.0,
            rare: self.rarity(same.len(), postings),
            likest: 1.0 / same.len() as f32,
            rare_word: self.rarity(postings.len(), postings),
            is_same: true,
        };
        same.iter().map(said).collect()
    }

    /// How rare it is to be one of so many, of all that have the word, or would have it if every original had one: from 0 to 1, the only one.
    fn rarity(&self, as_near: usize, postings: &[Posting]) -> f32 {
        let all = postings.len().max(self.stars.len()).max(NOMINAL);
        1.0 - (as_near as f32).ln() / (all as f32).ln()
    }

    fn with(&self, word: u32) -> &[Posting] {
        if self.postings.is_empty() {
            return &[];
        }
        let first = prefix(word, self.bits);
        let near = &self.postings[self.starts[first] as usize..self.starts[first + 1] as usize];
        let start = near.partition_point(|posting| spread(posting.star.word) < spread(word));
        let count = near[start..].partition_point(|posting| posting.star.word == word);
        &near[start..start + count]
    }
}

/// [`Star::is_same`], after what most fail and bytes tell at once: of numbers that are the same bytes differ by one at most.
fn is_same(a: &Star, b: &Star) -> bool {
    difference(&a.shape, &b.shape) <= a.shape.len() as u32 && a.is_same(b)
}

/// By what stars of a word are sorted.
fn cell_and_sum(star: &Star) -> (u16, u16) {
    let [first, second] = star.sums();
    (first / CELL, second)
}

/// Words that are kept are small ones; these are spread over all numbers (by an odd factor, so that none is lost).
fn spread(word: u32) -> u32 {
    word.wrapping_mul(0x9e37_79b1)
}

fn prefix(word: u32, bits: u32) -> usize {
    (spread(word) >> (32 - bits)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn star(word: u32, shape: u8) -> Star {
        Star::new(word, [f64::from(shape) / 128.0; 8])
    }

    proptest! {
        #[test]
        fn an_original_shares_all_of_its_stars_with_itself_and_none_of_others(words in prop::collection::btree_set(any::<u32>(), 2..60)) {
            let words: Vec<u32> = words.into_iter().collect();
            let (own, others) = words.split_at(words.len() / 2);
            let stars = |words: &[u32]| words.iter().map(|&word| star(word, 9)).collect::<Vec<Star>>();
            let index = Tessellations::of(&[stars(own), stars(others)]);
            let shared = index.shared(&stars(own), &Job::default()).unwrap();
            prop_assert_eq!((shared[0].words, shared[1].words), (own.len() as u32, 0));
            prop_assert_eq!(shared[0].alike, own.len() as f32);
        }
    }

    fn scores(originals: &[Vec<Star>], suspect: &[Star]) -> Vec<f64> {
        let shared = Tessellations::of(originals).shared(suspect, &Job::default());
        shared.unwrap().iter().map(Shared::score).collect()
    }

    #[test]
    fn of_two_with_the_same_triangles_the_one_with_the_same_shapes_is_nearer() {
        let of = |shape: u8| (0..20).map(|word| star(word, shape)).collect::<Vec<Star>>();
        let scores = scores(&[of(100), of(104), of(120)], &of(100));
        assert_eq!(scores[0], 1.0);
        assert!(scores[1] < 0.7, "{scores:?}");
        assert!(scores[2] < 0.9 * scores[1], "{scores:?}");
    }

    #[test]
    fn words_that_nobody_else_has_tell_whatever_their_shapes_are() {
        let of = |words: std::ops::Range<u32>, shape: u8| {
            words.map(|word| star(word, shape)).collect::<Vec<Star>>()
        };
        let (own, suspect) = (of(0..60, 100), of(0..60, 200));
        assert!(scores(&[own.clone(), of(30..90, 100)], &suspect)[0] > 0.5);
        assert!(scores(&vec![own.clone(); 300], &suspect)[0] < 0.15);
        // A third of an original's words are little, and so are a few.
        assert!(
            scores(&[own, of(0..10, 100)], &of(0..20, 200))
                .iter()
                .all(|&score| score < 0.25)
        );
    }

    #[test]
    fn shapes_that_all_have_say_little() {
        let of = |shape: u8| (0..20).map(|word| star(word, shape)).collect::<Vec<Star>>();
        assert!(scores(&vec![of(7); 900], &of(7))[0] < 0.05);
    }

    #[test]
    fn few_stars_that_are_the_same_outweigh_many_that_are_like() {
        let of = |shape: u8| (0..60).map(|word| star(word, shape)).collect::<Vec<Star>>();
        let mut cropped = of(150);
        (0..12).for_each(|word| cropped[word as usize] = star(word, 100));
        let scores = scores(&[cropped, of(102)], &of(100));
        assert!(scores[0] > 0.8 && scores[0] > scores[1], "{scores:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn of_a_word_that_very_many_have_the_same_shapes_are_found(place in 0..COMPARED, steps in prop::array::uniform8(-2..=2_i32), seed in any::<u64>()) {
            let mut state = seed;
            // Six values two steps of 12 bits apart, so that some shapes are the same by chance (Knuth's generator).
            let mut number = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 % 6.0 / 1024.0 + 0.5
            };
            let mut numbers = || std::array::from_fn(|_| number());
            let shapes: Vec<[f64; 8]> = (0..=COMPARED).map(|_| numbers()).collect();
            let originals: Vec<Vec<Star>> = shapes.iter().map(|&shape| vec![Star::new(5, shape)]).collect();
            let suspect = Star::new(5, std::array::from_fn(|i| shapes[place][i] + f64::from(steps[i]) / 2048.0));
            let shared = Tessellations::of(&originals).shared(&[suspect, Star::new(5, [1.5; 8])], &Job::default()).unwrap();
            for (shared, stars) in shared.iter().zip(&originals) {
                prop_assert_eq!(shared.words == 1, suspect.is_same(&stars[0]));
                prop_assert_eq!(shared.words == 1, shared.same > 0.0);
            }
        }
    }

    #[test]
    fn few_words_in_common_are_little() {
        assert!(scores(&[vec![star(5, 1)]], &[star(5, 1)])[0] < 0.2);
        assert!(scores(&[], &[star(5, 1)]).is_empty());
    }
}
