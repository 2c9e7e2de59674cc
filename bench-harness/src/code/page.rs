//! The page of the code.

use anyhow::Result;
use evaluation::{
    chart::{Panel, THEIRS, page as svg_page},
    machine,
    markup::OURS,
    sources,
    table::Table,
};

use super::{
    Beside, Construction, Curve, Curves, LISTS, RATE,
    accepts::{Accepts, SETTING},
    bounds::{eb_n0, normal_approximation, repetition, shannon},
    channel::{Effort, Point, t0_at},
    oracle::{self, PUBLISHED},
};
use crate::results;

/// Writes the page, its chart and its CSV file. `code`: the digest of what the figures depend on.
pub(super) fn write(
    curves: &Curves,
    constructions: &[Construction],
    oracle: &[Beside],
    accepts: &Accepts,
    effort: &Effort,
    code: &str,
) -> Result<()> {
    let results = results::folder()?;
    rates(curves.all()).write_csv(&results.join("code.csv"))?;
    results::write(&results.join("code.svg"), chart(&curves.main))?;
    let sections = [
        words(effort),
        needed(curves).markdown(),
        asked(&curves.main),
        "![Frame error rates](code.svg)\n".into(),
        times(curves).markdown(),
        rates(curves.main.iter()).markdown(),
        others(constructions).markdown(),
        beside(oracle).markdown(),
        summary(oracle).markdown(),
        false_accepts(accepts),
    ];
    let foot = format!(
        "{}; {}. Code {}, sources' digest {code}.\n",
        machine::description(),
        machine::load(),
        sources::commit()
    );
    results::write_page(&results.join("code.md"), &(sections.join("\n") + "\n" + &foot))
}

fn words(effort: &Effort) -> String {
    format!(
        "# The polar code\n\nWritten by `cargo xtask bench code`. Payloads are random, code bits are ±1 chips, one each, in Gaussian noise; \
         T₀ = √(n · SNR) for n chips of this signal-to-noise ratio, so that a repeated code has the same T₀. A frame is read if its payload is \
         anywhere in a list: it is a signature or a commitment that tells it, and the code has no check of its own. A list is tried where the shorter \
         ones have failed, so that rates are those of `PolarCode::search`. At each T₀ up to {} frames were sent, until the longest list had missed {}; seed {}.\n",
        effort.frames, effort.errors, effort.seed
    )
}

impl Curves {
    fn all(&self) -> impl Iterator<Item = &Curve> {
        self.main.iter().chain(&self.others)
    }
}

fn with_error(figure: Option<(f64, f64)>) -> String {
    figure.map_or("–".into(), |(t0, error)| format!("{t0:.2} ± {error:.2}"))
}

/// What is asked of the longest list: payload and T₀.
const ASKED: [(usize, f64); 2] = [(512, 35.5), (128, 18.2)];

fn asked(curves: &[Curve]) -> String {
    let judged = ASKED.iter().map(|&(bits, most)| {
        let curve = curves.iter().find(|curve| curve.bits == bits);
        let reached = curve.and_then(|curve| t0_at(&curve.points, LISTS.len() - 1, RATE));
        let verdict = match reached {
            Some((t0, _)) if t0 <= most => format!(
                "reached, with {:.2} dB to spare",
                eb_n0(most, bits) - eb_n0(t0, bits)
            ),
            Some(_) => "**missed**".into(),
            None => "not measured".into(),
        };
        format!("T₀ ≤ {most} for {bits} bits: {verdict}")
    });
    format!("Asked for were {}.\n", judged.collect::<Vec<_>>().join("; "))
}

fn needed(curves: &Curves) -> Table {
    let longest = LISTS[LISTS.len() - 1];
    let lists = LISTS.map(|list| format!("list {list}"));
    let header = ["payload".to_string(), "length".into()].into_iter().chain(lists);
    let header = header.chain(
        [
            "bound",
            "bound of lists",
            "dB above the bound",
            "dB above that of lists",
            "Shannon",
            "repetition",
        ]
        .map(String::from),
    );
    let mut table = Table::new(&format!("T₀ at a frame error rate of {RATE}"), header).note(&format!(
        "± is the standard error. The bound is the normal approximation (Polyanskiy, Poor and Verdú 2010) for one answer; a list of L, of which somebody else chooses, may have log₂ L bits more, \
         and *bound of lists* is that for {longest}: the figures under *list {longest}* are to be held against it, and may lie below the other. Both are approximations, good to a tenth of a dB or so. dB are those of Eb/N0, of the longest list above either. Shannon's limit is that of \
         the rate, for any length. Repetition: every bit alike often, all of them right."
    ));
    for curve in curves.all() {
        let Curve {
            bits, length, points, ..
        } = curve;
        let bound = normal_approximation(*bits as f64, *length, RATE);
        let of_lists = normal_approximation(*bits as f64 - (longest as f64).log2(), *length, RATE);
        let last = t0_at(points, LISTS.len() - 1, RATE);
        let above = [bound, of_lists].map(|bound| {
            let above = last.map(|(t0, _)| eb_n0(t0, *bits) - eb_n0(bound, *bits));
            above.map_or("–".into(), |above| format!("{above:+.2}"))
        });
        let lists = (0..LISTS.len()).map(|list| with_error(t0_at(points, list, RATE)));
        let row = [bits.to_string(), length.to_string()].into_iter().chain(lists);
        let figures = [bound, of_lists].map(|t0| format!("{t0:.2}"));
        let more = [shannon(*bits, *length), repetition(*bits, RATE)].map(|t0| format!("{t0:.2}"));
        table.row(row.chain(figures).chain(above).chain(more));
    }
    table
}

