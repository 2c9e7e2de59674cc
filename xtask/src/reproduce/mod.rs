//! `cargo xtask reproduce`: the paper's tables and figures from real meshes, with what it prints beside what we measure.
//!
//! Every algorithm gets the same meshes, patches, signatures and attacks, and is made as strong as gives the paper's d_rmse. What is
//! read is judged here; an algorithm sees bits only when it writes them. Every suspect is moved by a random similarity before
//! anything is read from it.
//!
//! `paper` holds the printed figures, `models` the meshes, `study` one algorithm on one mesh, `reading` the way from a suspect to
//! bits, `store` what is finished, `jobs` what runs side by side. `tables`, `roc`, `figures` and `page` write what came out; `audit` looks for
//! what can't be right.

mod audit;
mod bare;
mod figures;
mod jobs;
mod models;
mod page;
mod paper;
mod reading;
mod roc;
mod sheet;
mod store;
mod study;
mod tables;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Mutex,
    thread,
};

use anyhow::{Context, Result};
use baselines::{Algorithm, entries};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::signature::{Curve, SigningKey};

use self::{
    jobs::{Progress, duration},
    models::{Candidate, Standin},
    paper::{Attack, Model},
    store::Store,
    study::{Bench, Cell, Mark, Preparation, SCHEME, Scene, Signed, Strength, Study, Target},
};
use crate::{process::root, python::Python};

/// What to reproduce.
pub(crate) struct Options {
    /// Where the tables go.
    pub(crate) output: PathBuf,
    /// The folder of the six models; the bunny alone without one.
    pub(crate) meshes: Option<PathBuf>,
    /// Models or files by name; all when empty.
    pub(crate) only: Vec<String>,
    /// Algorithms by name; all when empty.
    pub(crate) algorithms: Vec<String>,
    pub(crate) signatures: usize,
    /// Takes finished work of other versions of the code.
    pub(crate) keep: bool,
}

/// What came out for one model.
pub(crate) struct Outcome {
    pub(crate) model: Model,
    pub(crate) file: String,
    pub(crate) digest: String,
    pub(crate) vertices: usize,
    pub(crate) columns: Vec<Column>,
}

/// What came out for one algorithm on one model.
pub(crate) struct Column {
    pub(crate) algorithm: String,
    /// d_rmse that was aimed at, in per cent.
    pub(crate) distortion: f64,
    pub(crate) preparation: Option<Preparation>,
    pub(crate) strength: Option<Strength>,
    pub(crate) marks: Vec<Mark>,
    pub(crate) trials: Vec<Trial>,
    /// At several strengths, in ascending order: Fig. 2.
    pub(crate) sweep: Vec<(Mark, Vec<Trial>)>,
}

/// A cell that is finished.
pub(crate) struct Trial {
    pub(crate) target: Target,
    pub(crate) attack: &'static Attack,
    pub(crate) cell: Cell,
    /// Of the suspect, as PNG, where a figure wants it.
    pub(crate) picture: Option<Vec<u8>>,
}

/// Everything that the tables are made of.
pub(crate) struct Results {
    pub(crate) outcomes: Vec<Outcome>,
    /// What could not be done, in words.
    pub(crate) failures: Vec<String>,
    pub(crate) signatures: usize,
    /// The heat maps of Figs. 4 and 5: file name, caption, PNG.
    pub(crate) pictures: Vec<figures::Shown>,
    pub(crate) foot: String,
}

pub(crate) fn run(options: &Options) -> Result<()> {
    let python = match Python::prepare() {
        Ok(python) => python,
        Err(missing) => return bare::run(&missing),
    };
    let (candidates, mut failures) = candidates(options, &python)?;
    let folder = root().join(".cache/reproduce");
    let work = folder.join("work");
    fs::create_dir_all(&work).with_context(|| work.display().to_string())?;
    let store = Store::open(&folder.join("cells"), options.keep)?;
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
    let progress = progress(&candidates, options);
    let mut outcomes = Vec::new();
    let mut pictures = Vec::new();
    for candidate in candidates {
        let shown = candidate.path().display().to_string();
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
            Err(error) => failed(&mut failures, format!("{shown}: {error:#}")),
        }
    }
    let foot = foot(&bench, &python, &progress)?;
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

