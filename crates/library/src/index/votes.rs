//! Which originals have the words of a suspect's places.
//!
//! For each word stands a list of the originals that have it, with how many of their places do. To a place of a suspect that finds c of an original's places within its words' cells the original gives probability in
//! proportion to c + α: the logarithms add up, as if places were independent (naive Bayes with Laplace's smoothing), less those of the mean of all originals, so that sizes can be compared. Who has all words of the world has few
//! places for each, and gains little by it.

use job::{Job, JobError};

use crate::descriptor::{Sought, WORDS};

/// α.
const SMOOTHING: f64 = 1.0;

/// Sizes that are so many steps apart are told apart.
const APART: usize = 3;

/// Bits of how many of an original's places have a word.
const COUNT_BITS: u32 = 8;

/// Originals by words.
#[derive(Debug, Default)]
pub(super) struct Votes {
    starts: Vec<u32>,
    /// The number of an original, and in the last bits the count.
    postings: Vec<u32>,
    count: usize,
}

/// How much speaks for an original, and in which size of the suspect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vote {
    pub(super) original: usize,
    pub(super) size: usize,
    pub(super) score: f32,
}

impl Votes {
    /// Of the words of each original's places, sorted.
    pub(super) fn of(words: &[Vec<u16>]) -> Self {
        let mut starts = vec![0_u32; WORDS + 1];
        for of_one in words.iter().flat_map(|words| words.chunk_by(u16::eq)) {
            starts[usize::from(of_one[0]) + 1] += 1;
        }
        for i in 0..WORDS {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut postings = vec![0; starts[WORDS] as usize];
        for (original, words) in words.iter().enumerate() {
            for of_one in words.chunk_by(u16::eq) {
                let place = &mut next[usize::from(of_one[0])];
                let count = of_one.len().min((1 << COUNT_BITS) - 1) as u32;
                postings[*place as usize] = (original as u32) << COUNT_BITS | count;
                *place += 1;
            }
        }
        Self {
            starts,
            postings,
            count: words.len(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        4 * (self.starts.len() + self.postings.len())
    }

    /// The originals for which most speaks, each in its likeliest size and in the likeliest of those that are [`APART`] from it.
    pub(super) fn most(&self, sizes: &[Sought], most: usize, job: &Job) -> Result<Vec<Vote>, JobError> {
        let scores = job.map(sizes.len(), 1, |size| self.scores(&sizes[size]))?;
        let mut votes = Vec::new();
        for original in 0..self.count {
            let score = |size: usize| scores[size][original];
            let likeliest = |is_asked: &dyn Fn(usize) -> bool| {
                let asked = (0..sizes.len()).filter(|&size| is_asked(size));
                asked.max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a)))
            };
            let Some(first) = likeliest(&|_| true) else {
                continue;
            };
            let second = likeliest(&|size| size.abs_diff(first) >= APART);
            votes.extend([Some(first), second].into_iter().flatten().map(|size| Vote {
                original,
                size,
                score: score(size),
            }));
        }
        let by = |a: &Vote, b: &Vote| {
            let order = b.score.total_cmp(&a.score);
            order.then((a.original, a.size).cmp(&(b.original, b.size)))
        };
        if most < votes.len() {
            votes.select_nth_unstable_by(most, by);
            votes.truncate(most);
        }
        votes.sort_by(by);
        Ok(votes)
    }

    fn scores(&self, sought: &Sought) -> Vec<f32> {
        let mut scores = vec![0_f32; self.count];
        let mut counts = vec![0_u32; self.count];
        let mut found: Vec<u32> = Vec::new();
        let gain = |count: f64| (1.0 + count / SMOOTHING).ln() as f32;
        let mut expected = 0.0;
        for words in &sought.words {
            let mut all = 0_u64;
            for &word in words {
                let word = usize::from(word);
                for posting in &self.postings[self.starts[word] as usize..self.starts[word + 1] as usize] {
                    let (original, count) = (posting >> COUNT_BITS, posting & ((1 << COUNT_BITS) - 1));
                    let sum = &mut counts[original as usize];
                    if *sum == 0 {
                        found.push(original);
                    }
                    *sum += count;
                    all += u64::from(count);
                }
            }
            for original in found.drain(..) {
                scores[original as usize] += gain(f64::from(counts[original as usize]));
                counts[original as usize] = 0;
            }
            expected += gain(all as f64 / self.count.max(1) as f64);
        }
        scores.iter_mut().for_each(|score| *score -= expected);
        scores
    }
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

    #[test]
    fn who_has_the_suspects_words_wins_in_the_size_in_which_it_has_them() {
        let votes = Votes::of(&[vec![1, 2, 3, 4], vec![5, 6, 7, 8], vec![1, 5, 9, 10]]);
        let sizes = [sought(&[11, 12, 13]), sought(&[5, 6, 7]), sought(&[14, 15, 16])];
        let most = votes.most(&sizes, 2, &Job::default()).unwrap();
        assert_eq!((most[0].original, most[0].size), (1, 1));
        assert!(most[0].score > most[1].score);
    }

    #[test]
    fn a_word_that_all_have_speaks_for_nobody() {
        let votes = Votes::of(&vec![vec![7, 7]; 5]);
        let scores = votes.scores(&sought(&[7, 7, 7]));
        assert!(scores.iter().all(|score| score.abs() < 1e-5), "{scores:?}");
    }

    #[test]
    fn a_second_place_with_a_word_adds_less_than_the_first() {
        let votes = Votes::of(&[vec![], vec![3], vec![3, 3]]);
        let scores = votes.scores(&sought(&[3]));
        let (first, second) = (scores[1] - scores[0], scores[2] - scores[1]);
        assert!((first - 2_f32.ln()).abs() < 1e-5);
        assert!((second - 1.5_f32.ln()).abs() < 1e-5);
    }

    #[test]
    fn an_empty_library_has_no_votes() {
        assert!(
            Votes::of(&[])
                .most(&[sought(&[1])], 3, &Job::default())
                .unwrap()
                .is_empty()
        );
    }
}
