//! The page of the security.

use anyhow::Result;
use evaluation::{machine, python::Python, sources, table::Table};
use sigmark::claim::EVIDENCE;

use super::{
    bounds::{CONFIDENCE, is_refuted, upper_bound},
    null::{LEVELS, NullPair},
    removal::{ReadMark, Removal},
};
use crate::results;

/// Writes the page and its CSV files. `code`: the digest of what the figures depend on.
pub(super) fn write(removals: &[Removal], pairs: &[NullPair], attacks: &Python, code: &str) -> Result<()> {
    let results = results::folder()?;
    let (removal, by_suspect) = (removal_table(removals), by_suspect(pairs));
    removal.write_csv(&results.join("security_removal.csv"))?;
    by_pair(pairs).write_csv(&results.join("security_null.csv"))?;
    let page = format!(
        "# Removing the mark, and finding it where it is not\n\nWritten by `cargo xtask bench security`. What a verdict means is said in [SECURITY.md](../SECURITY.md).\n\n{}\n{}\n{}\n{}\n{}\n{}{}, {}; {}. Code {}, sources' digest {code}.\n",
        removal_words(),
        missed(removals),
        removal.markdown(),
        null_words(pairs),
        levels(pairs).markdown(),
        by_suspect.markdown(),
        machine::description(),
        attacks.versions()?,
        machine::load(),
        sources::commit(),
    );
    results::write_page(&results.join("security.md"), &page)
}

fn removal_words() -> String {
    let left = |copies: f64| (2048.0 * 1.5 / (copies + 0.5)).sqrt();
    let (two, three, five, ten) = (left(2.0), left(3.0), left(5.0), left(10.0));
    format!(
        "## Removal\n\nEach model is marked as `sigmark embed` does it by default (P-256, 512 bits as a codeword of 2048, in 3072 chips where there is room), attacked, and read by the code of `sigmark verify` (ours: the joint estimate), and by the \
         paper's rule in the same pose. p counts all readings that the best was taken of; evidence is p ≤ 2⁻¹²⁰ = {EVIDENCE:.1e}. *Moved* is by how much the attack moved vertices beside the mark (root mean square, per cent of the diagonal). \
         *Random chips* change every coefficient of the mark by a multiple of its energy, with random signs and in the owner's own basis, which nobody else has. *Overwritten* is by strangers' marks on \
         the published model, each with a key of its own, at multiples of the mark's amplitude. *Averages* are of copies for as many recipients, and one is looked for. *Distance field* is a new surface \
         from MeshLab's signed distances by marching cubes, with so many cells along the longest edge of the bounding box.\n\n\
         In an average of n copies the other marks are noise of n − 1 times the energy of the one that is looked for. Each has an order of chips of its own, so that in the sum of a bit's k chips they add up like noise, and T is about √(l k / (k + n − 1)): \
         {two:.1}, {three:.1}, {five:.1} and {ten:.1} for n = 2, 3, 5, 10 with l = 2048 code bits of 1.5 chips each. Evidence takes 12.96.\n"
    )
}

/// What was asked and not reached, or that there is nothing.
fn missed(removals: &[Removal]) -> String {
    let asked = removals
        .iter()
        .filter_map(|removal| Some((removal, removal.asked()?)));
    let asked: Vec<(&Removal, f64)> = asked.collect();
    if asked.is_empty() {
        return "Nothing is asked of these models: what is asked is of the bunny.\n".into();
    }
    let mut text = format!(
        "In {} attacks the bunny has to reach the p under *asked*. ",
        asked.len()
    );
    let missed: Vec<&(&Removal, f64)> = asked.iter().filter(|(removal, _)| removal.is_missed()).collect();
    if missed.is_empty() {
        return text + "All is reached.\n";
    }
    text += &format!("**Missed: {} of {}.**\n\n", missed.len(), asked.len());
    for (removal, asked) in missed {
        let Removal { attack, ours, .. } = removal;
        text += &format!("- {attack}: p = {}, asked for {}\n", shown(ours.p), shown(*asked));
    }
    text
}

fn shown(p: f64) -> String {
    match p {
        0.01.. => format!("{p:.2}"),
        _ => format!("{p:.0e}"),
    }
}

fn removal_table(removals: &[Removal]) -> Table {
    let header = "model | attack | moved (%) | T | p | asked | right (%) | verdict | evidence | paper's rule: T | p | right | verdict | evidence";
    let mut table = Table::new("Marks that were attacked", header.split(" | "));
    for removal in removals {
        let first = [
            removal.model.clone(),
            removal.attack.clone(),
            removal
                .moved
                .map_or_else(String::new, |moved| format!("{:.3}", 100.0 * moved)),
        ];
        let [t, p, right, verdict, evidence] = entries(&removal.ours);
        let asked = removal.asked().map_or_else(String::new, shown);
        let ours = [t, p, asked, right, verdict, evidence];
        table.row(first.into_iter().chain(ours).chain(entries(&removal.paper)));
    }
    table
}