fn failed(failures: &mut Vec<String>, what: String) {
    eprintln!("{what}");
    failures.push(what);
}

/// The meshes to work on; what is missing among them is a failure only when all were asked for.
fn candidates(options: &Options, python: &Python) -> Result<(Vec<Candidate>, Vec<String>)> {
    let Some(folder) = &options.meshes else {
        return Ok((vec![models::bunny(python.bunny()?)], Vec::new()));
    };
    let (found, missing) = models::in_folder(folder, &options.only)?;
    let words = |name: &str| format!("{}: no mesh file {name}; its rows are missing", folder.display());
    let missing: Vec<String> = missing.into_iter().map(words).collect();
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

/// The algorithms of a model: the paper's three, and on small models those that the paper did not try.
fn algorithms(model: &Model, options: &Options) -> Vec<Box<dyn Algorithm>> {
    let beyond = options.meshes.is_some() && model.patches <= MOST_PATCHES_BEYOND;
    let wanted = |algorithm: &dyn Algorithm| {
        let name = algorithm.name();
        let asked = options.algorithms.is_empty() || options.algorithms.contains(&name);
        asked && (beyond || model.printed(&name).is_some())
    };
    let all = entries(model.functions).into_iter();
    all.filter(|algorithm| wanted(algorithm.as_ref())).collect()
}

/// Models with more patches are left to the paper's algorithms.
const MOST_PATCHES_BEYOND: usize = 5;

/// Unmarked meshes are read by MHBs for Fig. 11, and on the bunny by all.
fn reads_unmarked(algorithm: &str, model: &Model) -> bool {
    algorithm == "MHBs" || model.name == paper::BUNNY.name
}

/// The model whose α is swept: the paper's eros, or the bunny where it is alone.
fn is_swept(algorithm: &str, model: &Model, options: &Options) -> bool {
    let swept = if options.meshes.is_some() {
        paper::EROS
    } else {
        paper::BUNNY
    };
    algorithm == "MHBs" && model.name == swept.name
}

/// The pieces of work that a run has, before it is known which are finished.
fn progress(candidates: &[Candidate], options: &Options) -> Progress {
    let (mut pieces, mut vertices) = (0, 0.0);
    for candidate in candidates {
        let model = &candidate.model;
        for algorithm in algorithms(model, options) {
            let name = algorithm.name();
            let mut runs = options.signatures.max(1) + usize::from(reads_unmarked(&name, model));
            let mut cells = runs * model.attacks().count();
            if is_swept(&name, model, options) {
                runs = figures::SWEEP.len();
                cells += runs * figures::swept_attacks().count();
            }
            pieces += cells;
            vertices += cells as f64 * model.size;
        }
    }
    Progress::new(pieces, vertices)
}

/// One model: every algorithm, signature and attack.
struct Campaign<'a> {
    bench: &'a Bench<'a>,
    options: &'a Options,
    progress: &'a Progress,
    standin: &'a Standin,
}

