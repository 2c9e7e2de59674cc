//! The draws of one mesh.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use evaluation::{attacks::random_similarity, python::Python};
use job::Job;
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::Asset;
use registration::{AlignOptions, Aligner};
use serde_json::json;

use super::{
    draw::{PoseDraw, TrialDraws},
    reading::{MarkedMesh, ReadingRule},
    trial::PoseTrial,
};
use crate::{
    kept::{self, Key},
    measure::timed,
    suspects::{attacked, misfit},
};

/// Draws of each trial before the next trial of a mesh has its turn, so that a run that ends early has some of each.
const ROUND: u64 = 4;

/// One mesh, and what its draws need.
pub(crate) struct MeshRuns<'a> {
    pub(crate) name: String,
    pub(crate) original: &'a TriMesh,
    /// The file of another model; none where there is no other, and no stranger among the trials.
    pub(crate) stranger: Option<&'a Path>,
    pub(crate) attacks: &'a Python,
    /// Where finished draws are kept.
    pub(crate) folder: PathBuf,
    /// Made by the first draw that is not finished.
    pub(crate) prepared: Option<(Aligner, MarkedMesh)>,
    pub(crate) may_begin: &'a dyn Fn() -> bool,
}

impl MeshRuns<'_> {
    /// The draws of all trials, in rounds.
    pub(crate) fn all(&mut self, trials: &[PoseTrial], draws: u64) -> Result<Vec<TrialDraws>> {
        let none = |&trial: &PoseTrial| TrialDraws {
            mesh: self.name.clone(),
            vertices: self.original.vertex_count(),
            trial,
            draws: Vec::new(),
        };
        let mut all: Vec<TrialDraws> = trials.iter().map(none).collect();
        for first in (0..draws).step_by(ROUND as usize) {
            for of_trial in &mut all {
                self.round(of_trial, first..(first + ROUND).min(of_trial.trial.draws(draws)))?;
            }
        }
        all.retain(|of_trial| !of_trial.draws.is_empty());
        Ok(all)
    }

    /// Adds these draws of a trial, and tells what is not right.
    fn round(&mut self, all: &mut TrialDraws, numbers: std::ops::Range<u64>) -> Result<()> {
        if numbers.is_empty() {
            return Ok(());
        }
        for number in numbers {
            let Some(draw) = self.finished(all.trial, number)? else {
                continue;
            };
            if !draw.is_right(all.trial, ReadingRule::LeastSquares) {
                let shown = serde_json::to_string(&draw)?;
                println!("{}, {}, draw {number}: {shown}", all.mesh, all.trial.name());
            }
            all.draws.push(draw);
        }
        if !all.draws.is_empty() {
            println!("{}", all.words());
        }
        Ok(())
    }

    /// A draw as it was finished before, or now; none when the time is over.
    fn finished(&mut self, trial: PoseTrial, number: u64) -> Result<Option<PoseDraw>> {
        let kept: String = trial.name().chars().filter(char::is_ascii_alphanumeric).collect();
        let mut key = Key::new(format!("{}-{kept}-{number}", self.name)).of_mesh(self.original);
        if let Some(stranger) = self.stranger.filter(|_| trial.is_stranger()) {
            key = key.of_asset(&Asset::open(stranger)?);
        }
        let folder = self.folder.clone();
        if !kept::is_finished::<PoseDraw>(&folder, &key) && !(self.may_begin)() {
            return Ok(None);
        }
        kept::figures(&folder, &key, || self.draw(trial, number)).map(Some)
    }

    fn prepared(&mut self) -> Result<&mut (Aligner, MarkedMesh)> {
        if self.prepared.is_none() {
            let aligner = Aligner::new(self.original, &AlignOptions::default())?;
            self.prepared = Some((aligner, MarkedMesh::new(self.original)?));
        }
        self.prepared.as_mut().context("just prepared")
    }

    fn draw(&mut self, trial: PoseTrial, number: u64) -> Result<PoseDraw> {
        let mut moved = random_similarity(self.original, number);
        if trial.is_mirrored() {
            moved.rotation = moved.rotation.map(|[x, y, z]| [-x, y, z]);
        }
        let (name, suspect) = match trial.attack(number) {
            Some((attack, seed)) => {
                let marked_name = format!("{}-marked", self.name);
                let attacks = self.attacks;
                let marked = self.prepared()?.1.mesh();
                let suspect = attacked(attacks, marked, &marked_name, &attack.spec, seed)?;
                (format!("{}-{seed}", attack.spec), suspect)
            }
            None => {
                let stranger = self.stranger.context("there is no other model")?;
                (String::new(), Asset::open(stranger)?.mesh().clone())
            }
        };
        let there = shapes::moved(&suspect, &moved);
        let (aligner, marked) = self.prepared()?;
        let (found, cost) = timed(|| aligner.align(&there, &Job::default()));
        let found = found?;
        let rates = if found.aligned && !trial.is_stranger() {
            Some(marked.rates(&name, &suspect, &moved, &found)?)
        } else {
            None
        };
        Ok(PoseDraw {
            aligned: found.aligned,
            error: self.error(&suspect, &moved.then(&found.transform)),
            exact_error: self.exact_error(trial, number, &moved)?,
            hand_recognised: found.mirrored() == trial.is_mirrored(),
            rates,
            overlap: found.overlap,
            cpu: cost.cpu,
            diagnostics: json!({
                "matched_by": found.matched_by,
                "coverage": found.coverage,
                "residual": found.residual,
                "alternatives": found.alternatives.len(),
                "free_directions": found.free_directions,
                "wall": cost.wall,
            }),
        })
    }

    /// How far the unmarked suspect is off, where it lies exactly on the original.
    fn exact_error(&mut self, trial: PoseTrial, number: u64, moved: &Similarity) -> Result<Option<f64>> {
        let Some((attack, seed)) = trial.attack(number).filter(|_| trial.is_exact()) else {
            return Ok(None);
        };
        let suspect = attacked(self.attacks, self.original, &self.name, &attack.spec, seed)?;
        let there = shapes::moved(&suspect, moved);
        let found = self.prepared()?.0.align(&there, &Job::default())?;
        Ok(Some(self.error(&suspect, &moved.then(&found.transform))))
    }

    /// By how much a suspect that went there and back is off, over the original's diagonal.
    fn error(&self, suspect: &TriMesh, there_and_back: &Similarity) -> f64 {
        misfit(suspect, there_and_back) / self.original.bounding_box().diagonal()
    }
}
