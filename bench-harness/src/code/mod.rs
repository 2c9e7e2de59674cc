//! The polar code: frame error rates beside the bounds, other constructions, other lengths, AFF3CT's published curves, seconds.
//!
//! `channel.rs` sends frames and counts, `bounds.rs` says what any code needs, `constructions.rs` and `oracle.rs` are what ours is held against,
//! `accepts.rs` looks for a commitment where there is none; `page.rs` writes.

mod accepts;
mod bounds;
mod channel;
mod constructions;
mod oracle;
mod page;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use code::PolarCode;
use evaluation::sources;
use serde::Serialize;

use self::{
    accepts::Accepts,
    channel::{Effort, Point, point, seconds},
};
use crate::kept::{self, Key};

/// How long to measure.
#[derive(Args)]
pub struct CodeBench {
    /// Frames at each strength, at most; a half of them beside AFF3CT, a fifth for other lengths, a tenth for other constructions
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    pub frames: usize,
    /// Frames that the longest list misses, after which a strength is done
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub errors: usize,
    /// Seconds of looking for a commitment in noise
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    pub seconds: f64,
    /// Of payloads and noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Threads [default: as many as there are cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

/// Each tries what the one before has not read.
const LISTS: [usize; 4] = [1, 32, 256, 4096];

/// The frame error rate that codes are compared at.
const RATE: f64 = 1e-3;

/// A code at many strengths.
struct Curve {
    bits: usize,
    length: usize,
    points: Vec<Point>,
    /// CPU seconds of each list, at the middle of the points.
    seconds: Vec<f64>,
}

/// All lengths.
struct Curves {
    main: Vec<Curve>,
    others: Vec<Curve>,
}

/// Another construction at one strength.
struct Construction {
    bits: usize,
    length: usize,
    name: String,
    point: Point,
}

/// Ours where AFF3CT's is published.
struct Beside {
    list: usize,
    points: Vec<Point>,
}

/// Payload, length and strengths of the codes that a model of the paper's size has chips for.
const MAIN: [(usize, usize, &[f64]); 2] = [
    (
        512,
        2048,
        &[32.5, 33.0, 33.5, 34.0, 35.0, 36.0, 37.0, 38.0, 39.0, 40.0, 41.0],
    ),
    (
        128,
        1024,
        &[15.5, 16.0, 16.5, 17.0, 17.5, 18.0, 19.0, 20.0, 21.0, 22.0, 23.0],
    ),
];

/// Of shorter and longer ones.
const OTHERS: [(usize, usize, &[f64]); 4] = [
    (512, 1024, &[35.5, 36.5, 37.5]),
    (512, 4096, &[31.5, 32.25, 33.0]),
    (128, 512, &[16.5, 17.25, 18.0]),
    (128, 2048, &[15.75, 16.5, 17.25]),
];

impl CodeBench {
    /// Sends frames and writes `results/code.md`, `code.csv` and `code.svg`.
    pub fn run(&self) -> Result<()> {
        let code = sources::digest_of_all_but(&NO_PART)?;
        let kept = Kept {
            folder: kept::folder(&format!("code/{code}"))?,
            effort: Effort {
                frames: self.frames,
                errors: self.errors,
                seed: self.seed,
                threads: self
                    .threads
                    .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)),
            },
        };
        let main: Result<Vec<Curve>> = MAIN.iter().map(|curve| kept.curve(curve, self.frames)).collect();
        let others: Result<Vec<Curve>> = OTHERS
            .iter()
            .map(|curve| kept.curve(curve, self.frames / 5))
            .collect();
        let curves = Curves {
            main: main?,
            others: others?,
        };
        let constructions = kept.constructions()?;
        let oracle = kept.oracle()?;
        let accepts: Accepts = kept.figures(&format!("accepts-{}-{}", self.seconds, self.seed), || {
            accepts::look(self.seconds, self.seed, kept.effort.threads)
        })?;
        page::write(&curves, &constructions, &oracle, &accepts, &kept.effort, &code)
    }
}

/// Shorter lists than AFF3CT's, as its own adaptive ones grow.
const LISTS_BEFORE: [usize; 2] = [1, 32];

/// What is finished, and how long the rest is measured.
struct Kept {
    folder: PathBuf,
    effort: Effort,
}

impl Kept {
    fn figures<T: Serialize + serde::de::DeserializeOwned>(
        &self,
        name: &str,
        measure: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        kept::figures(&self.folder, &Key::new(name), measure)
    }

    /// `frames`: fewer than the effort says, where a point is one of many.
    fn point(&self, name: &str, code: &PolarCode, t0: f64, lists: &[usize], frames: usize) -> Result<Point> {
        let effort = Effort {
            frames,
            ..self.effort
        };
        let Effort { errors, seed, .. } = effort;
        let name = format!(
            "{name}-{}-{}-{t0:.4}-{lists:?}-{frames}-{errors}-{seed}",
            code.payload_bits(),
            code.length()
        );
        self.figures(&name, || point(code, t0, lists, &effort))
    }

    fn curve(&self, &(bits, length, strengths): &(usize, usize, &[f64]), frames: usize) -> Result<Curve> {
        let code = PolarCode::new(bits, length)?;
        let points = strengths
            .iter()
            .map(|&t0| self.point("ours", &code, t0, &LISTS, frames));
        let points: Result<Vec<Point>> = points.collect();
        let middle = strengths[strengths.len() / 2];
        let seconds = self.figures(&format!("seconds-{bits}-{length}-{}", self.effort.seed), || {
            let each = LISTS
                .iter()
                .map(|&list| seconds(&code, middle, list, self.effort.seed));
            each.collect()
        })?;
        Ok(Curve {
            bits,
            length,
            points: points?,
            seconds,
        })
    }

    fn constructions(&self) -> Result<Vec<Construction>> {
        let mut all = Vec::new();
        for (bits, length, t0) in [(512, 2048, 32.5), (128, 1024, 16.0)] {
            for (i, (name, code)) in constructions::all(bits, length)?.into_iter().enumerate() {
                let point = self.point(
                    &format!("construction{i}"),
                    &code,
                    t0,
                    &LISTS[1..],
                    self.effort.frames / 10,
                )?;
                all.push(Construction {
                    bits,
                    length,
                    name,
                    point,
                });
            }
        }
        Ok(all)
    }

    fn oracle(&self) -> Result<Vec<Beside>> {
        let code = PolarCode::new(oracle::CARRIED, oracle::LENGTH)?;
        let mut all = Vec::new();
        for published in &oracle::PUBLISHED {
            let lists = LISTS_BEFORE
                .iter()
                .filter(|&&list| list < published.list)
                .copied();
            let lists: Vec<usize> = lists.chain([published.list]).collect();
            let points = published.near();
            let points = points.map(|(eb_n0, _)| {
                self.point("oracle", &code, oracle::t0(eb_n0), &lists, self.effort.frames / 2)
            });
            all.push(Beside {
                list: published.list,
                points: points.collect::<Result<_>>()?,
            });
        }
        Ok(all)
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 17] = [
    "bench-harness/src/code/bounds.rs",
    "bench-harness/src/code/page.rs",
    "bench-harness/src/eigen",
    "bench-harness/src/formats",
    "bench-harness/src/partition",
    "bench-harness/src/quality",
    "bench-harness/src/registration",
    "bench-harness/src/seconds",
    "bench-harness/src/security",
    "bench-harness/src/visibility",
    "crates/baselines",
    "crates/cli",
    "crates/evaluation",
    "crates/mesh",
    "crates/mhb-core",
    "crates/registration",
    "crates/sigmark",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }
}