fn times(curves: &Curves) -> Table {
    let header = ["payload".to_string(), "length".into()]
        .into_iter()
        .chain(LISTS.map(|list| format!("list {list}")));
    let mut table = Table::new("Time of a decoding (ms)", header)
        .note("CPU time of one thread, median of 25 frames (7 of the longest list), to the first candidate.");
    for Curve {
        bits,
        length,
        seconds,
        ..
    } in curves.all()
    {
        let times = seconds.iter().map(|seconds| format!("{:.2}", 1e3 * seconds));
        table.row([bits.to_string(), length.to_string()].into_iter().chain(times));
    }
    table
}

fn counted(point: &Point, list: usize) -> String {
    match point.missed[list] {
        0 => "0".into(),
        missed => format!("{:.1e} ({missed})", point.rate(list)),
    }
}

fn rates<'a>(curves: impl Iterator<Item = &'a Curve>) -> Table {
    let header = ["payload", "length", "T₀", "frames"].map(String::from);
    let mut table = Table::new(
        "Frame error rates",
        header.into_iter().chain(LISTS.map(|list| format!("list {list}"))),
    )
    .note("In brackets: frames that were missed. All lengths: [code.csv](code.csv).");
    for Curve {
        bits, length, points, ..
    } in curves
    {
        for point in points {
            let first = [
                bits.to_string(),
                length.to_string(),
                format!("{:.1}", point.t0),
                point.frames.to_string(),
            ];
            table.row(
                first
                    .into_iter()
                    .chain((0..LISTS.len()).map(|list| counted(point, list))),
            );
        }
    }
    table
}

fn others(constructions: &[Construction]) -> Table {
    let header = ["construction", "payload", "length", "T₀", "frames"].map(String::from);
    let header = header
        .into_iter()
        .chain(LISTS[1..].iter().map(|list| format!("list {list}")));
    let mut table = Table::new("Other constructions", header)
        .note("All see the same noise. The standard error of a rate is itself by the root of the number in brackets.");
    for Construction {
        bits,
        length,
        name,
        point,
    } in constructions
    {
        let first = [
            name.clone(),
            bits.to_string(),
            length.to_string(),
            format!("{:.1}", point.t0),
            point.frames.to_string(),
        ];
        table.row(
            first
                .into_iter()
                .chain((1..LISTS.len()).map(|list| counted(point, list - 1))),
        );
    }
    table
}

/// Rates of the list itself are the last of each point's.
fn last(point: &Point) -> usize {
    point.missed.len() - 1
}

fn beside(oracle: &[Beside]) -> Table {
    let mut table = Table::new("Beside AFF3CT", ["list", "Eb/N0 (dB)", "AFF3CT", "ours", "frames"]).note(&format!(
        "Frame error rates of ({}, {}) codes. AFF3CT: its published curves of the polar code with a CRC of 32 bits, fully adaptive lists, positions by Gaussian approximation at each strength \
         ([error_rate_references](https://github.com/aff3ct/error_rate_references), commit 021a9e0, `POLAR/AWGN/BPSK/ASCL/Polar_N2048_K1024_ASCL_L*_CRC32_SPC4_p32.txt`; Léonardon et al., arXiv 1710.08314). \
         Ours: {} bits of payload, as many as its polar code holds with the CRC, and one who knows the payload in place of the CRC.",
        oracle::LENGTH, oracle::INFORMATION, oracle::CARRIED
    ));
    for (ours, theirs) in oracle.iter().zip(&PUBLISHED) {
        for (point, (eb_n0, rate)) in ours.points.iter().zip(theirs.near()) {
            table.row([
                ours.list.to_string(),
                format!("{eb_n0:.1}"),
                format!("{rate:.1e}"),
                counted(point, last(point)),
                point.frames.to_string(),
            ]);
        }
    }
    table
}

