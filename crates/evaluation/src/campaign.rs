//! What is planned for a model, run: marks are measured while meshes are attacked side by side. What fails is told, and the rest goes on.

use std::{
    fs, panic,
    sync::{Mutex, PoisonError},
    thread,
};

use anyhow::{Context, Result};
use baselines::AlgorithmId;

use crate::{
    attacks::Attack,
    heat::Heat,
    jobs,
    models::Standin,
    options::Options,
    plan,
    reading::Finder,
    results::{Column, Illustration, Outcome, Trial},
    study::{Cell, Mark, Scene, Setup, Study, Target},
};

/// One model: every algorithm, signature and attack.
pub(crate) struct Campaign<'a> {
    pub(crate) setup: &'a Setup<'a>,
    pub(crate) options: &'a Options,
    pub(crate) standin: &'a Standin,
}

/// What could not be done, in words; told when it is met.
#[derive(Default)]
pub(crate) struct Failures(pub(crate) Vec<String>);

impl Failures {
    pub(crate) fn tell(&mut self, what: String) {
        eprintln!("{what}");
        self.0.push(what);
    }
}

impl Campaign<'_> {
    /// What came out.
    pub(crate) fn run(&self, failures: &mut Failures, pictures: &mut Vec<Illustration>) -> Result<Outcome> {
        let standin = self.standin;
        println!(
            "{}: {}, {} vertices in {} patch(es)",
            standin.model.name,
            standin.file,
            standin.mesh.vertex_count(),
            standin.model.patches
        );
        let scene = Scene::new(self.setup, standin)?;
        let mut columns = Vec::new();
        let mut heat = Heat::new(standin);
        for algorithm in plan::algorithms(&standin.model, self.options) {
            let printed = standin.model.printed(&algorithm.id());
            // What the paper did not try is compared with MHBs, and so distorts as much.
            let distortion = printed.or_else(|| standin.model.printed(&AlgorithmId::MHB));
            let distortion = distortion.context("MHBs are in every table")?.d_rmse;
            let study = Study::new(&scene, algorithm.as_ref(), distortion);
            columns.push(self.column(&study, failures, &mut heat));
        }
        pictures.extend(heat.painted()?);
        Ok(Outcome {
            model: standin.model.clone(),
            file: standin.file.clone(),
            digest: standin.digest.clone(),
            vertices: standin.mesh.vertex_count(),
            columns,
        })
    }

    fn column(&self, study: &Study<'_>, failures: &mut Failures, heat: &mut Heat<'_>) -> Column {
        let mut column = Column {
            algorithm: study.algorithm.id(),
            name: study.algorithm.name(),
            distortion: study.distortion,
            preparation: None,
            strength: None,
            marks: Vec::new(),
            trials: Vec::new(),
            sweep: Vec::new(),
        };
        if let Err(error) = self.fill(study, &mut column, failures, heat) {
            let why = if self.setup.progress.is_over() {
                "no time was left".into()
            } else {
                format!("{error:#}")
            };
            failures.tell(format!("{}, {}: {why}", self.standin.model.name, column.name));
        }
        column
    }

    fn fill(
        &self,
        study: &Study<'_>,
        column: &mut Column,
        failures: &mut Failures,
        heat: &mut Heat<'_>,
    ) -> Result<()> {
        column.preparation = Some(study.preparation()?);
        let strength = study.strength()?;
        column.strength = Some(strength);
        let model = &self.standin.model;
        let attacks: Vec<&Attack> = plan::all_attacks(model).collect();
        let numbers = 0..self.setup.signatures.len();
        let marked: Vec<_> = numbers.map(|number| (number, strength.alpha)).collect();
        let (marks, trials) = self.measured(study, &marked, &attacks, failures);
        column.trials = trials?.into_iter().flatten().collect();
        for mark in marks {
            column.marks.push(mark?);
        }
        if heat.wants(&column.algorithm) {
            heat.add(&column.name, study.distances(0, strength.alpha)?);
        }
        if plan::reads_unmarked(&column.algorithm, model) {
            let attacks: Vec<&Attack> = model.attacks().collect();
            column
                .trials
                .extend(self.trials(study, Target::Unmarked, strength.alpha, &attacks, failures)?);
        }
        if plan::is_swept(&column.algorithm, model, self.options) {
            let attacks: Vec<&Attack> = plan::swept_attacks().collect();
            let swept = plan::SWEEP.map(|factor| (0, factor * strength.alpha));
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
        failures: &mut Failures,
    ) -> (Vec<Result<Mark>>, Result<Vec<Vec<Trial>>>) {
        let is_finished = |&(number, alpha): &(usize, f64)| {
            let target = Target::Marked(number);
            attacks
                .iter()
                .all(|attack| study.kept(target, alpha, attack).is_some())
        };
        if !marked.iter().all(is_finished) {
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

    /// One mesh under several attacks: finished cells, and those that are finished now.
    fn trials(
        &self,
        study: &Study<'_>,
        target: Target,
        alpha: f64,
        attacks: &[&'static Attack],
        failures: &mut Failures,
    ) -> Result<Vec<Trial>> {
        let progress = self.setup.progress;
        let mut done: Vec<Option<Cell>> = attacks
            .iter()
            .map(|attack| study.kept(target, alpha, attack))
            .collect();
        let missing: Vec<usize> = (0..attacks.len()).filter(|&i| done[i].is_none()).collect();
        for _ in missing.len()..attacks.len() {
            progress.done(self.standin.model.size, None);
        }
        if !missing.is_empty() && !progress.is_over() {
            let wanted: Vec<&Attack> = missing.iter().map(|&i| attacks[i]).collect();
            for (cell, &i) in self
                .computed(study, target, alpha, &wanted)?
                .into_iter()
                .zip(&missing)
            {
                match cell.transpose() {
                    Ok(cell) => done[i] = cell,
                    Err(error) => {
                        let name = self.name(study, target, &attacks[i].name);
                        failures.0.push(format!("{name}: {error:#}"));
                    }
                }
            }
        }
        let late = done.iter().filter(|cell| cell.is_none()).count();
        if late > 0 && progress.is_over() {
            let name = self.name(study, target, "no time was left");
            failures.tell(format!("{name} for {late} cells"));
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

    /// Computes cells side by side, and says so; none where the time was over before it could begin.
    fn computed(
        &self,
        study: &Study<'_>,
        target: Target,
        alpha: f64,
        attacks: &[&Attack],
    ) -> Result<Vec<Option<Result<Cell>>>> {
        let (progress, vertices) = (self.setup.progress, self.standin.model.size);
        // All threads need it; computed by one of them it would keep the others waiting.
        study.prepare()?;
        let file = self.setup.work.join("marked.ply");
        study.write(target, alpha, &file)?;
        let reference = study.reference(target, alpha)?;
        let finder = Finder::new(&reference)?;
        let cells: Vec<Mutex<Option<Result<Cell>>>> = attacks.iter().map(|_| Mutex::new(None)).collect();
        let work = |&i: &usize| {
            if progress.is_over() {
                return;
            }
            let algorithm = study.algorithm.id();
            let size = plan::picture_size(&self.standin.model, &algorithm, target, attacks[i]);
            let cell = study.cell(target, alpha, attacks[i], &finder, &file, size);
            let words = self.words(study, target, attacks[i], cell.as_ref());
            progress.done(vertices, Some(&words));
            *cells[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(cell);
        };
        let order: Vec<usize> = (0..attacks.len()).collect();
        let bytes = |&i: &usize| plan::bytes_of(vertices, attacks[i]);
        jobs::run(&order, self.setup.threads, jobs::free_memory(), bytes, work);
        let _ = fs::remove_file(&file);
        let cells = cells.into_iter();
        Ok(cells
            .map(|cell| cell.into_inner().unwrap_or_else(PoisonError::into_inner))
            .collect())
    }

    /// What is called `what` of a mesh: an attack, mostly.
    fn name(&self, study: &Study<'_>, target: Target, what: &str) -> String {
        let mesh = match target {
            Target::Marked(number) => format!("signature {}", number + 1),
            Target::Unmarked => "unmarked".into(),
        };
        let model = &self.standin.model.name;
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
        let name = self.name(study, target, &attack.name);
        let cell = match cell {
            Ok(cell) => cell,
            Err(error) => return format!("{name}: {error:#}"),
        };
        let printed = self.standin.model.printed_rate(&study.algorithm.id(), attack);
        let printed = match (target, printed) {
            (Target::Marked(_), Some(printed)) => format!(", printed {printed}"),
            _ => String::new(),
        };
        let seconds = cell.attack_seconds + cell.registration_seconds + cell.reading_seconds;
        format!("{name}: {}{printed}; {seconds:.1} s", cell.rates_in_words())
    }
}
