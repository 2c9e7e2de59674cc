//! What is planned for a model, run: marks are measured while meshes are attacked side by side. What fails is told, and the rest goes on.

use std::{fs, panic, thread};

use anyhow::{Context, Result};
use baselines::AlgorithmId;

use crate::{
    attacks::Attack,
    heat::Heat,
    jobs,
    models::Standin,
    options::Options,
    plan,
    results::{Column, Illustration, Outcome, Trial},
    study::{Cell, Mark, Scene, Setup, Study, Target},
};

/// One model: every algorithm, signature and attack.
pub(crate) struct Campaign<'a> {
    pub(crate) setup: &'a Setup<'a>,
    pub(crate) options: &'a Options,
    pub(crate) standin: &'a Standin,
    pub(crate) failures: &'a mut Failures,
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
    pub(crate) fn run(&mut self, pictures: &mut Vec<Illustration>) -> Result<Outcome> {
        let Standin {
            model,
            file,
            digest,
            mesh,
            ..
        } = self.standin;
        let (name, vertices) = (&model.name, mesh.vertex_count());
        println!(
            "{name}: {file}, {vertices} vertices in {} patch(es)",
            model.patches
        );
        let scene = Scene::new(self.setup, self.standin)?;
        let mut columns = Vec::new();
        let mut heat = Heat::new(self.standin);
        for marking in plan::markings(model, self.options) {
            // What the paper did not try is compared with MHBs, and so distorts as much.
            let printed = model
                .printed(&marking.id())
                .or_else(|| model.printed(&AlgorithmId::MHB));
            let distortion = printed.context("MHBs are in every table")?.d_rmse;
            let study = Study::new(&scene, marking.as_ref(), distortion);
            columns.push(self.column(&study, &mut heat));
        }
        pictures.extend(heat.painted()?);
        Ok(Outcome {
            model: model.clone(),
            file: file.clone(),
            digest: digest.clone(),
            vertices,
            columns,
        })
    }

    fn column(&mut self, study: &Study<'_>, heat: &mut Heat<'_>) -> Column {
        let mut column = Column {
            algorithm: study.marking.id(),
            name: study.marking.name(),
            distortion: study.distortion,
            preparation: None,
            strength: None,
            marks: Vec::new(),
            trials: Vec::new(),
            sweep: Vec::new(),
        };
        if let Err(error) = self.fill(study, &mut column, heat) {
            let why = match self.setup.progress.is_over() {
                true => "no time was left".into(),
                false => format!("{error:#}"),
            };
            let model = &self.standin.model.name;
            self.failures.tell(format!("{model}, {}: {why}", column.name));
        }
        column
    }

    fn fill(&mut self, study: &Study<'_>, column: &mut Column, heat: &mut Heat<'_>) -> Result<()> {
        column.preparation = Some(study.preparation()?);
        let strength = study.strength()?;
        column.strength = Some(strength);
        let (model, alpha) = (&self.standin.model, strength.alpha);
        let attacks = plan::attacks_on(&column.algorithm, model);
        let signatures = plan::signatures(&column.algorithm, self.setup.signatures.len());
        let marked: Vec<_> = (0..signatures)
            .map(|number| Target::marked(number, alpha))
            .collect();
        let (marks, trials) = self.measured(study, &marked, &attacks);
        column.trials = trials?.into_iter().flatten().collect();
        column.marks = marks.into_iter().collect::<Result<_>>()?;
        if heat.wants(&column.algorithm) {
            heat.add(&column.name, study.distances(0, alpha)?);
        }
        if plan::reads_unmarked(&column.algorithm, model) {
            let attacks: Vec<&Attack> = model.attacks().collect();
            let unmarked = self.trials(study, Target::unmarked(alpha), &attacks)?;
            column.trials.extend(unmarked);
        }
        if plan::is_swept(&column.algorithm, model, self.options) {
            let attacks: Vec<&Attack> = plan::swept_attacks().collect();
            let swept = plan::SWEEP.map(|factor| Target::marked(0, factor * alpha));
            let (marks, trials) = self.measured(study, &swept, &attacks);
            for (mark, trials) in marks.into_iter().zip(trials?) {
                column.sweep.push((mark?, trials));
            }
        }
        Ok(())
    }

    /// Marks, and their meshes under attacks. Marks are measured while meshes are attacked: measuring keeps one core busy at most.
    fn measured(
        &mut self,
        study: &Study<'_>,
        marked: &[Target],
        attacks: &[&'static Attack],
    ) -> (Vec<Result<Mark>>, Result<Vec<Vec<Trial>>>) {
        let is_missing = |target, attack: &&_| study.kept(target, attack).is_none();
        if marked
            .iter()
            .any(|&target| attacks.iter().any(|attack| is_missing(target, attack)))
        {
            // Both threads need it, and one would not wait for the other. A failure is met again, and told, below.
            let _ = study.prepare();
        }
        thread::scope(|scope| {
            let marks = scope.spawn(|| marked.iter().map(|&target| study.mark(target)).collect());
            let trials = marked.iter().map(|&target| self.trials(study, target, attacks));
            let trials = trials.collect();
            let marks = marks.join().unwrap_or_else(|panic| panic::resume_unwind(panic));
            (marks, trials)
        })
    }

    /// One mesh under several attacks: finished cells, and those that are finished now.
    fn trials(
        &mut self,
        study: &Study<'_>,
        target: Target,
        attacks: &[&'static Attack],
    ) -> Result<Vec<Trial>> {
        let progress = self.setup.progress;
        let mut done: Vec<Option<Cell>> = attacks.iter().map(|attack| study.kept(target, attack)).collect();
        // The last columns take longest: begun last, one of them would keep all other threads waiting.
        let missing: Vec<usize> = (0..attacks.len()).rev().filter(|&i| done[i].is_none()).collect();
        for _ in missing.len()..attacks.len() {
            progress.done(self.standin.model.size, None);
        }
        if !missing.is_empty() && !progress.is_over() {
            let wanted: Vec<&Attack> = missing.iter().map(|&i| attacks[i]).collect();
            for (cell, i) in self.computed(study, target, &wanted)?.into_iter().zip(missing) {
                match cell.transpose() {
                    Ok(cell) => done[i] = cell,
                    Err(error) => {
                        let name = self.name(study, target, &attacks[i].name);
                        self.failures.0.push(format!("{name}: {error:#}"));
                    }
                }
            }
        }
        let late = done.iter().filter(|cell| cell.is_none()).count();
        if late > 0 && progress.is_over() {
            let name = self.name(study, target, "no time was left");
            self.failures.tell(format!("{name} for {late} cells"));
        }
        let trial = |(&attack, cell): (&&'static Attack, Option<Cell>)| {
            Some(Trial {
                target,
                attack,
                cell: cell?,
                picture: study.picture(target, attack),
            })
        };
        Ok(attacks.iter().zip(done).filter_map(trial).collect())
    }

    /// Computes cells side by side, and says so; none where the time was over before it could begin.
    fn computed(
        &self,
        study: &Study<'_>,
        target: Target,
        attacks: &[&Attack],
    ) -> Result<Vec<Option<Result<Cell>>>> {
        let (progress, vertices) = (self.setup.progress, self.standin.model.size);
        // All threads need it; computed by one of them it would keep the others waiting.
        study.prepare()?;
        let file = self.setup.work.join("marked.ply");
        study.write(target, &file)?;
        let judge = study.judge(target)?;
        let algorithm = study.marking.id();
        let work = |&attack: &&Attack| {
            if progress.is_over() {
                return None;
            }
            let size = plan::picture_size(&self.standin.model, &algorithm, target, attack);
            let cell = study.cell(target, attack, judge.as_ref(), &file, size);
            progress.done(vertices, Some(&self.words(study, target, attack, cell.as_ref())));
            Some(cell)
        };
        let bytes = |attack: &&Attack| plan::bytes_of(vertices, attack);
        let cells = jobs::run(attacks, self.setup.threads, jobs::free_memory(), bytes, work);
        let _ = fs::remove_file(&file);
        Ok(cells)
    }

    /// What is called `what` of a mesh: an attack, mostly.
    fn name(&self, study: &Study<'_>, target: Target, what: &str) -> String {
        let mesh = match target.is_marked {
            true => format!("signature {}", target.signature + 1),
            false => "unmarked".into(),
        };
        let model = &self.standin.model.name;
        format!("{model}, {}, {mesh}, {what}", study.marking.name())
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
        let printed = self.standin.model.printed_rate(&study.marking.id(), attack);
        let printed = printed.filter(|_| target.is_marked);
        let printed = printed.map_or(String::new(), |printed| format!(", printed {printed}"));
        let seconds = cell.attack_seconds + cell.registration_seconds + cell.reading_seconds;
        format!("{name}: {}{printed}; {seconds:.1} s", cell.rates_in_words())
    }
}