impl Campaign<'_> {
    fn run(&self, failures: &mut Vec<String>, pictures: &mut Vec<figures::Shown>) -> Result<Outcome> {
        let (bench, standin) = (self.bench, self.standin);
        println!(
            "{}: {}, {} vertices in {} patch(es)",
            standin.model.name,
            standin.file,
            standin.mesh.vertex_count(),
            standin.model.patches
        );
        let scene = Scene::new(bench, standin)?;
        let mut columns = Vec::new();
        let mut heat = figures::Heat::new(standin);
        for algorithm in algorithms(&standin.model, self.options) {
            let printed = standin.model.printed(&algorithm.name());
            // What the paper did not try is compared with MHBs, and so distorts as much.
            let distortion = printed.or_else(|| standin.model.printed("MHBs"));
            let distortion = distortion.context("MHBs are in every table")?.row.d_rmse;
            let study = Study::new(&scene, algorithm.as_ref(), distortion);
            let column = self.column(&study, failures, &mut heat);
            columns.push(column);
        }
        pictures.extend(heat.painted()?);
        Ok(Outcome {
            model: standin.model,
            file: standin.file.clone(),
            digest: standin.digest.clone(),
            vertices: standin.mesh.vertex_count(),
            columns,
        })
    }

    fn column(&self, study: &Study<'_>, failures: &mut Vec<String>, heat: &mut figures::Heat<'_>) -> Column {
        let mut column = Column {
            algorithm: study.algorithm.name(),
            distortion: study.distortion,
            preparation: None,
            strength: None,
            marks: Vec::new(),
            trials: Vec::new(),
            sweep: Vec::new(),
        };
        if let Err(error) = self.fill(study, &mut column, failures, heat) {
            failed(
                failures,
                format!("{}, {}: {error:#}", self.standin.model.name, column.algorithm),
            );
        }
        column
    }

    fn fill(
        &self,
        study: &Study<'_>,
        column: &mut Column,
        failures: &mut Vec<String>,
        heat: &mut figures::Heat<'_>,
    ) -> Result<()> {
        column.preparation = Some(study.preparation()?);
        let strength = study.strength()?;
        column.strength = Some(strength);
        let model = &self.standin.model;
        for number in 0..self.bench.signatures.len() {
            column.marks.push(study.mark(number, strength.alpha)?);
            let target = Target::Marked(number);
            let attacks: Vec<&Attack> = model.attacks().collect();
            column
                .trials
                .extend(self.trials(study, target, strength.alpha, &attacks, failures)?);
        }
        if heat.wants(&column.algorithm) {
            heat.add(&column.algorithm, study.distances(0, strength.alpha)?);
        }
        if reads_unmarked(&column.algorithm, model) {
            let attacks: Vec<&Attack> = model.attacks().collect();
            column
                .trials
                .extend(self.trials(study, Target::Unmarked, strength.alpha, &attacks, failures)?);
        }
        if is_swept(&column.algorithm, model, self.options) {
            let attacks: Vec<&Attack> = figures::swept_attacks().collect();
            for factor in figures::SWEEP {
                let alpha = factor * strength.alpha;
                let mark = study.mark(0, alpha)?;
                let trials = self.trials(study, Target::Marked(0), alpha, &attacks, failures)?;
                column.sweep.push((mark, trials));
            }
        }
        Ok(())
    }

    /// One mesh under several attacks, side by side. What fails is told, and the others go on.
    fn trials(
        &self,
        study: &Study<'_>,
        target: Target,
        alpha: f64,
        attacks: &[&'static Attack],
        failures: &mut Vec<String>,
    ) -> Result<Vec<Trial>> {
        let vertices = self.standin.model.size;
        let mut done: Vec<Option<Cell>> = attacks
            .iter()
            .map(|attack| study.kept(target, alpha, attack))
            .collect();
        let missing: Vec<usize> = (0..attacks.len()).filter(|&i| done[i].is_none()).collect();
        for _ in missing.len()..attacks.len() {
            self.progress.done(vertices, None);
        }
        if !missing.is_empty() {
            // All threads need it; computed by one of them it would keep the others waiting.
            study.prepare()?;
            let file = self.bench.work.join(format!("marked-{}.ply", std::process::id()));
            study.write(target, alpha, &file)?;
            let ended = Mutex::new(Vec::new());
            let work = |&i: &usize| {
                let size = figures::size(&self.standin.model, study.algorithm, target, attacks[i]);
                let cell = study.cell(target, alpha, attacks[i], &file, size);
                let words = self.words(study, target, attacks[i], cell.as_ref());
                self.progress.done(vertices, Some(&words));
                ended
                    .lock()
                    .unwrap_or_else(std::sync::PoisonError::into_inner)
                    .push((i, cell));
            };
            let bytes = |&i: &usize| bytes_of(vertices, attacks[i]);
            jobs::run(&missing, self.bench.threads, jobs::free_memory(), bytes, work);
            let _ = fs::remove_file(&file);
            for (i, cell) in ended
                .into_inner()
                .unwrap_or_else(std::sync::PoisonError::into_inner)
            {
                match cell {
                    Ok(cell) => done[i] = Some(cell),
                    Err(error) => {
                        failures.push(format!("{}: {error:#}", self.name(study, target, attacks[i])))
                    }
                }
            }
        }
        let finished = attacks.iter().zip(done);
        Ok(finished
            .filter_map(|(&attack, cell)| {
                Some(Trial {
                    target,
                    attack,
                    cell: cell?,
                    picture: study.picture(target, alpha, attack),
                })
            })
            .collect())
    }

    fn name(&self, study: &Study<'_>, target: Target, attack: &Attack) -> String {
        let mesh = match target {
            Target::Marked(number) => format!("signature {}", number + 1),
            Target::Unmarked => "unmarked".into(),
        };
        let model = self.standin.model.name;
        format!("{model}, {}, {mesh}, {}", study.algorithm.name(), attack.name)
    }

    /// A line of progress.
    fn words(
        &self,
        study: &Study<'_>,
        target: Target,
        attack: &Attack,
        cell: Result<&Cell, &anyhow::Error>,
    ) -> String {
        let name = self.name(study, target, attack);
        let cell = match cell {
            Ok(cell) => cell,
            Err(error) => return format!("{name}: {error:#}"),
        };
        let rates: Vec<String> = cell
            .readings
            .iter()
            .map(|rated| format!("{:.2} % ({})", 100.0 * rated.rate, rated.detector))
            .collect();
        let printed = self.standin.model.printed(&study.algorithm.name());
        let printed = printed.and_then(|printed| printed.row.rate(attack.name));
        let printed = match (target, printed) {
            (Target::Marked(_), Some(printed)) => format!(", printed {printed}"),
            _ => String::new(),
        };
        let seconds = cell.attack_seconds + cell.registration_seconds + cell.reading_seconds;
        format!("{name}: {}{printed}; {seconds:.1} s", rates.join(", "))
    }
}

