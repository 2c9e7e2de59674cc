//! Whose copy it was: colluders and what they make of their copies, and who is named.
//!
//! `collusion.rs` is what colluders do; `copies.rs` makes the copies, in our layout, with chips on single harmonics, and with Tardos' code; `page.rs` writes.

mod collusion;
mod copies;
mod page;

use std::{path::PathBuf, thread, time::Instant};

use anyhow::{Context, Result, ensure};
use clap::Args;
use evaluation::{
    attacks::random_similarity,
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use job::Job;
use mesh::{TriMesh, shapes};
use mesh_io::Asset;
use serde::{Deserialize, Serialize};
use sigmark::claim::{Trace, statistics::rademacher_tail};

use crate::{
    kept::{self, Key},
    suspects::attacked,
};
use collusion::{Domain, RULES, Rule};
use copies::{Layout, Shop};

/// What to mark, and how many innocents to try.
#[derive(Args)]
pub struct TracingBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again [default: bunny, horse, laurana and rocker arm]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Fresh codes that nobody has, tried against a weak leak; a tenth of them against others, an unmarked file and a copy that is not asked for
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub codes: usize,
}

/// Those that are marked by default.
const MODELS: [&str; 4] = ["stanford_bunny_closed", "horse", "laurana", "rocker"];

/// Copies that were given out, of which some collude.
const BUYERS: usize = 1000;

/// How many collude.
const COLLUDERS: [usize; 3] = [3, 8, 20];

/// The same for the chart, under averaging.
const CHARTED: [usize; 7] = [1, 2, 3, 5, 8, 12, 20];

/// What happens to the average of eight besides.
const AFTERWARDS: [&str; 4] = ["simplify:30", "laplacian:5", "remesh", "crop:50"];

/// What leaves little of one copy.
const WEAK: [&str; 3] = ["simplify:2", "laplacian:50", "simplify:1"];

/// A probability by which somebody is named.
const BOUND: f64 = 1e-5;

/// What is said of the copies in a suspect.
#[derive(Serialize, Deserialize)]
struct Traced {
    layout: String,
    domain: String,
    attack: String,
    colluders: usize,
    /// T of each, the largest first.
    t: Vec<f64>,
    /// T of the best innocent.
    innocent: f64,
    /// How many colluders are named among [`BUYERS`], and how many innocents.
    named: usize,
    wrong: usize,
    /// Root mean square displacement of the suspect, as a fraction of the diagonal.
    rms: f64,
}

/// One copy among very many codes.
#[derive(Serialize, Deserialize)]
struct Leak {
    suspect: String,
    /// T₀ of the buyer's copy, named or not; none where nobody's copy is in it.
    margin: Option<f64>,
    /// Of the first who was named.
    p: Option<f64>,
    named: usize,
    wrong: usize,
    codes: usize,
    seconds: f64,
}

/// What was found on one model.
#[derive(Serialize, Deserialize)]
struct Model {
    name: String,
    chips: usize,
    /// Of the marked copies.
    rms: f64,
    traced: Vec<Traced>,
    charted: Vec<Traced>,
    afterwards: Vec<Traced>,
    leaks: Vec<Leak>,
    /// Of asking for ten thousand copies in a suspect that was read, and of reading one.
    seconds_of_10_000: f64,
    seconds_of_reading: f64,
}

impl TracingBench {
    /// Makes copies, lets buyers collude, traces them, and writes `results/tracing.md`, its CSV, chart and picture.
    pub fn run(&self) -> Result<()> {
        let python = Python::prepare()?;
        let code = sources::digest_of_all_but(&NO_PART)?;
        let folder = kept::folder(&format!("tracing/{code}"))?;
        let defaults: Vec<String> = MODELS.iter().map(ToString::to_string).collect();
        let only = if self.only.is_empty() {
            &defaults
        } else {
            &self.only
        };
        let mut models = Vec::new();
        let mut pictures = None;
        for path in mesh_files(&self.meshes)? {
            let name = name_of(&path);
            if !is_chosen(&name, only) {
                continue;
            }
            let asset = Asset::open(&path)?;
            let figures = || self.of_model(&name, asset.mesh(), &python);
            let key = Key::new(format!("{name}-{}", self.codes)).of_mesh(asset.mesh());
            models.push(kept::figures(&folder, &key, figures)?);
            pictures = Some(path);
        }
        let shown = self.meshes.display();
        let last =
            pictures.with_context(|| format!("{shown}: no mesh file there has a name that was asked for"))?;
        ensure!(!models.is_empty(), "{shown}: nothing was traced");
        page::picture(Asset::open(&last)?.mesh())?;
        page::write(&models, &python, &code)
    }

