//! `cargo xtask fuzz`: cargo-fuzz with its seeds, its dictionaries and its limits, and a record of how long nothing was found.

mod record;

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process::Command,
    time::Instant,
};

use anyhow::{Context, Result, bail};
use evaluation::{machine::cpu_of_children, process::root, sources::commit};
use fuzzing::{TARGETS, Target};
use record::Run;

/// Larger inputs find little that smaller ones don't, slowly.
const LONGEST_INPUT: usize = 8 << 10;

/// The program may take so much memory, the sanitizer's own included; one allocation, a part of it.
const MEMORY_MIB: usize = 2048;
const ALLOCATION_MIB: usize = 256;

/// What takes longer hangs.
const SECONDS: usize = 30;

/// After so many minutes what was learnt is recorded, and the target begins again with it.
const MINUTES_OF_A_RUN: u64 = 10;

#[derive(clap::Args)]
pub(crate) struct Options {
    /// What is fuzzed, one after the other: obj, ply, stl, off, gltf, glb, 3mf, gzip, certificate, claim, keys, stamp, roots, graph; all, if none is named
    targets: Vec<String>,
    /// How long for each target, in minutes of the processor's time where the system tells it
    #[arg(long, value_name = "N", default_value_t = 10)]
    minutes: u64,
    /// A folder of files: those that are small and named as a target is become seeds, too
    #[arg(long, value_name = "DIR")]
    assets: Option<PathBuf>,
    /// Add what was done to results/fuzzing.csv and results/fuzzing.md
    #[arg(long)]
    record: bool,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let targets = match &options.targets[..] {
        [] => TARGETS.iter().collect(),
        names => names.iter().map(|name| named(name)).collect::<Result<Vec<_>>>()?,
    };
    checked(Command::new("cargo").args(["+nightly", "fuzz", "build"])).context(
        "the targets can't be built; this needs `rustup toolchain install nightly` and `cargo install --locked cargo-fuzz`",
    )?;
    targets.into_iter().try_for_each(|target| fuzz(target, options))
}

fn named(name: &str) -> Result<&'static Target> {
    Target::named(name).with_context(|| {
        let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
        format!("there is no target {name:?}: there are {}", names.join(", "))
    })
}

/// Runs a target again and again until its time is up.
fn fuzz(target: &Target, options: &Options) -> Result<()> {
    let corpus = root().join("fuzz/corpus");
    target
        .write_seeds(&corpus, options.assets.as_deref())
        .context("the seeds can't be written")?;
    let mut left = 60.0 * options.minutes as f64;
    while left >= 1.0 {
        let run = run_for(target, (left.ceil() as u64).min(60 * MINUTES_OF_A_RUN))?;
        eprintln!("{run}");
        if options.record {
            record::add(&run)?;
        }
        if run.found {
            bail!(
                "{}: something was found; it lies in fuzz/artifacts/{0}, and what was said of it in {}",
                target.name,
                log_of(target).display()
            );
        }
        left -= run.cpu_seconds;
    }
    Ok(())
}

/// Runs a target for some seconds of the clock.
fn run_for(target: &Target, seconds: u64) -> Result<Run> {
    let log = log_of(target);
    fs::create_dir_all(log.parent().unwrap_or(Path::new(".")))?;
    let mut command = Command::new("cargo");
    command
        .current_dir(root())
        .args(["+nightly", "fuzz", "run", target.name, "--"]);
    command.arg(format!("-max_total_time={seconds}"));
    command.arg(format!("-max_len={LONGEST_INPUT}"));
    command.arg(format!("-rss_limit_mb={MEMORY_MIB}"));
    command.arg(format!("-malloc_limit_mb={ALLOCATION_MIB}"));
    command.arg(format!("-timeout={SECONDS}"));
    command.args(["-use_value_profile=1", "-print_final_stats=1"]);
    let dictionary = root().join(format!("fuzz/dictionaries/{}.dict", target.name));
    if dictionary.exists() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    command.stderr(File::create(&log).with_context(|| log.display().to_string())?);
    // Told before it begins: the tree may have gone on when it ends.
    let commit = commit();
    let (began, cpu_before) = (Instant::now(), cpu_of_children());
    let status = command.status().context("cargo can't be run")?;
    let wall = began.elapsed().as_secs_f64();
    let cpu = cpu_before
        .zip(cpu_of_children())
        .map(|(before, after)| after - before);
    let said = fs::read_to_string(&log).with_context(|| log.display().to_string())?;
    Run::of(
        target.name,
        commit,
        cpu.unwrap_or(wall).min(wall),
        &said,
        status.success(),
    )
    .with_context(|| {
        format!(
            "it ended with {status}, and what it said in {} tells no result",
            log.display()
        )
    })
}

/// Where libFuzzer's words of the last run of a target lie.
fn log_of(target: &Target) -> PathBuf {
    root().join(format!("fuzz/logs/{}.log", target.name))
}

fn checked(command: &mut Command) -> Result<()> {
    let status = command
        .current_dir(root())
        .status()
        .with_context(|| format!("{command:?}"))?;
    match status.success() {
        true => Ok(()),
        false => bail!("{command:?} ended with {status}"),
    }
}
