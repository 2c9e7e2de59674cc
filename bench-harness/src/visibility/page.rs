//! The page of what is seen.

use anyhow::Result;
use evaluation::{attacks::Attack, machine, python::Python, table::Table};

use super::{
    equal::{ALL_BITS, Equal, READ, READERS, Weighed},
    layouts::{SEAMED, TODAY, TODAY_EVEN, TODAY_REPEATED, TriedLayout},
    trial::{Outlasted, Read, Seen, Turn},
};
use crate::results;

/// How much further facets may turn at borders than inside, at the 99th percentile.
const ALLOWED: f64 = 1.2;

/// By which share T₀ may fall short of the seamed mark's.
const SHORT: f64 = 0.03;

/// What was measured.
#[derive(Default)]
pub(super) struct Page {
    pub(super) attacks: Vec<&'static Attack>,
    /// How often bits and attacks were drawn where little was read.
    pub(super) draws: u8,
    pub(super) seen: Vec<Seen>,
    /// Model, layout, why it can't be marked so.
    pub(super) refused: Vec<[String; 3]>,
    pub(super) outlasted: Vec<Outlasted>,
    pub(super) equal: Vec<Equal>,
}

impl Page {
    /// Writes the page and its CSV files. `code`: the digest of what the figures depend on.
    pub(super) fn write(&self, attacks: Option<&Python>, commit: &str, code: &str) -> Result<()> {
        let results = results::folder()?;
        let (seen, outlasted, equal) = (self.seen(), self.outlasted(), self.equal());
        seen.write_csv(&results.join("visibility.csv"))?;
        let mut parts = vec![seen.markdown(), self.rule()];
        if let Some(refused) = self.refused() {
            parts.push(refused);
        }
        if attacks.is_some() {
            outlasted.write_csv(&results.join("visibility_attacked.csv"))?;
            equal.write_csv(&results.join("visibility_equal.csv"))?;
            parts.extend([
                equal.markdown(),
                EQUAL.into(),
                outlasted.markdown(),
                self.shortfalls(TODAY_EVEN),
                self.shortfalls(TODAY_REPEATED),
            ]);
        }
        let versions = attacks.map(Python::versions).transpose()?;
        let page = format!(
            "# What one sees of a mark\n\nWritten by `cargo xtask bench visibility`.\n\n{WORDS} {}\n\n{}\n{}{}; {}. Code {commit}, sources' digest {code}.\n",
            self.drawn(),
            parts.join("\n"),
            machine::description(),
            versions.map_or_else(String::new, |versions| format!(", {versions}")),
            machine::load(),
        );
        results::write_page(&results.join("visibility.md"), &page)
    }

    fn seen(&self) -> Table {
        let header = [
            "model",
            "layout",
            "vertices",
            "patches",
            "harmonics (s)",
            "RMS (%)",
            "turn inside (median, 99 %, max)",
            "at borders",
            "99 % at borders to inside",
            "beyond 20° (no slivers)",
            "flipped",
            "MSDM2",
            "DAME",
        ];
        let mut table = Table::new("Turn of the facets, in degrees", header).text_columns(2);
        for seen in &self.seen {
            let [far, whole] = seen.far;
            table.row([
                seen.model.clone(),
                seen.layout.to_string(),
                seen.vertices.to_string(),
                seen.patches.to_string(),
                format!("{:.1}", seen.seconds),
                format!("{:.4}", 100.0 * seen.rms),
                turns(&seen.inside),
                turns(&seen.at_borders),
                ratio(seen).map_or("–".into(), |ratio| format!("{ratio:.2}")),
                format!("{far} ({whole})"),
                seen.flipped.to_string(),
                seen.look.msdm2.map_or("–".into(), |msdm2| format!("{msdm2:.3}")),
                format!("{:.4}", seen.look.dame),
            ]);
        }
        table
    }

