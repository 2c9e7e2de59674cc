//! Which originals have the words of a suspect's places.
//!
//! For each word stands a list of the originals that have it, with how many of their places do. To a place of a suspect that finds c of an original's places within its words' cells the original gives probability in
//! proportion to c + α: the logarithms add up, as if places were independent (naive Bayes with Laplace's smoothing), less those of the mean of all originals, so that sizes can be compared. Who has all words of the world has few
//! places for each, and gains little by it.

use std::sync::OnceLock;

use job::{Job, JobError};

use crate::descriptor::{Sought, WORDS};

/// α.
const SMOOTHING: f64 = 1.0;

/// Sizes that are so many steps apart are told apart.
const APART: usize = 3;

/// How many postings are visited for a size: the places whose words are rarest come first, which say most, so that the time of a search does not grow without bound.
const VISITED: usize = 2_000_000;

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

    /// What speaks for each original, in its likeliest size and in the likeliest of those that are [`APART`] from it.
    pub(super) fn of_all(&self, sizes: &[Sought], job: &Job) -> Result<Vec<[Vote; 2]>, JobError> {
        let scores = job.map(sizes.len(), 1, |size| self.scores(&sizes[size]))?;
        job.go_on()?;
        let of_one = |original: usize| {
            let vote = |size: usize| Vote {
                original,
                size,
                score: scores[size][original],
            };
            let likeliest = |is_asked: &dyn Fn(usize) -> bool| {
                let asked = (0..sizes.len()).filter(|&size| is_asked(size)).map(vote);
                asked.max_by(|a, b| a.score.total_cmp(&b.score).then(b.size.cmp(&a.size)))
            };
            let first = likeliest(&|_| true).unwrap_or(vote(0));
            let second = likeliest(&|size| size.abs_diff(first.size) >= APART);
            [first, second.unwrap_or(first)]
        };
        Ok((0..self.count).map(of_one).collect())
    }

    /// The votes for which most speaks, the most first.
    pub(super) fn most(votes: &[[Vote; 2]], most: usize) -> Vec<Vote> {
        let second = |[a, b]: &[Vote; 2]| (a.size != b.size).then_some(*b);
        let of_one = |votes: &[Vote; 2]| [Some(votes[0]), second(votes)];
        let mut votes: Vec<Vote> = votes.iter().flat_map(of_one).flatten().collect();
        let by = |a: &Vote, b: &Vote| {
            let order = b.score.total_cmp(&a.score);
            order.then((a.original, a.size).cmp(&(b.original, b.size)))
        };
        if most < votes.len() {
            votes.select_nth_unstable_by(most, by);
            votes.truncate(most);
        }
        votes.sort_by(by);
        votes
    }

    fn scores(&self, sought: &Sought) -> Vec<f32> {
        let gains = gains();
        let gain = |count: u32| gains[(count as usize).min(gains.len() - 1)];
        let mut scores = vec![0_f32; self.count];
        let mut counts = vec![0_u32; self.count];
        let mut found: Vec<u32> = Vec::new();
        let mut expected = 0.0;
        let cost = |words: &[u16]| words.iter().map(|&word| self.with(word).len()).sum::<usize>();
        let mut places: Vec<(usize, &Vec<u16>)> =
            sought.words.iter().map(|words| (cost(words), words)).collect();
        places.sort_by_key(|(cost, _)| *cost);
        let mut visited = 0;
        for (cost, words) in places {
            visited += cost;
            if visited > VISITED && visited > cost {
                break;
            }
            let mut all = 0_u64;
            for &word in words {
                for posting in self.with(word) {
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
                scores[original as usize] += gain(counts[original as usize]);
                counts[original as usize] = 0;
            }
            expected += (1.0 + all as f64 / self.count.max(1) as f64 / SMOOTHING).ln();
        }
        scores.iter_mut().for_each(|score| *score -= expected as f32);
        scores
    }

    fn with(&self, word: u16) -> &[u32] {
        let word = usize::from(word);
        &self.postings[self.starts[word] as usize..self.starts[word + 1] as usize]
    }
}

/// ln (1 + c / α) for every count c.
fn gains() -> &'static [f32] {
    static GAINS: OnceLock<Vec<f32>> = OnceLock::new();
    GAINS.get_or_init(|| {
        let gain = |count: u32| (1.0 + f64::from(count) / SMOOTHING).ln() as f32;
        (0..1 << 12).map(gain).collect()
    })
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
        let most = Votes::most(&votes.of_all(&sizes, &Job::default()).unwrap(), 2);
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
                .of_all(&[sought(&[1])], &Job::default())
                .unwrap()
                .is_empty()
        );
    }
}
