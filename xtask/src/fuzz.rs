//! `cargo xtask fuzz`: cargo-fuzz with its seeds, its dictionaries and its limits.

use std::{path::PathBuf, process::Command};

use anyhow::{Context, Result, bail};
use fuzzing::{TARGETS, Target};

/// Larger inputs find little that smaller ones don't, slowly.
const LONGEST_INPUT: usize = 8 << 10;

/// The program may take so much memory, the sanitizer's own included; one allocation, a part of it.
const MEMORY_MIB: usize = 2048;
const ALLOCATION_MIB: usize = 256;

/// What takes longer hangs.
const SECONDS: usize = 30;

#[derive(clap::Args)]
pub(crate) struct Options {
    /// What is fuzzed: obj, ply, stl, off, gltf, glb, threemf, gzip, certificate, claim, keys, stamp, roots or graph; all, one after the other, if there is none
    target: Option<String>,
    /// How long for each target
    #[arg(long, value_name = "N", default_value_t = 10)]
    minutes: u64,
    /// A folder of files: those that are small and named as a target is become seeds, too
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let targets = match &options.target {
        None => TARGETS.iter().collect(),
        Some(name) => vec![Target::named(name).with_context(|| {
            let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
            format!("there is no target {name:?}: there are {}", names.join(", "))
        })?],
    };
    targets.into_iter().try_for_each(|target| fuzz(target, options))
}

fn fuzz(target: &Target, options: &Options) -> Result<()> {
    let corpus = PathBuf::from("fuzz/corpus");
    target
        .write_seeds(&corpus, options.assets.as_deref())
        .context("the seeds can't be written")?;
    let mut command = Command::new("cargo");
    command.args(["+nightly", "fuzz", "run", target.name, "--"]);
    command.arg(format!("-max_total_time={}", 60 * options.minutes));
    command.arg(format!("-max_len={LONGEST_INPUT}"));
    command.arg(format!("-rss_limit_mb={MEMORY_MIB}"));
    command.arg(format!("-malloc_limit_mb={ALLOCATION_MIB}"));
    command.arg(format!("-timeout={SECONDS}"));
    command.args(["-use_value_profile=1", "-print_final_stats=1"]);
    let dictionary = PathBuf::from(format!("fuzz/dictionaries/{}.dict", target.name));
    if dictionary.exists() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    let status = command.status().context("cargo can't be run")?;
    if !status.success() {
        bail!(
            "{}: cargo fuzz ended with {status}; what was found lies in fuzz/artifacts/{0}. If nothing was run, it needs \
             `rustup toolchain install nightly` and `cargo install --locked cargo-fuzz`",
            target.name
        );
    }
    Ok(())
}
