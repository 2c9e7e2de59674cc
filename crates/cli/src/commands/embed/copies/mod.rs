//! One model signed for every recipient of a list, each copy in a folder of its own.
//!
//! A copy is written before its certificate, so that a certificate says that its copy was whole. Signatures have no randomness in them: a run that goes
//! on where another stopped writes what that would have written.

mod copy;
mod index;
mod recipients;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use anyhow::{Context, Result, bail};
use job::Job;
use mesh_io::Asset;
use quality::{FacetTurn, TurnSummary};
use serde_json::json;
use sigmark::{Embedder, Prediction, Prepared, Strength};

use self::{
    copy::{Copy, Rules, There},
    index::Index,
    recipients::Recipient,
};
use super::{Attempt, Task, check_manifest, companions, embedder, file_name, object, words};
use crate::{Answer, args::Embed, batch, claims, files, keys, progress::Progress, report};

/// Bytes that copies in the making may take together.
const ROOM: u64 = 4 << 30;

/// What one takes for a vertex of the mesh, beside the bytes of its file a few times over.
const BYTES_A_VERTEX: u64 = 512;

/// By how much the facets of a copy turned, and what its mark is good for.
#[derive(Clone, Copy)]
struct Turn {
    summary: TurnSummary,
    flipped: usize,
    prediction: Prediction,
}

impl Turn {
    /// The worst of two copies in each respect.
    fn worse(self, other: Self) -> Self {
        let facets = |turn: &Self| (turn.flipped, turn.summary.max);
        let turned = if facets(&other) > facets(&self) {
            other
        } else {
            self
        };
        let weaker = other.prediction.margin < self.prediction.margin;
        Self {
            prediction: if weaker { other.prediction } else { self.prediction },
            ..turned
        }
    }
}

/// What was done.
pub(super) struct Made<'a> {
    pub(super) copies: &'a [Copy],
    pub(super) prepared: &'a Prepared,
    /// Of each copy, whether it is new.
    pub(super) is_new: Vec<bool>,
    pub(super) index: PathBuf,
}

impl Made<'_> {
    pub(super) fn new_ones(&self) -> usize {
        self.is_new.iter().filter(|&&is_new| is_new).count()
    }
}

pub(super) fn run(arguments: &Embed, list: &Path) -> Result<Answer> {
    let model = model(arguments)?;
    let mut copies = planned(arguments, model, recipients::read(list)?)?;
    let index = Index::of(&arguments.output, arguments.force)?;
    check(arguments, model, list, &copies, &index.path)?;
    let embedder = embedder(arguments, &keys::read_private(&arguments.key)?)?;
    batch::make_folder_of(&index.path)?;
    files::check_free(&index.path, true)?;

    let progress = Arc::new(Progress::new());
    let job = progress.job(arguments.common.threads());
    progress.begin("reading", "reading");
    let asset = files::open_mesh(model)?;
    check_manifest(&asset, model, arguments.c2pa)?;
    let run = Run {
        arguments,
        model,
        asset: &asset,
        progress: &progress,
        job: &job,
    };
    let embedder = embedder
        .original_name(file_name(model))
        .rig(claims::rig_of(&asset, model).as_ref());
    let prepared = run.prepared(embedder, &mut copies)?;
    let (is_new, turn) = run.make(&prepared, &copies)?;
    index.write(&copies)?;
    let made = Made {
        copies: &copies,
        prepared: &prepared,
        is_new,
        index: index.path,
    };
    run.report(&made, turn)?;
    Ok(Answer::Yes)
}

/// The model, if it is one.
fn model(arguments: &Embed) -> Result<&Path> {
    match arguments.models.as_slice() {
        [model] if !model.is_dir() => Ok(model),
        _ => bail!(
            "--recipients makes copies of one model; name one file, and make the copies of another in another run"
        ),
    }
}

/// Where every copy goes: under the name of the model, which says nobody's name.
fn planned(arguments: &Embed, model: &Path, recipients: Vec<Recipient>) -> Result<Vec<Copy>> {
    let folder = &arguments.output;
    if folder.exists() && !folder.is_dir() {
        bail!(
            "{}: is a file; copies go into a folder, so give -o the name of one",
            folder.display()
        );
    }
    let name = model
        .file_name()
        .with_context(|| format!("{}: is no file", model.display()))?;
    let copy = |recipient: Recipient| {
        let output = folder.join(recipient.folder()).join(name);
        Copy {
            recipient: recipient.name,
            there: There::Nothing,
            task: Task {
                model: model.into(),
                certificate: files::with_suffix(&output, ".cert.json"),
                output,
            },
        }
    };
    Ok(recipients.into_iter().map(copy).collect())
}