fn entries(read: &ReadMark) -> [String; 5] {
    [
        format!("{:.1}", read.correlation),
        shown(read.p),
        format!("{:.1}", 100.0 * read.right),
        read.outcome.clone(),
        if read.is_evidence { "yes" } else { "no" }.into(),
    ]
}

fn null_words(pairs: &[NullPair]) -> String {
    let trials: usize = pairs.iter().map(|pair| pair.trials).sum();
    let read = pairs.iter().filter(|pair| pair.tries.is_some()).count();
    format!(
        "## Where there is no mark\n\n{trials} random strings of as many bits as the mark has were looked for in {} pairs of an original and a suspect that was never marked for it, each moved at random; in {read} pairs the suspect \
         was read, in the others it does not lie on the original, and p is 1. p is computed as `sigmark verify` does. The signature is the only thing that chance draws in the claim of the p-value, so it is \
         what trials draw. Sphere and block lie on themselves in many ways. The upper bound is Clopper's and Pearson's, at {:.1} %. The claim *holds* where the bound is below a, is *not contradicted* where chance would give \
         so many with a probability of at least {:.1} %, and is *broken* otherwise.\n",
        pairs.len(),
        100.0 * CONFIDENCE,
        100.0 * (1.0 - CONFIDENCE),
    )
}

/// P(p ≤ a) ≤ a, over all pairs, and over those that were read.
fn levels(pairs: &[NullPair]) -> Table {
    let header = "a | pairs | trials | p ≤ a | share | upper bound | P(p ≤ a) ≤ a";
    let mut table = Table::new("p-values without a mark", header.split(" | "));
    let read: Vec<&NullPair> = pairs.iter().filter(|pair| pair.tries.is_some()).collect();
    for (of, pairs) in [("all", pairs.iter().collect()), ("read", read)] {
        let trials: usize = pairs.iter().map(|pair| pair.trials).sum();
        for (i, level) in LEVELS.into_iter().enumerate() {
            let count: usize = pairs.iter().map(|pair| pair.below[i]).sum();
            table.row([
                level.to_string(),
                of.into(),
                trials.to_string(),
                count.to_string(),
                share(count, trials),
                format!("{:.1e}", upper_bound(count, trials)),
                judged(level, count, trials).into(),
            ]);
        }
    }
    table
}

fn judged(level: f64, count: usize, trials: usize) -> &'static str {
    if upper_bound(count, trials) <= level {
        "holds"
    } else if is_refuted(level, count, trials) {
        "**broken**"
    } else {
        "not contradicted"
    }
}

fn share(count: usize, trials: usize) -> String {
    format!("{:.1e}", count as f64 / trials as f64)
}

/// A line for each kind of suspect.
fn by_suspect(pairs: &[NullPair]) -> Table {
    let shares = LEVELS.map(|level| format!("p ≤ {level}"));
    let header = ["suspect", "pairs", "read", "most tries", "trials"].map(String::from);
    let mut table = Table::new("By suspect", header.into_iter().chain(shares));
    let mut kinds: Vec<&str> = Vec::new();
    for pair in pairs {
        if !kinds.contains(&pair.suspect.as_str()) {
            kinds.push(&pair.suspect);
        }
    }
    for kind in kinds {
        let of_kind: Vec<&NullPair> = pairs.iter().filter(|pair| pair.suspect == kind).collect();
        let trials: usize = of_kind.iter().map(|pair| pair.trials).sum();
        let first = [
            kind.to_string(),
            of_kind.len().to_string(),
            of_kind.iter().filter_map(|pair| pair.tries).count().to_string(),
            of_kind
                .iter()
                .filter_map(|pair| pair.tries)
                .max()
                .unwrap_or(0)
                .to_string(),
            format!("{trials}"),
        ];
        let below = |i: usize| of_kind.iter().map(|pair| pair.below[i]).sum();
        let shares = (0..LEVELS.len()).map(|i| share(below(i), trials));
        table.row(first.into_iter().chain(shares));
    }
    table
}

/// A line for each pair.
fn by_pair(pairs: &[NullPair]) -> Table {
    let counts = LEVELS.map(|level| format!("p <= {level}"));
    let header = ["model", "suspect", "tries", "trials"].map(String::from);
    let mut table = Table::new("Pairs", header.into_iter().chain(counts));
    for pair in pairs {
        let first = [
            pair.model.clone(),
            pair.suspect.clone(),
            pair.tries.map_or_else(String::new, |tries| tries.to_string()),
            pair.trials.to_string(),
        ];
        table.row(first.into_iter().chain(pair.below.map(|count| count.to_string())));
    }
    table
}