fn summary(oracle: &[Beside]) -> Table {
    let mut table = Table::new(
        &format!("Beside AFF3CT: Eb/N0 (dB) at a frame error rate of {RATE}"),
        [
            "list",
            "AFF3CT",
            "ours",
            "ours less AFF3CT",
            "standard error of ours",
        ],
    )
    .note(
        "AFF3CT's positions are computed anew for each strength, ours are one set for all, and chosen for lists: a list of one reads less with \
         them. Whoever knows the payload never takes a wrong one for it, as a CRC may.",
    );
    for (ours, theirs) in oracle.iter().zip(&PUBLISHED) {
        let Some((their, (highest, _))) = theirs.at(RATE).zip(theirs.near().last()) else {
            continue;
        };
        let reached = ours
            .points
            .first()
            .and_then(|point| t0_at(&ours.points, last(point), RATE));
        let figures = match reached {
            Some((t0, error)) => {
                let our = eb_n0(t0, oracle::INFORMATION);
                let error = eb_n0(t0 + error, oracle::INFORMATION) - our;
                [
                    format!("{our:.2}"),
                    format!("{:+.2}", our - their),
                    format!("{error:.2}"),
                ]
            }
            None => [
                format!("above {highest:.1}"),
                format!("above {:+.2}", highest - their),
                "–".into(),
            ],
        };
        let first = [ours.list.to_string(), format!("{their:.2}")];
        table.row(first.into_iter().chain(figures));
    }
    table
}

fn false_accepts(accepts: &Accepts) -> String {
    let (bits, length, list) = SETTING;
    let lists: usize = code::LISTS.iter().sum();
    let log2 = (lists as f64).log2() - 128.0;
    let billion = log2 + 1e9f64.log2();
    format!(
        "## Noise taken for a payload\n\nA commitment of 128 bits that has nothing to do with the ratios is among the candidates of lists of {} with a probability of at most {lists} · 2⁻¹²⁸ = 2^{log2:.1}; \
         in any of 10⁹ decodings with 2^{billion:.1}. What is decoded of a suspect is chosen out of as many readings as its verdict's `tries` say, and each of these counts as a decoding: 10⁹ suspects of a thousand tries each come to 2^{:.1}. \
         That is a union bound and needs no experiment. As a check of the program {} vectors of noise were decoded with a list of {list} ({bits} bits in {length}): \
         {} candidates, {} of them the commitment; the nearest agreed in {} of {bits} bits, where {:.0} independent payloads would reach about {:.0}.\n",
        code::LISTS.map(|list| list.to_string()).join(", "),
        billion + 1e3f64.log2(),
        accepts.vectors,
        accepts.candidates,
        accepts.accepted,
        accepts.nearest,
        accepts.candidates as f64,
        0.5 * bits as f64 + (0.5 * bits as f64 * (accepts.candidates.max(2) as f64).ln()).sqrt(),
    )
}

/// Frame error rates of the first curve of each payload, from 1 down to 10⁻⁴.
fn chart(curves: &[Curve]) -> String {
    const COLOURS: [&str; 4] = [THEIRS, "#3e8ed0", "#2f9e44", OURS];
    let mut drawn = String::new();
    for (i, curve) in curves.iter().enumerate() {
        let Some((first, last)) = curve.points.first().zip(curve.points.last()) else {
            continue;
        };
        let (low, high) = (
            first
                .t0
                .min(normal_approximation(curve.bits as f64, curve.length, RATE))
                .floor()
                - 1.0,
            last.t0,
        );
        let across = |t0: f64| (t0 - low) / (high - low);
        let up = |rate: f64| 1.0 + rate.max(1e-4).log10() / 4.0;
        let title = format!("{} bits in {}: frame error rate", curve.bits, curve.length);
        let mut panel = Panel::new([70.0 + 430.0 * i as f64, 60.0, 330.0, 260.0], "T₀", &title);
        for t0 in (low as usize..=high as usize).step_by(if high - low > 5.0 { 2 } else { 1 }) {
            panel.tick_x(across(t0 as f64), &t0.to_string());
        }
        for (power, text) in ["1", "10⁻¹", "10⁻²", "10⁻³", "10⁻⁴"].iter().enumerate() {
            panel.tick_y(1.0 - power as f64 / 4.0, text);
        }
        for (list, colour) in COLOURS.into_iter().enumerate() {
            let seen = curve
                .points
                .iter()
                .filter(|point| point.missed[list] > 0 && point.rate(list) >= 1e-4);
            panel.curve(seen.map(|point| (across(point.t0), up(point.rate(list)))), colour);
            panel.legend(0.66, list, &format!("list {}", LISTS[list]), colour);
        }
        let bound = normal_approximation(curve.bits as f64, curve.length, RATE);
        panel.dot((across(bound), up(RATE)), "bound");
        drawn += panel.drawn();
    }
    svg_page(880.0, 380.0, &drawn)
}