    /// Which models break the rule for today's layout.
    fn rule(&self) -> String {
        let of_today = || self.seen.iter().filter(|seen| seen.layout == TODAY);
        let mut broken = Vec::new();
        for seen in of_today() {
            let mut what = Vec::new();
            if let Some(ratio) = ratio(seen).filter(|ratio| *ratio > ALLOWED) {
                what.push(format!(
                    "{ratio:.2} times as far at borders ({:.1}° and {:.1}°)",
                    seen.at_borders.p99, seen.inside.p99
                ));
            }
            if seen.far[1] > 0 {
                what.push(format!("{} beyond 20° that are no slivers", seen.far[1]));
            }
            if seen.flipped > 0 {
                what.push(format!("{} flipped", seen.flipped));
            }
            if !what.is_empty() {
                broken.push(format!("{}: {}", seen.model, what.join(", ")));
            }
        }
        let models = of_today().count();
        let verdict = match broken.is_empty() {
            true => format!("It holds on all {models}."),
            false => format!(
                "It holds on {} of {models}; not on {}.",
                models - broken.len(),
                broken.join("; ")
            ),
        };
        format!(
            "The rule for `{TODAY}`: at borders facets turn no more than {ALLOWED} times as far as inside (99th percentile), none flips, and none turns by more than 20° that is no sliver, \
             lower than a thousandth of its longest side or a millionth of the diagonal, which a file's rounding turns. {verdict}\n"
        )
    }

    /// What could not be marked.
    fn refused(&self) -> Option<String> {
        let lines: Vec<String> = self
            .refused
            .iter()
            .map(|[model, layout, why]| {
                let reason = why.split(';').next().unwrap_or_default();
                format!("{model} by `{layout}` ({reason})")
            })
            .collect();
        (!lines.is_empty()).then(|| format!("Without room for such a mark: {}.\n", lines.join("; ")))
    }

    fn drawn(&self) -> String {
        // One draw tells T₀ to ± 1.25 where there is little.
        let known = 25.0 / f64::from(self.draws).sqrt();
        format!(
            "Rates are means over three draws of bits and attacks, and where those have less than 10 of T₀, over {}: a T₀ of 40 is known to 3 %, one of 5 to {known:.0} %.",
            self.draws
        )
    }

    fn outlasted(&self) -> Table {
        let header = ["model", "layout"].into_iter().chain(self.names());
        let title = "Read after the attacks of Tables 4 and 5: T₀ (extraction rate, %)";
        let mut table = Table::new(title, header).text_columns(2);
        for of in &self.outlasted {
            let cells = of.read.iter().map(cell);
            table.row([of.model.clone(), of.layout.to_string()].into_iter().chain(cells));
        }
        table
    }

    /// The attacks, for people.
    fn names(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.attacks.iter().map(|attack| attack.name.as_str())
    }

    /// Under which attacks a mark is read worse than the seamed one.
    fn shortfalls(&self, today: TriedLayout) -> String {
        let of = |layout| self.outlasted.iter().filter(move |of| of.layout == layout);
        let pairs: Vec<[&Outlasted; 2]> = of(today)
            .filter_map(|now| {
                of(SEAMED)
                    .find(|then| then.model == now.model)
                    .map(|then| [now, then])
            })
            .collect();
        if pairs.is_empty() {
            return String::new();
        }
        let attacks: Vec<&str> = self.names().collect();
        let ratio = |i: usize| {
            let of_model = |[now, then]: &[&Outlasted; 2]| {
                let [now, then] = [now, then].map(|of| of.read[i].margin.clamp(1.0, ALL_BITS));
                (now / then).ln()
            };
            (pairs.iter().map(of_model).sum::<f64>() / pairs.len() as f64).exp()
        };
        // Of the logarithm: marks of different models and layouts have different bits and noise.
        let deviation = |i: usize| {
            let squares = pairs.iter().flatten().map(|of| &of.read[i]);
            let squares = squares.map(|read| (read.deviation / read.margin).powi(2));
            squares.sum::<f64>().sqrt() / pairs.len() as f64
        };
        let short: Vec<String> = (0..attacks.len())
            .map(|i| (i, ratio(i)))
            .filter(|(_, ratio)| *ratio < 1.0 - SHORT)
            .map(|(i, ratio)| format!("{} ({ratio:.2} ± {:.2})", attacks[i], ratio * deviation(i)))
            .collect();
        let list = match short.is_empty() {
            true => String::new(),
            false => format!(": {}", short.join(", ")),
        };
        format!(
            "By the same reader, at the same distortion, and with T₀ beyond {ALL_BITS:.0} counted as that, `{today}` has less than {:.2} of the T₀ of `{SEAMED}`, geometric mean over {} models, under {} of {} attacks{list}.\n",
            1.0 - SHORT,
            pairs.len(),
            short.len(),
            attacks.len(),
        )
    }

