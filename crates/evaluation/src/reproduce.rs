//! `cargo xtask reproduce`: the paper's tables and figures from real meshes, with what it prints beside what we measure.
//!
//! Every algorithm gets the same meshes, patches, signatures and attacks, and is made as strong as gives the paper's d_rmse. What is
//! read is judged here; an algorithm sees bits only when it writes them. Every suspect is moved by a random similarity before
//! anything is read from it.
//!
//! `paper` holds the printed figures, `models` the meshes, `campaign` what is run on a mesh, `study` one algorithm on it, `reading` the way
//! from a suspect to bits, `store` what is finished, `jobs` what runs side by side. `tables`, `roc`, `figures` and `page` write what came out; `audit` looks for
//! what can't be right.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use anyhow::{Context, Result};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, SigningKey};

use crate::{
    audit, bare,
    campaign::{self, Campaign},
    jobs::{Progress, duration},
    models::{self, Candidate},
    page,
    results::Results,
    store::Store,
    study::{Bench, SCHEME, Signed},
};
use crate::{process::root, python::Python, sources};

/// What to reproduce.
pub struct Options {
    /// Where the tables go.
    pub output: PathBuf,
    /// The folder of the six models; the bunny alone without one.
    pub meshes: Option<PathBuf>,
    /// Models or files by name; all when empty.
    pub only: Vec<String>,
    /// Algorithms by name; all when empty.
    pub algorithms: Vec<String>,
    pub signatures: usize,
    /// Takes finished work of other versions of the code.
    pub keep: bool,
    /// When no more work begins, and what there is is written.
    pub closing: Option<Duration>,
}

pub fn run(options: &Options) -> Result<()> {
    campaign::check_names(&options.algorithms)?;
    let python = match Python::prepare() {
        Ok(python) => python,
        Err(missing) => return bare::run(&missing),
    };
    let (candidates, mut failures) = candidates(options, &python)?;
    let folder = root().join(".cache/reproduce");
    let _lock = locked(&folder)?;
    let work = folder.join("work");
    // What an interrupted run left there is of no use.
    let _ = fs::remove_dir_all(&work);
    fs::create_dir_all(&work).with_context(|| work.display().to_string())?;
    let store = Store::open(&folder.join("cells"), options.keep)?;
    let commit = sources::commit();
    let key = SigningKey::generate(Curve::B163, &mut ChaCha20Rng::seed_from_u64(2012));
    let signatures = signatures(&key, options.signatures)?;
    let bench = Bench {
        python: &python,
        store: &store,
        work: &work,
        signatures: &signatures,
        public_key: key.public_key(),
        threads: thread::available_parallelism().map_or(1, usize::from),
    };
    println!(
        "{} model(s), {} signatures, {} threads. Ctrl-C does no harm: what is finished is kept in .cache/reproduce, and the same command goes on.",
        candidates.len(),
        signatures.len(),
        bench.threads
    );
    let progress = campaign::progress(&candidates, options);
    let mut outcomes = Vec::new();
    let mut pictures = Vec::new();
    for candidate in candidates {
        match candidate.open() {
            Ok(standin) => {
                let campaign = Campaign {
                    bench: &bench,
                    options,
                    progress: &progress,
                    standin: &standin,
                };
                match campaign.run(&mut failures, &mut pictures) {
                    Ok(outcome) => outcomes.push(outcome),
                    Err(error) => failed(&mut failures, format!("{}: {error:#}", standin.model.name)),
                }
            }
            Err(error) => failed(&mut failures, format!("{error:#}")),
        }
    }
    let foot = foot(&bench, &python, &progress, &commit)?;
    let results = Results {
        outcomes,
        failures,
        signatures: signatures.len(),
        pictures,
        foot,
    };
    page::write(&results, options)?;
    println!("\nwritten: {}", options.output.display());
    audit::check(&results)
}

/// Keeps other runs of this task out of the folder, until the file is dropped.
fn locked(folder: &Path) -> Result<File> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let path = folder.join("lock");
    let file = File::create(&path).with_context(|| path.display().to_string())?;
    file.try_lock().with_context(|| {
        format!(
            "{}: another reproduction is running here; wait for its end",
            path.display()
        )
    })?;
    Ok(file)
}

pub(crate) fn failed(failures: &mut Vec<String>, what: String) {
    eprintln!("{what}");
    failures.push(what);
}

/// The meshes to work on; what is missing among them is a failure only when all were asked for.
fn candidates(options: &Options, python: &Python) -> Result<(Vec<Candidate>, Vec<String>)> {
    let Some(folder) = &options.meshes else {
        return Ok((vec![models::bunny(python.bunny()?)], Vec::new()));
    };
    let (found, missing) = models::in_folder(folder, &options.only)?;
    for line in &missing {
        eprintln!("{line}");
    }
    Ok((found, missing))
}

/// The marks: signatures of different messages with one key, which comes from a fixed seed and protects nothing.
fn signatures(key: &SigningKey, count: usize) -> Result<Vec<Signed>> {
    (0..count.max(1))
        .map(|number| {
            let message = format!("Sigmark reproduction {}", number + 1);
            Ok(Signed {
                number,
                signature: key.sign(SCHEME, message.as_bytes())?,
                message,
            })
        })
        .collect()
}

/// Machine, versions, seeds, duration: what stands below the tables.
fn foot(bench: &Bench<'_>, python: &Python, progress: &Progress, commit: &str) -> Result<String> {
    let (found, of_other_code) = bench.store.counts();
    let passed = duration(progress.passed().as_secs_f64());
    let mut foot = format!(
        "{}; {}. Code {}, sources' digest {}. This run took {passed}; {found} pieces of work were found finished",
        crate::machine::description(),
        python.versions()?,
        commit,
        bench.store.code(),
    );
    if of_other_code > 0 {
        foot += &format!(", {of_other_code} of them by another version of the code");
    }
    Ok(foot + ". Seeds: key 2012; attacks and poses 1, 2, … by the number of the signature.")
}

/// Writes a file of the results.
pub(crate) fn save(folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
    let path = folder.join(name);
    fs::write(&path, bytes).with_context(|| path.display().to_string())
}
