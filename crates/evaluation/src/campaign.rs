//! What is run on a model: algorithms, signatures and attacks, side by side.

use std::{
    fmt, fs, panic,
    sync::{Mutex, PoisonError},
    thread,
};

use anyhow::{Context, Result, bail};
use baselines::{Algorithm, AlgorithmId, BaselineError, Prepared, Reference, Subject, entries};
use job::{Job, JobError};

use crate::{
    figures,
    jobs::{self, Progress},
    models::{Candidate, Standin},
    paper::{self, Attack, Model},
    reading::Finder,
    reproduce::{Options, failed},
    results::{Column, Outcome, Trial},
    study::{Bench, Cell, Mark, Scene, Study, Target},
};

/// One model: every algorithm, signature and attack.
pub(crate) struct Campaign<'a> {
    pub(crate) bench: &'a Bench<'a>,
    pub(crate) options: &'a Options,
    pub(crate) progress: &'a Progress,
    pub(crate) standin: &'a Standin,
}

impl Campaign<'_> {
    /// What came out; what failed is told and added to the failures.
    pub(crate) fn run(
        &self,
        failures: &mut Vec<String>,
        pictures: &mut Vec<figures::Shown>,
    ) -> Result<Outcome> {
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
            let algorithm = OpenUntil {
                algorithm,
                progress: self.progress,
            };
            let study = Study::new(&scene, &algorithm, distortion);
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
            let why = if self.progress.is_over() {
                "no time was left".into()
            } else {
                format!("{error:#}")
            };
            failed(
                failures,
                format!("{}, {}: {why}", self.standin.model.name, column.algorithm),
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
        let attacks: Vec<&Attack> = model.all_attacks().collect();
        let numbers = 0..self.bench.signatures.len();
        let marked: Vec<_> = numbers.map(|number| (number, strength.alpha)).collect();
        let (marks, trials) = self.measured(study, &marked, &attacks, failures);
        column.trials = trials?.into_iter().flatten().collect();
        for mark in marks {
            column.marks.push(mark?);
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
            let swept = figures::SWEEP.map(|factor| (0, factor * strength.alpha));
            let (marks, trials) = self.measured(study, &swept, &attacks, failures);
            for (mark, trials) in marks.into_iter().zip(trials?) {
                column.sweep.push((mark?, trials));
            }
        }
        Ok(())
    }

    /// Marks, by signature and α, and their meshes under attacks. Marks are measured while meshes are attacked: measuring keeps one
    /// core busy at most.
    fn measured(
        &self,
        study: &Study<'_>,
        marked: &[(usize, f64)],
        attacks: &[&'static Attack],
        failures: &mut Vec<String>,
    ) -> (Vec<Result<Mark>>, Result<Vec<Vec<Trial>>>) {
        let is_finished = |&(number, alpha): &(usize, f64)| {
            let target = Target::Marked(number);
            attacks
                .iter()
                .all(|attack| study.kept(target, alpha, attack).is_some())
        };
        if !marked.iter().all(is_finished) && !self.progress.is_over() {
            // Both threads need it, and one would not wait for the other. A failure is met again, and told, below.
            let _ = study.prepare();
        }
        thread::scope(|scope| {
            let measure = || marked.iter().map(|&(number, alpha)| study.mark(number, alpha));
            let marks = scope.spawn(move || measure().collect::<Vec<_>>());
            let trials = marked
                .iter()
                .map(|&(number, alpha)| self.trials(study, Target::Marked(number), alpha, attacks, failures))
                .collect();
            let marks = marks.join().unwrap_or_else(|panic| panic::resume_unwind(panic));
            (marks, trials)
        })
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
        if !missing.is_empty() && !self.progress.is_over() {
            // All threads need it; computed by one of them it would keep the others waiting.
            study.prepare()?;
            let file = self.bench.work.join("marked.ply");
            study.write(target, alpha, &file)?;
            let reference = study.reference(target, alpha)?;
            let finder = Finder::new(&reference)?;
            let ended = Mutex::new(Vec::new());
            let work = |&i: &usize| {
                if self.progress.is_over() {
                    return;
                }
                let size = figures::size(&self.standin.model, study.algorithm, target, attacks[i]);
                let cell = study.cell(target, alpha, attacks[i], &finder, &file, size);
                let words = self.words(study, target, attacks[i], cell.as_ref());
                self.progress.done(vertices, Some(&words));
                ended
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .push((i, cell));
            };
            let bytes = |&i: &usize| bytes_of(vertices, attacks[i]);
            jobs::run(&missing, self.bench.threads, jobs::free_memory(), bytes, work);
            let _ = fs::remove_file(&file);
            for (i, cell) in ended.into_inner().unwrap_or_else(PoisonError::into_inner) {
                match cell {
                    Ok(cell) => done[i] = Some(cell),
                    Err(error) => {
                        failures.push(format!(
                            "{}: {error:#}",
                            self.name(study, target, attacks[i].name)
                        ));
                    }
                }
            }
        }
        let late = done.iter().filter(|cell| cell.is_none()).count();
        if late > 0 && self.progress.is_over() {
            let name = self.name(study, target, "no time was left");
            failed(failures, format!("{name} for {late} cells"));
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

    /// What is called `what` of a mesh: an attack, mostly.
    fn name(&self, study: &Study<'_>, target: Target, what: &str) -> String {
        let mesh = match target {
            Target::Marked(number) => format!("signature {}", number + 1),
            Target::Unmarked => "unmarked".into(),
        };
        let model = self.standin.model.name;
        format!("{model}, {}, {mesh}, {what}", study.algorithm.name())
    }

    /// A line of progress.
    fn words(
        &self,
        study: &Study<'_>,
        target: Target,
        attack: &Attack,
        cell: Result<&Cell, &anyhow::Error>,
    ) -> String {
        let name = self.name(study, target, attack.name);
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

/// An algorithm that prepares no mesh when the time is over; what it finished before is found.
struct OpenUntil<'a> {
    algorithm: Box<dyn Algorithm>,
    progress: &'a Progress,
}

/// As the algorithm's, by which finished work is known.
impl fmt::Debug for OpenUntil<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.algorithm.fmt(f)
    }
}

impl Algorithm for OpenUntil<'_> {
    fn id(&self) -> AlgorithmId {
        self.algorithm.id()
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        self.algorithm.parameters()
    }

    fn name(&self) -> String {
        self.algorithm.name()
    }

    fn reference(&self) -> Reference {
        self.algorithm.reference()
    }

    fn paper_alpha(&self) -> Option<f64> {
        self.algorithm.paper_alpha()
    }

    fn prepare(&self, subject: &Subject<'_>, job: &Job) -> Result<Box<dyn Prepared>, BaselineError> {
        if self.progress.is_over() {
            return Err(BaselineError::from(JobError::Cancelled));
        }
        self.algorithm.prepare(subject, job)
    }
}

/// The algorithms of a model: the paper's three, and on small models those that the paper did not try; MHBs alone on a model that is
/// there again.
fn algorithms(model: &Model, options: &Options) -> Vec<Box<dyn Algorithm>> {
    let beyond = options.meshes.is_some() && model.patches <= MOST_PATCHES_BEYOND;
    let wanted = |algorithm: &dyn Algorithm| {
        let name = algorithm.name();
        let asked = options.algorithms.is_empty() || options.algorithms.contains(&name);
        let usual = (beyond || model.printed(&name).is_some()) && !model.is_again();
        asked && (usual || name == "MHBs")
    };
    let all = entries(model.functions).into_iter();
    all.filter(|algorithm| wanted(algorithm.as_ref())).collect()
}

/// Fails if an algorithm was asked for by a name that none has.
pub(crate) fn check_names(asked: &[String]) -> Result<()> {
    let known: Vec<String> = entries(1).iter().map(|algorithm| algorithm.name()).collect();
    match asked.iter().find(|name| !known.contains(name)) {
        Some(name) => bail!(
            "--algorithm {name}: there is none of that name; there are {}",
            known.join("; ")
        ),
        None => Ok(()),
    }
}

/// Models with more patches are left to the paper's algorithms.
const MOST_PATCHES_BEYOND: usize = 5;

/// Unmarked meshes are read by MHBs for Fig. 11, and on the bunny by all.
fn reads_unmarked(algorithm: &str, model: &Model) -> bool {
    (algorithm == "MHBs" && !model.is_again()) || model.name == paper::BUNNY.name
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
pub(crate) fn progress(candidates: &[Candidate], options: &Options) -> Progress {
    let (mut pieces, mut vertices) = (0, 0.0);
    for candidate in candidates {
        let model = &candidate.model;
        for algorithm in algorithms(model, options) {
            let name = algorithm.name();
            let mut cells = options.signatures.max(1) * model.all_attacks().count();
            if reads_unmarked(&name, model) {
                cells += model.attacks().count();
            }
            if is_swept(&name, model, options) {
                cells += figures::SWEEP.len() * figures::swept_attacks().count();
            }
            pieces += cells;
            vertices += cells as f64 * model.size;
        }
    }
    Progress::new(pieces, vertices, options.closing)
}

/// What a cell needs at most: MeshLab's structures, and ours.
fn bytes_of(vertices: f64, attack: &Attack) -> u64 {
    const A_VERTEX: f64 = 3000.0;
    let growth = if attack.spec == "loop" { 3.0 } else { 1.0 };
    (growth * A_VERTEX * vertices) as u64 + (256 << 20)
}