    fn equal(&self) -> Table {
        let header = ["model", "the seamed mark's reader", "mark", "RMS (%)"]
            .into_iter()
            .chain(READ)
            .chain(["MSDM2", "to the seamed mark's", "DAME", "to the seamed mark's "]);
        let title = "What is seen of marks that outlast as much: T₀ (extraction rate, %), MSDM2, DAME";
        let mut table = Table::new(title, header).text_columns(3);
        for of in &self.equal {
            let reader = READERS[of.reader].0;
            for (name, mark) in [("seamed", &of.seamed), ("today's", &of.today)] {
                let first = [of.model.clone(), reader.into(), name.into()].into_iter();
                let strength = format!("{:.4}", 100.0 * mark.strength);
                let read = mark.read.iter().map(cell);
                let to = |of_mark: f64, of_seamed: f64| match name {
                    "seamed" => String::new(),
                    _ => format!("{:.2}", of_mark / of_seamed),
                };
                let [msdm2, seamed] =
                    [mark, &of.seamed].map(|mark: &Weighed| mark.look.msdm2.unwrap_or(f64::NAN));
                let look = [
                    format!("{msdm2:.3}"),
                    to(msdm2, seamed),
                    format!("{:.4}", mark.look.dame),
                    to(mark.look.dame, of.seamed.look.dame),
                ];
                table.row(first.chain([strength]).chain(read).chain(look));
            }
        }
        table
    }
}

const WORDS: &str = "Each model carries the same random bits in every layout. A layout is named KIND:PATCHES:CHIP RATE:STRENGTH. *Free* is the paper's: harmonics end with any value where \
    patches meet, and every patch carries every bit so often; in *fixed* ones they are zero there; *pooled* is what `sigmark embed` writes: fixed ones, too, and all patches together carry every bit of a codeword so often; *repeated* has the same chips, and each of 512 bits has as many of them as another, so that a code is not in the way when extraction rates are compared; *even* is as strong in all patches, while the others are stronger where a surface is rough. *Windowed* has the patches of \
    pooled, with free harmonics times a smoothstep of the distance to the border, over 0.15 of the patch's radius. `auto` is what the library chooses: \
    free patches as few as keep each below 30 000 vertices, which with chip rate 3 was the default until version 3 of certificates (*seamed*); pooled ones are the default. The strength is the root mean square displacement in diagonals; \
    as in the command, pooled marks take it back where a model is thin, and slivers are levelled. Turns are of the file as it is written. \
    *At borders* are the triangles with a corner beside another patch or beside what is unmarked; a model in one patch has none. Seconds are wall time for the harmonics of all patches. Meshes of more than two hundred thousand vertices have no MSDM2: its time grows with their square.\n\n\
    T₀ = √l Φ⁻¹(ER) over l = 512 bits: the signal-to-noise ratio of a matched filter, by the joint estimate that `sigmark verify` makes, over all patches; where all bits are right, at least what stands there.";

const EQUAL: &str = "The seamed mark has the default strength; today's is strong enough for T₀ under none of the first three attacks to be below the seamed mark's, or below 65 where that is above, from where on less than one of 512 bits is wrong; the least such strength is looked for in ten rounds, and known to 2 % where T₀ is told. \
    Noise of 0.5 % is no part of that: its T₀ is as much less as a mark is weaker. The first reader is the nearest to the one that read seamed marks when they were the default: \
    least squares with misalignment, smoothing and tessellation, without quadrics and weights; the second is today's. Today's marks are read by today's reader in both.\n";

fn turns(turn: &Turn) -> String {
    if turn.max == 0.0 {
        return "–".into();
    }
    format!("{:.2}, {:.1}, {:.0}", turn.median, turn.p99, turn.max)
}

/// How much further facets turn at borders; none where there are no borders.
fn ratio(seen: &Seen) -> Option<f64> {
    (seen.at_borders.max > 0.0).then(|| seen.at_borders.p99 / seen.inside.p99)
}

fn cell(read: &Read) -> String {
    let least = if read.rate < 1.0 { "" } else { "≥ " };
    format!("{least}{:.1} ({:.1})", read.margin, 100.0 * read.rate)
}
