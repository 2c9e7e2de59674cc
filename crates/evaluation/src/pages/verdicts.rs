//! What Sigmark's verifier says of the meshes of Fig. 11, counted.

use crate::{
    results::{Results, Trial},
    study::product::{SIGMARK, SIGMARK_TAG, VERIFIER},
};

/// The least that counts as beyond doubt here.
const CERTAIN: f64 = 1e-12;

/// One marked and one unmarked mesh for each model and attack of Tables 4 and 5, and one with a tag.
pub(super) struct Verdicts {
    /// (verified, p) of each marked mesh.
    marked: Vec<(bool, f64)>,
    /// Whether the tag of each is verified.
    tags: Vec<bool>,
    /// p of each unmarked mesh, ascending.
    unmarked: Vec<f64>,
}

impl Verdicts {
    pub(super) fn of(results: &Results) -> Self {
        let (mut marked, mut tags, mut unmarked) = (Vec::new(), Vec::new(), Vec::new());
        for (outcome, column) in results.columns() {
            let in_figure = |trial: &&Trial| outcome.model.attacks().any(|attack| attack == trial.attack);
            for trial in column.trials.iter().filter(in_figure) {
                for rated in trial.rated(&VERIFIER) {
                    let verdict = (rated.verified, rated.p_value);
                    if column.algorithm == SIGMARK_TAG {
                        tags.push(rated.verified);
                    } else if column.algorithm == SIGMARK && trial.target.is_first() {
                        marked.push(verdict);
                    } else if column.algorithm == SIGMARK && !trial.target.is_marked {
                        unmarked.push(rated.p_value);
                    }
                }
            }
        }
        unmarked.sort_by(f64::total_cmp);
        Self {
            marked,
            tags,
            unmarked,
        }
    }

    /// A few sentences.
    pub(super) fn in_words(&self) -> String {
        let count =
            |is: &dyn Fn(&(bool, f64)) -> bool| self.marked.iter().filter(|verdict| is(verdict)).count();
        let largest = self.marked.iter().map(|(_, p)| *p).fold(0.0, f64::max);
        let tags = match self.tags.len() {
            0 => String::new(),
            of => format!(
                " Where a tag is written in its place, it is verified in {} of {of}.",
                self.tags.iter().filter(|verified| **verified).count()
            ),
        };
        format!(
            "Of {} marked meshes the whole signature is verified in {}, and p < 10⁻¹² in {}; the largest p is {}.{tags} {}",
            self.marked.len(),
            count(&|(verified, _)| *verified),
            count(&|(_, p)| *p < CERTAIN),
            in_words(largest),
            self.chance_in_words(),
        )
    }

    fn chance_in_words(&self) -> String {
        let Some(smallest) = self.unmarked.first() else {
            return String::new();
        };
        let count = self.unmarked.len();
        let excess = match self.excess() {
            excess if excess > 0.0 => format!(
                "Below some p lie {excess:.1} more of them than are expected; chance has {:.1} more one time in twenty",
                most_by_chance(count)
            ),
            _ => "Below no p lie more of them than are expected".into(),
        };
        format!(
            "Of {count} unmarked meshes, each read as if it had the mark, the smallest p is {}, where chance has one below {}. {excess}.",
            in_words(*smallest),
            in_words(1.0 / count as f64)
        )
    }

    /// By how many unmarked meshes there are more below a p than are expected, at the p where that is most; 0 at least.
    fn excess(&self) -> f64 {
        let count = self.unmarked.len() as f64;
        let excesses = (1..)
            .zip(&self.unmarked)
            .map(|(below, p)| f64::from(below) - count * p);
        excesses.fold(0.0, f64::max)
    }
}

/// A probability.
fn in_words(p: f64) -> String {
    match p < 1e-3 {
        true => format!("{p:.1e}"),
        false => format!("{p:.3}"),
    }
}

/// The excess that so many meshes have one time in twenty at most (Massart 1990).
fn most_by_chance(count: usize) -> f64 {
    (count as f64 * 20_f64.ln() / 2.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdicts(unmarked: Vec<f64>) -> Verdicts {
        Verdicts {
            marked: vec![(true, 1e-90), (false, 1e-30), (false, 2e-3)],
            tags: vec![true, false],
            unmarked,
        }
    }

    #[test]
    fn what_is_read_is_counted() {
        let words = verdicts(vec![0.4, 1.0]).in_words();
        assert!(words.starts_with(
            "Of 3 marked meshes the whole signature is verified in 1, and p < 10⁻¹² in 2; the largest p is 0.002. Where a tag is written in its place, \
             it is verified in 1 of 2. Of 2 unmarked meshes"
        ));
        assert!(words.contains("the smallest p is 0.400, where chance has one below 0.500"));
    }

    #[test]
    fn more_small_p_than_chance_has_are_told() {
        assert_eq!(verdicts(vec![0.5, 1.0]).excess(), 0.0);
        assert!(
            verdicts(vec![0.5, 1.0])
                .in_words()
                .ends_with("Below no p lie more of them than are expected.")
        );
        let many = verdicts(vec![0.01, 0.02, 0.03, 1.0]);
        assert!((many.excess() - (3.0 - 4.0 * 0.03)).abs() < 1e-12);
        assert!(many.in_words().contains("Below some p lie 2.9 more of them"));
        assert!((most_by_chance(74) - 10.53).abs() < 0.01);
    }
}
