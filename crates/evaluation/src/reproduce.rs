//! `cargo xtask reproduce`: the paper's tables and figures from real meshes, with what it prints beside what we measure.
//!
//! Every algorithm gets the same meshes, patches, signatures and attacks, and is made as strong as gives the paper's d_rmse. What is
//! read is judged here; an algorithm sees bits only when it writes them. Sigmark, as people use it, is judged by its own verifier. Every suspect is moved by a random similarity before
//! anything is read from it.

use std::{
    fs::{self, File},
    path::Path,
    thread,
};

use anyhow::{Context, Result};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Curve, Signature, SigningKey};

pub use crate::options::Options;

use crate::{
    audit, bare,
    campaign::{Campaign, Failures},
    machine,
    models::{self, Candidate},
    pages, plan,
    process::root,
    progress::{Progress, duration},
    python::Python,
    results::Results,
    sources,
    store::Store,
    study::{SCHEME, Setup, Signed},
};

/// Signatures that are in no mesh, and that everything that is read is compared with.
const STRANGERS: usize = 2;

/// Runs what is not finished yet, and writes the pages. What is finished is kept in `.cache/reproduce`.
///
/// # Errors
/// When something is missing or can't be right, after the pages were written; when no work can be kept or no page written; without
/// Python, after a made-up surface was signed in place of it all.
pub fn run(options: &Options) -> Result<()> {
    plan::check_algorithms(&options.algorithm)?;
    let python = match Python::prepare() {
        Ok(python) => python,
        Err(missing) => return bare::run(&missing),
    };
    let mut failures = Failures::default();
    let candidates = candidates(options, &python, &mut failures)?;
    let folder = root().join(".cache/reproduce");
    let _lock = locked(&folder)?;
    let work = folder.join("work");
    // What an interrupted run left there is of no use.
    let _ = fs::remove_dir_all(&work);
    fs::create_dir_all(&work).with_context(|| work.display().to_string())?;
    let store = Store::open(&folder.join("cells"), options.keep)?;
    let commit = sources::commit();
    let key = SigningKey::generate(Curve::B163, &mut ChaCha20Rng::seed_from_u64(2012));
    let progress = plan::progress(&candidates, options);
    let setup = Setup {
        python: &python,
        store: &store,
        work: &work,
        signatures: &marks(&key, options.signatures)?,
        strangers: &strangers(&key)?,
        public_key: key.public_key(),
        progress: &progress,
        threads: thread::available_parallelism().map_or(1, usize::from),
    };
    println!(
        "{} model(s), {} signatures, {} threads. Ctrl-C does no harm: what is finished is kept in .cache/reproduce, and the same command goes on.",
        candidates.len(),
        setup.signatures.len(),
        setup.threads
    );
    let (mut outcomes, mut pictures) = (Vec::new(), Vec::new());
    for candidate in candidates {
        let standin = match candidate.open() {
            Ok(standin) => standin,
            Err(error) => {
                failures.tell(format!("{error:#}"));
                continue;
            }
        };
        let mut campaign = Campaign {
            setup: &setup,
            options,
            standin: &standin,
            failures: &mut failures,
        };
        match campaign.run(&mut pictures) {
            Ok(outcome) => outcomes.push(outcome),
            Err(error) => failures.tell(format!("{}: {error:#}", standin.model.name)),
        }
    }
    let results = Results {
        outcomes,
        failures: failures.0,
        signatures: setup.signatures.len(),
        pictures,
        foot: foot(&store, &python, &progress, &commit)?,
    };
    let output = options.folder();
    pages::write(&results, &output, options.full)?;
    println!("\nwritten: {}", output.display());
    audit::check(&results)
}

/// Keeps other runs of this task out of the folder, until the file is dropped.
fn locked(folder: &Path) -> Result<File> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let path = folder.join("lock");
    let file = File::create(&path).with_context(|| path.display().to_string())?;
    let shown = path.display();
    let locked = file.try_lock();
    locked.with_context(|| format!("{shown}: another reproduction is running here; wait for its end"))?;
    Ok(file)
}

/// The meshes to work on; what is missing among them is a failure only when all were asked for.
fn candidates(options: &Options, python: &Python, failures: &mut Failures) -> Result<Vec<Candidate>> {
    let Some(folder) = &options.meshes else {
        return Ok(vec![models::bunny(python.bunny()?)]);
    };
    let (found, missing) = models::in_folder(folder, &options.only)?;
    missing.into_iter().for_each(|line| failures.tell(line));
    Ok(found)
}

/// The marks: signatures of different messages with one key, which comes from a fixed seed and protects nothing.
fn marks(key: &SigningKey, count: usize) -> Result<Vec<Signed>> {
    let signed = |number| {
        let message = format!("Sigmark reproduction {}", number + 1);
        Ok(Signed {
            number,
            signature: key.sign(SCHEME, message.as_bytes())?,
            message,
        })
    };
    (0..count.max(1)).map(signed).collect()
}

/// Signatures of messages that no mesh bears, with the same key.
fn strangers(key: &SigningKey) -> Result<Vec<Signature>> {
    let signed = |number| {
        key.sign(
            SCHEME,
            format!("Sigmark reproduction, in no mesh {number}").as_bytes(),
        )
    };
    Ok((1..=STRANGERS).map(signed).collect::<Result<_, _>>()?)
}

/// Machine, versions, seeds, duration: what stands below the tables.
fn foot(store: &Store, python: &Python, progress: &Progress, commit: &str) -> Result<String> {
    let (found, of_other_code) = store.counts();
    let passed = duration(progress.passed().as_secs_f64());
    let mut foot = format!(
        "{}; {}. Code {}, sources' digest {}. This run took {passed}; {found} pieces of work were found finished",
        machine::description(),
        python.versions()?,
        commit,
        store.code(),
    );
    if of_other_code > 0 {
        foot += &format!(", {of_other_code} of them by another version of the code");
    }
    Ok(foot + ". Seeds: key 2012; attacks and poses 1, 2, … by the number of the signature.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_mark_is_compared_with_strangers_too() {
        let key = SigningKey::generate(Curve::B163, &mut ChaCha20Rng::seed_from_u64(2012));
        let (marks, strangers) = (marks(&key, 1).unwrap(), strangers(&key).unwrap());
        assert_eq!((marks.len(), strangers.len()), (1, 2));
        let right = |bits: &[bool], other: &[bool]| bits.iter().zip(other).filter(|(a, b)| a == b).count();
        for (i, stranger) in strangers.iter().enumerate() {
            let others = strangers[..i]
                .iter()
                .chain(marks.iter().map(|mark| &mark.signature));
            for other in others {
                let share = right(&stranger.bits(), &other.bits()) as f64 / 324.0;
                assert!((share - 0.5).abs() < 0.15, "{share}");
            }
        }
    }
}
