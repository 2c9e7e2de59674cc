//! Which originals have the words of a suspect's places.
//!
//! For each word stands a list of the originals that have it, with how many of their places do. To a place of a suspect that finds c of an original's places within its words' cells the original gives probability in
//! proportion to c + α: the logarithms add up, as if places were independent (naive Bayes with Laplace's smoothing), less those of the mean of all originals, so that sizes can be compared. Who has all words of the world has few
//! places for each, and gains little by it.

use std::{ops::Range, sync::OnceLock};

use job::{Job, JobError};

use super::first_by;
use crate::descriptor::{Sought, WORDS};

/// α.
const SMOOTHING: f64 = 1.0;

/// Sizes that are so many steps apart are told apart.
const APART: usize = 3;

/// How many postings are visited for a size: the places whose words are rarest come first, which say most, so that the time of a search does not grow without bound.
const VISITED: usize = 2_000_000;

/// Originals whose sums are made at a time: so few that these stay in a core's own memory.
const BLOCK: usize = 4096;

/// Originals by words.
#[derive(Debug)]
pub(super) struct Votes {
    blocks: Vec<Block>,
    /// How many originals have a word, and how many places all of them have for it.
    having: Vec<u32>,
    places: Vec<u64>,
    count: usize,
}

/// Up to [`BLOCK`] originals by words.
#[derive(Debug)]
struct Block {
    starts: Vec<u32>,
    /// The number of an original in its block, and how many of its places have the word, 255 at most.
    originals: Vec<u16>,
    counts: Vec<u8>,
    count: usize,
}

/// How much speaks for an original, and in which size of the suspect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vote {
    pub(super) original: usize,
    pub(super) size: usize,
    pub(super) score: f32,
}

impl Default for Votes {
    /// Of no original.
    fn default() -> Self {
        Self::of(&[])
    }
}

impl Votes {
    /// Of the words of each original's places, sorted.
    pub(super) fn of(words: &[Vec<u16>]) -> Self {
        let blocks: Vec<Block> = words.chunks(BLOCK).map(Block::of).collect();
        let (mut having, mut places) = (vec![0; WORDS], vec![0; WORDS]);
        for word in 0..WORDS {
            for block in &blocks {
                let counts = &block.counts[block.with(word as u16)];
                having[word] += counts.len() as u32;
                places[word] += counts.iter().map(|&count| u64::from(count)).sum::<u64>();
            }
        }
        Self {
            blocks,
            having,
            places,
            count: words.len(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let of_blocks = self
            .blocks
            .iter()
            .map(|block| 4 * block.starts.len() + 3 * block.originals.len());
        of_blocks.sum::<usize>() + 12 * self.having.len()
    }

    /// What speaks for each original, in its likeliest size and in the likeliest of those that are [`APART`] from it; so many times fewer postings are visited.
    pub(super) fn of_all(
        &self,
        sizes: &[Sought],
        fewer: usize,
        job: &Job,
    ) -> Result<Vec<[Vote; 2]>, JobError> {
        let asked = sizes.iter().map(|sought| self.asked(sought, VISITED / fewer));
        let asked: Vec<Asked<'_>> = asked.collect();
        let scores = job.map(self.blocks.len() * sizes.len(), 1, |i| {
            let (block, size) = (i / sizes.len(), i % sizes.len());
            self.blocks[block].scores(&asked[size])
        })?;
        job.go_on()?;
        let of_block = |block: usize| {
            let scores = &scores[block * sizes.len()..][..sizes.len()];
            let of_one = |i: usize| likeliest(block * BLOCK + i, |size| scores[size][i], sizes.len());
            (0..self.blocks[block].count).map(of_one).collect::<Vec<_>>()
        };
        let votes = job.map(self.blocks.len(), 1, of_block)?;
        job.go_on()?;
        Ok(votes.into_iter().flatten().collect())
    }

    /// The votes for which most speaks, the most first.
    pub(super) fn most(votes: &[[Vote; 2]], most: usize) -> Vec<Vote> {
        let second = |[a, b]: &[Vote; 2]| (a.size != b.size).then_some(*b);
        let of_one = |votes: &[Vote; 2]| [Some(votes[0]), second(votes)];
        first_by(votes.iter().flat_map(of_one).flatten(), most, |a, b| {
            let order = b.score.total_cmp(&a.score);
            order.then((a.original, a.size).cmp(&(b.original, b.size)))
        })
    }

    /// The places of a suspect that are looked up, and what the mean of all originals has of them.
    fn asked<'a>(&self, sought: &'a Sought, most: usize) -> Asked<'a> {
        let sum = |words: &[u16], of: &dyn Fn(usize) -> u64| -> u64 {
            words.iter().map(|&word| of(usize::from(word))).sum()
        };
        let cost = |words: &[u16]| sum(words, &|word| self.having[word].into()) as usize;
        let mut places: Vec<(usize, &[u16])> = sought
            .words
            .iter()
            .map(|words| (cost(words), words.as_slice()))
            .collect();
        places.sort_by_key(|(cost, _)| *cost);
        let mut visited = 0;
        let is_asked = |(cost, _): &&(usize, &[u16])| {
            visited += cost;
            visited <= most || visited == *cost
        };
        let places: Vec<&[u16]> = places
            .iter()
            .take_while(is_asked)
            .map(|(_, words)| *words)
            .collect();
        let expected = |words: &&[u16]| {
            let all = sum(words, &|word| self.places[word]);
            (1.0 + all as f64 / self.count.max(1) as f64 / SMOOTHING).ln()
        };
        Asked {
            expected: places.iter().map(expected).sum::<f64>() as f32,
            places,
        }
    }
}