/// What a cell needs at most: MeshLab's structures, and ours.
fn bytes_of(vertices: f64, attack: &Attack) -> u64 {
    const A_VERTEX: f64 = 3000.0;
    let growth = if attack.spec == "loop" { 3.0 } else { 1.0 };
    (growth * A_VERTEX * vertices) as u64 + (256 << 20)
}

/// Machine, versions, seeds, duration: what stands below the tables.
fn foot(bench: &Bench<'_>, python: &Python, progress: &Progress) -> Result<String> {
    let (found, of_other_code) = bench.store.counts();
    let passed = duration(progress.passed().as_secs_f64());
    let mut foot = format!(
        "{}; {}. Code {}, sources' digest {}. This run took {passed}; {found} pieces of work were found finished",
        crate::machine::description(),
        python.versions()?,
        commit(),
        bench.store.code(),
    );
    if of_other_code > 0 {
        foot += &format!(", {of_other_code} of them by another version of the code");
    }
    Ok(foot + ". Seeds: key 2012; attacks and poses 1, 2, … by the number of the signature.")
}

/// The commit that is checked out, and whether files differ from it.
fn commit() -> String {
    let git = |words: &[&str]| {
        let mut command = std::process::Command::new("git");
        crate::process::output(command.current_dir(root()).args(words)).ok()
    };
    let Some(head) = git(&["rev-parse", "--short", "HEAD"]) else {
        return "of an unknown commit".into();
    };
    let changed = git(&["status", "--porcelain", "--", "crates", "attacks", "xtask"]);
    let changed = changed.is_some_and(|files| !files.trim().is_empty());
    format!("{}{}", head.trim(), if changed { " with changes" } else { "" })
}

/// Writes a file of the results.
pub(crate) fn save(folder: &Path, name: &str, bytes: &[u8]) -> Result<()> {
    let path = folder.join(name);
    fs::write(&path, bytes).with_context(|| path.display().to_string())
}