/// Nothing that is read would be replaced.
fn check(arguments: &Embed, model: &Path, list: &Path, copies: &[Copy], index: &Path) -> Result<()> {
    let written = copies
        .iter()
        .flat_map(|copy| [&copy.task.output, &copy.task.certificate]);
    for output in written.map(PathBuf::as_path).chain([index]) {
        files::check_apart(output, model, "the model, which you need as it is to verify")?;
        files::check_apart(output, &arguments.key, "the private key")?;
        files::check_apart(output, list, "the list of recipients")?;
    }
    companions::check_copies(copies.iter().map(|copy| &copy.task), model, &arguments.key)
}

/// What all copies have in common.
struct Run<'a> {
    arguments: &'a Embed,
    model: &'a Path,
    asset: &'a Asset,
    progress: &'a Arc<Progress>,
    job: &'a Job,
}

impl Run<'_> {
    /// Prepares the model, with the strength that all copies have.
    fn prepared(&self, embedder: Embedder, copies: &mut [Copy]) -> Result<Prepared> {
        let named = || self.model.display().to_string();
        let original = Arc::new(embedder.cut(self.asset.mesh(), self.job).with_context(named)?);
        let prepared = embedder.prepare_in(&original).with_context(named)?;
        self.look(&prepared, copies)?;
        if copies.iter().all(|copy| self.stays(copy, &prepared)) {
            return Ok(prepared);
        }
        self.announce(&prepared, false)?;
        prepared.keep_bases(self.job).with_context(named)?;
        if !self.arguments.leaves_strength_open() || self.is_sound(&prepared).with_context(named)? {
            self.check(&prepared, copies)?;
            return Ok(prepared);
        }
        // The file's precision is coarser than the mark.
        let stronger = embedder.strength(Strength::STRONG).prepare_in(&original);
        let stronger = stronger.with_context(named)?;
        self.check(&stronger, copies)?;
        self.announce(&stronger, true)?;
        stronger.keep_bases(self.job).with_context(named)?;
        Ok(stronger)
    }

    /// Whether the file holds the mark of nobody's copy: what all copies have in common may not depend on who is on the list.
    fn is_sound(&self, prepared: &Prepared) -> Result<bool> {
        let attempt = Attempt::make(prepared, "", self.asset, &self.job.quiet())?;
        Ok(attempt.read_back.is_sound())
    }

    /// Looks what is there already. What can't be a copy, however strong, is refused before the bases are computed.
    fn look(&self, prepared: &Prepared, copies: &mut [Copy]) -> Result<()> {
        self.progress.begin("copies", "looking what is there");
        let there = |i: usize| There::at(&copies[i], prepared, self.asset);
        let there = self.job.map_reported(copies.len(), 1, there)?;
        for (copy, there) in copies.iter_mut().zip(there) {
            copy.there = there;
        }
        self.each(copies, Copy::check_possible)
    }

    /// Whether a copy is not made. Where anything may be replaced, each is, and one that comes out as it was is not written.
    fn stays(&self, copy: &Copy, prepared: &Prepared) -> bool {
        !self.arguments.force && copy.is_complete(prepared)
    }

    fn check(&self, prepared: &Prepared, copies: &[Copy]) -> Result<()> {
        self.each(copies, |copy| copy.check(prepared))
    }

    /// Whatever stands in the way may go where that was asked for.
    fn each(&self, copies: &[Copy], check: impl Fn(&Copy) -> Result<()>) -> Result<()> {
        match self.arguments.force {
            true => Ok(()),
            false => copies.iter().try_for_each(check),
        }
    }

    fn announce(&self, prepared: &Prepared, is_raised: bool) -> Result<()> {
        match self.arguments.common.json {
            true => Ok(()),
            false => self
                .progress
                .tell(&words::planned(self.model, prepared, is_raised)),
        }
    }

    /// Makes what is missing, and says of each copy whether it is new, and the worst of the new ones.
    fn make(&self, prepared: &Prepared, copies: &[Copy]) -> Result<(Vec<bool>, Option<Turn>)> {
        let mut is_new = vec![false; copies.len()];
        let mut worst = None;
        self.progress.begin("copies", "making copies");
        let missing = (0..copies.len()).filter(|&i| !self.stays(&copies[i], prepared));
        // Where a mesh stands that is another, nothing is made.
        let (begun, rest): (Vec<usize>, Vec<usize>) =
            missing.partition(|&i| matches!(copies[i].there, There::MeshAlone));
        for numbers in [begun, rest] {
            let chosen: Vec<&Copy> = numbers.iter().map(|&i| &copies[i]).collect();
            let made = self.make_all(prepared, &chosen)?;
            for (i, turn) in numbers.into_iter().zip(made) {
                is_new[i] = turn.is_some();
                worst = [worst, turn].into_iter().flatten().reduce(Turn::worse);
            }
        }
        Ok((is_new, worst))
    }

    /// Makes copies side by side; none of those that come out as they were. After a failure none is begun.
    fn make_all(&self, prepared: &Prepared, copies: &[&Copy]) -> Result<Vec<Option<Turn>>> {
        if copies.is_empty() {
            return Ok(Vec::new());
        }
        let rules = self.rules()?;
        let failed = AtomicBool::new(false);
        let make = |i: usize| -> Option<Result<Option<Turn>>> {
            if failed.load(Ordering::Relaxed) {
                return None;
            }
            let made = self.make_one(prepared, copies[i], &rules);
            failed.fetch_or(made.is_err(), Ordering::Relaxed);
            Some(made)
        };
        let job = self.job_for_copies();
        let made = job.map_reported(copies.len(), 1, make)?;
        made.into_iter().flatten().collect()
    }

    fn rules(&self) -> Result<Rules> {
        let modified = fs::metadata(self.model).and_then(|metadata| metadata.modified());
        Ok(Rules {
            modified: modified
                .with_context(|| format!("{}: its time can't be read", self.model.display()))?,
            force: self.arguments.force,
        })
    }

    fn make_one(&self, prepared: &Prepared, copy: &Copy, rules: &Rules) -> Result<Option<Turn>> {
        let of_whom = || format!("the copy for {}", copy.recipient);
        let job = self.job.alone().quiet();
        let attempt = Attempt::make(prepared, &copy.recipient, self.asset, &job).with_context(of_whom)?;
        let turn = FacetTurn::between(self.asset.mesh(), attempt.marked.mesh())?;
        let is_new = copy.write(&attempt, prepared, rules).with_context(of_whom)?;
        Ok(is_new.then(|| Turn {
            summary: turn.summary(),
            flipped: turn.flipped(),
            prediction: *attempt.signed.prediction(),
        }))
    }

    /// As many threads as copies in the making have room for.
    fn job_for_copies(&self) -> Job {
        let vertices = self.asset.mesh().vertex_count() as u64;
        let bytes = 4 * self.asset.content().len() as u64 + BYTES_A_VERTEX * vertices;
        let side_by_side = (ROOM / bytes.max(1)).clamp(1, self.job.threads() as u64) as usize;
        self.progress.job(side_by_side)
    }

    fn report(&self, made: &Made<'_>, turn: Option<Turn>) -> Result<()> {
        let seconds = self.progress.finish();
        let planned = made.prepared.prediction();
        let prediction = turn.map_or(planned, |turn| turn.prediction);
        let mut object = object(self.arguments, made.prepared, &prediction, &seconds);
        let copies = made.copies.iter().zip(&made.is_new).map(|(copy, is_new)| {
            json!({
                "recipient": copy.recipient,
                "output": copy.task.output,
                "certificate": copy.task.certificate,
                "made": is_new,
            })
        });
        object["copies"] = copies.collect();
        object["made"] = made.new_ones().into();
        object["skipped"] = (made.copies.len() - made.new_ones()).into();
        object["index"] = json!(made.index);
        object["output"] = json!(self.arguments.output);
        object["certificate"] = json!(null);
        object["facet_turn"] = json!(turn.map(|turn| turn.summary));
        object["flipped"] = json!(turn.map(|turn| turn.flipped));
        object["manifest_dropped"] = self.asset.has_manifest().into();
        let mut summary = words::copies(self.model, made, &seconds);
        if self.asset.has_manifest() {
            summary.line(words::MANIFEST_DROPPED);
        }
        report::print(self.arguments.common.json, &object, &summary)
    }
}