/// The vote for an original in its likeliest size, and in the likeliest of those that are [`APART`] from it.
fn likeliest(original: usize, score: impl Fn(usize) -> f32, sizes: usize) -> [Vote; 2] {
    let nothing = Vote {
        original,
        size: 0,
        score: f32::NEG_INFINITY,
    };
    let mut best = nothing;
    for size in 0..sizes {
        if score(size) > best.score {
            (best.size, best.score) = (size, score(size));
        }
    }
    let mut other = nothing;
    for size in (0..sizes).filter(|size| size.abs_diff(best.size) >= APART) {
        if score(size) > other.score {
            (other.size, other.score) = (size, score(size));
        }
    }
    match other.score > f32::NEG_INFINITY {
        true => [best, other],
        false => [best, best],
    }
}

/// What is asked of a suspect in some size.
struct Asked<'a> {
    /// The words of its places.
    places: Vec<&'a [u16]>,
    expected: f32,
}

impl Block {
    fn of(words: &[Vec<u16>]) -> Self {
        let mut starts = vec![0_u32; WORDS + 1];
        for of_one in words.iter().flat_map(|words| words.chunk_by(u16::eq)) {
            starts[usize::from(of_one[0]) + 1] += 1;
        }
        for i in 0..WORDS {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut originals = vec![0; starts[WORDS] as usize];
        let mut counts = vec![0; starts[WORDS] as usize];
        for (original, words) in words.iter().enumerate() {
            for of_one in words.chunk_by(u16::eq) {
                let place = &mut next[usize::from(of_one[0])];
                originals[*place as usize] = original as u16;
                counts[*place as usize] = u8::try_from(of_one.len()).unwrap_or(u8::MAX);
                *place += 1;
            }
        }
        Self {
            starts,
            originals,
            counts,
            count: words.len(),
        }
    }

    /// What speaks for each of its originals.
    fn scores(&self, asked: &Asked<'_>) -> Vec<f32> {
        let gains = gains();
        let mut scores = [0_f32; BLOCK];
        let mut sums = [0_u16; BLOCK];
        for words in &asked.places {
            for &word in *words {
                let range = self.with(word);
                for (&original, &count) in self.originals[range.clone()].iter().zip(&self.counts[range]) {
                    sums[usize::from(original) % BLOCK] += u16::from(count);
                }
            }
            // Whoever has several of the words gains once: its count is none from then on.
            for &word in *words {
                for &original in &self.originals[self.with(word)] {
                    let original = usize::from(original) % BLOCK;
                    scores[original] += gains[usize::from(std::mem::take(&mut sums[original])) % COUNTS];
                }
            }
        }
        let scores = &scores[..self.count];
        scores.iter().map(|score| score - asked.expected).collect()
    }

    /// Which postings are of a word.
    fn with(&self, word: u16) -> Range<usize> {
        let word = usize::from(word);
        self.starts[word] as usize..self.starts[word + 1] as usize
    }
}

/// Counts are smaller: a place has at most sixteen words.
const COUNTS: usize = 16 << u8::BITS;

/// ln (1 + c / α) for every count c.
fn gains() -> &'static [f32; COUNTS] {
    static GAINS: OnceLock<[f32; COUNTS]> = OnceLock::new();
    GAINS.get_or_init(|| std::array::from_fn(|count| (1.0 + count as f64 / SMOOTHING).ln() as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sought(words: &[u16]) -> Sought {
        Sought {
            places: [Vec::new(), Vec::new()],
            words: words.iter().map(|&word| vec![word]).collect(),
            samples: Vec::new(),
        }
    }

    fn scores(votes: &Votes, words: &[u16]) -> Vec<f32> {
        let all = votes.of_all(&[sought(words)], 1, &Job::default()).unwrap();
        all.iter().map(|votes| votes[0].score).collect()
    }

    #[test]
    fn who_has_the_suspects_words_wins_in_the_size_in_which_it_has_them() {
        let votes = Votes::of(&[vec![1, 2, 3, 4], vec![5, 6, 7, 8], vec![1, 5, 9, 10]]);
        let sizes = [sought(&[11, 12, 13]), sought(&[5, 6, 7]), sought(&[14, 15, 16])];
        let most = Votes::most(&votes.of_all(&sizes, 1, &Job::default()).unwrap(), 2);
        assert_eq!((most[0].original, most[0].size), (1, 1));
        assert!(most[0].score > most[1].score);
    }

    #[test]
    fn a_word_that_all_have_speaks_for_nobody() {
        let votes = Votes::of(&vec![vec![7, 7]; 5]);
        let scores = scores(&votes, &[7, 7, 7]);
        assert!(scores.iter().all(|score| score.abs() < 1e-5), "{scores:?}");
    }

    #[test]
    fn a_second_place_with_a_word_adds_less_than_the_first() {
        let votes = Votes::of(&[vec![], vec![3], vec![3, 3]]);
        let scores = scores(&votes, &[3]);
        let (first, second) = (scores[1] - scores[0], scores[2] - scores[1]);
        assert!((first - 2_f32.ln()).abs() < 1e-5);
        assert!((second - 1.5_f32.ln()).abs() < 1e-5);
    }

    #[test]
    fn what_speaks_for_an_original_does_not_depend_on_where_it_stands() {
        let kinds = [vec![1, 2], vec![2, 2, 3], vec![4], vec![1, 4, 4, 5], vec![]];
        let words: Vec<Vec<u16>> = kinds.iter().cycle().take(3 * BLOCK + 7).cloned().collect();
        let scores = scores(&Votes::of(&words), &[1, 2, 4, 2]);
        assert_eq!(scores.len(), words.len());
        for (i, score) in scores.iter().enumerate() {
            assert_eq!(*score, scores[i % kinds.len()]);
        }
        assert!(scores[0] > scores[2] && scores[2] > scores[4]);
    }

    #[test]
    fn an_empty_library_has_no_votes() {
        let votes = Votes::default().of_all(&[sought(&[1])], 1, &Job::default());
        assert!(votes.unwrap().is_empty());
    }
}