    fn of_model(&self, name: &str, mesh: &TriMesh, python: &Python) -> Result<Model> {
        let job = Job::new(thread::available_parallelism().map_or(1, usize::from));
        let shop = Shop::open(mesh, &job)?;
        println!("{name}: {} chips", shop.order().chips());
        let mut model = Model {
            name: name.into(),
            chips: shop.order().chips(),
            rms: shop.rms(),
            traced: Vec::new(),
            charted: Vec::new(),
            afterwards: Vec::new(),
            leaks: self.leaks(&shop, name, python, &job)?,
            seconds_of_10_000: 0.0,
            seconds_of_reading: 0.0,
        };
        (model.seconds_of_reading, model.seconds_of_10_000) = seconds(&shop, &job)?;
        for layout in Layout::ALL {
            for &domain in layout.domains() {
                for colluders in COLLUDERS {
                    for rule in RULES {
                        model
                            .traced
                            .push(shop.collude(layout, domain, rule, colluders, &job)?.1);
                    }
                }
            }
            for colluders in CHARTED {
                let traced = shop.collude(layout, Domain::Coordinates, Rule::Average, colluders, &job)?;
                model.charted.push(traced.1);
            }
            println!("{name}: {} done", layout.name());
        }
        for (seed, spec) in (1..).zip(AFTERWARDS) {
            let (mixed, of) = shop.collude(Layout::Rotated, Domain::Coordinates, Rule::Average, 8, &job)?;
            let suspect = attacked(python, &mixed, &format!("{name}-tracing"), spec, seed)?;
            let suspect = shapes::moved(&suspect, &random_similarity(&suspect, seed));
            let traced = shop.judged(&suspect, 8, &job)?;
            model.afterwards.push(Traced {
                attack: spec.into(),
                rms: of.rms,
                ..traced
            });
        }
        Ok(model)
    }

    /// One copy after attacks, an unmarked file and a copy that is not asked for, among very many fresh codes.
    fn leaks(&self, shop: &Shop, name: &str, python: &Python, job: &Job) -> Result<Vec<Leak>> {
        let mut leaks = Vec::new();
        for (seed, spec) in (1..).zip(WEAK) {
            let suspect = attacked(python, shop.copy(0), &format!("{name}-copy"), spec, seed)?;
            let codes = if seed == 1 { self.codes } else { self.codes / 10 };
            leaks.push(leak(shop, spec, &suspect, codes, Some(0), job)?);
        }
        let nobody = [
            ("unmarked", shop.original()),
            ("a copy that is not asked for", shop.copy(1)),
        ];
        for (what, suspect) in nobody {
            leaks.push(leak(shop, what, suspect, self.codes / 10, None, job)?);
        }
        Ok(leaks)
    }
}

/// What is said of a suspect among so many codes, one of which may be in it.
fn leak(
    shop: &Shop,
    what: &str,
    suspect: &TriMesh,
    codes: usize,
    leaked: Option<usize>,
    job: &Job,
) -> Result<Leak> {
    let tracer = shop.tracer(1)?.with_decoys(codes.saturating_sub(1), 7);
    let moved = shapes::moved(suspect, &random_similarity(suspect, 3));
    let read = tracer.read(&moved, job)?;
    let margin = leaked.map(|buyer| shop.margin(buyer, &read));
    let begun = Instant::now();
    let trace = tracer.accuse(read, job)?;
    let accused = trace
        .accused
        .iter()
        .find(|accused| Some(accused.candidate) == leaked);
    Ok(Leak {
        suspect: what.into(),
        margin,
        p: accused.map(|accused| accused.p_value),
        named: usize::from(accused.is_some()),
        wrong: trace.accused.len() + trace.unsigned.len() - usize::from(accused.is_some()),
        codes: trace.candidates,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// Of reading a copy, and of asking for ten thousand.
fn seconds(shop: &Shop, job: &Job) -> Result<(f64, f64)> {
    let tracer = shop.tracer(1)?.with_decoys(9_999, 7);
    let begun = Instant::now();
    let read = tracer.read(shop.copy(0), job)?;
    let reading = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    tracer.accuse(read, job)?;
    Ok((reading, begun.elapsed().as_secs_f64()))
}

/// Whether T names somebody among [`BUYERS`] in the first round.
fn is_named(t: f64) -> bool {
    1.25 * rademacher_tail(t) * BUYERS as f64 <= BOUND
}

/// How many of the first candidates are named, and how many others.
fn right_and_wrong(trace: &Trace, colluders: usize) -> (usize, usize) {
    let right = trace
        .accused
        .iter()
        .filter(|accused| accused.candidate < colluders)
        .count();
    (right, trace.accused.len() + trace.unsigned.len() - right)
}

/// What has no part in the figures.
const NO_PART: [&str; 13] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/sigmark/tests",
    "bench-harness/src/code",
    "bench-harness/src/eigen",
    "bench-harness/src/formats",
    "bench-harness/src/partition",
    "bench-harness/src/registration",
    "bench-harness/src/robustness",
    "bench-harness/src/security",
    "bench-harness/src/tracing/page.rs",
    "xtask",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
