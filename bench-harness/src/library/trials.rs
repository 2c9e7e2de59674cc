//! Suspects, and what the library says of them.

use std::time::Instant;

use anyhow::{Context, Result};
use job::Job;
use library::{Candidate, Entry, Library, OriginalId, Query};
use serde::Serialize;
use sigmark::{Curve, Embedder, SigningKey, Verifier};

use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};

use super::{
    FIRST, LibraryBench,
    built::Built,
    draw::Draw,
    models::{Base, STRANGERS, original, stranger, variation},
    suspects::{ATTACKS, Attack, Group},
};
use crate::measure::{median, timed};

/// Fewer triangles are little to go by.
pub(super) const FEW: usize = 500;

/// What came of an attack's suspects.
#[derive(Debug, Serialize)]
pub(super) struct Found {
    pub(super) attack: &'static str,
    #[serde(skip)]
    pub(super) group: Group,
    pub(super) suspects: usize,
    /// The original was the first, among the first ten.
    pub(super) first: usize,
    pub(super) among_ten: usize,
    /// Suspects with fewer than [`FEW`] triangles, and those of them whose original was among the first ten.
    pub(super) small: [usize; 2],
    /// It was among the first three by each of [`By::ALL`](library::By::ALL) alone.
    pub(super) by: [usize; 4],
    /// Milliseconds to describe a suspect and to search for it, wall time: median and the worst of a hundred.
    pub(super) milliseconds: [f64; 2],
    /// Of them, to describe it: median.
    pub(super) describing: f64,
    /// Milliseconds of CPU time of a search: mean.
    pub(super) cpu: f64,
    /// Those that were missed: numbers of originals.
    pub(super) missed: Vec<usize>,
}

/// Attacks originals of the library and looks for them.
pub(super) fn attacked(
    bases: &[Base],
    built: &Built,
    options: &LibraryBench,
    job: &Job,
) -> Result<Vec<Found>> {
    let chosen = chosen(bases, options);
    let mut all = Vec::new();
    let only =
        |name: &str| options.only.is_empty() || options.only.iter().any(|part| name.contains(part.as_str()));
    for (a, attack) in ATTACKS.iter().enumerate().filter(|(_, attack)| only(attack.name)) {
        let suspects = job.map(chosen.len(), 1, |i| {
            attack.on(&original(bases, chosen[i]).mesh, i as u64 + 1000 * a as u64)
        })?;
        let mut found = Found::of(attack);
        let (mut seconds, mut describing) = (Vec::new(), Vec::new());
        for (suspect, &number) in suspects.into_iter().zip(&chosen) {
            let suspect = suspect?;
            let is_small = suspect.triangle_count() < FEW;
            let begun = Instant::now();
            let query = Query::of(&suspect, job).with_context(|| format!("{} of {number}", attack.name))?;
            describing.push(1e3 * begun.elapsed().as_secs_f64());
            let (compared, cost) = timed(|| built.index.search(&built.library, &query, usize::MAX, job));
            let compared = compared?;
            seconds.push(1e3 * begun.elapsed().as_secs_f64());
            found.cpu += 1e3 * cost.cpu / chosen.len() as f64;
            found.count(&compared, built.ids[number], number, is_small);
        }
        seconds.sort_by(f64::total_cmp);
        let worst = seconds.len().saturating_sub(1) * 99 / 100;
        found.milliseconds = [
            median(seconds.iter().copied()),
            seconds.get(worst).copied().unwrap_or(f64::NAN),
        ];
        found.describing = median(describing);
        println!("{}", serde_json::to_string(&found)?);
        all.push(found);
    }
    Ok(all)
}

impl Found {
    fn of(attack: &Attack) -> Self {
        Self {
            attack: attack.name,
            group: attack.group,
            suspects: 0,
            first: 0,
            among_ten: 0,
            small: [0; 2],
            by: [0; 4],
            milliseconds: [0.0; 2],
            describing: 0.0,
            cpu: 0.0,
            missed: Vec::new(),
        }
    }

    /// Counts what a search said of a suspect.
    fn count(&mut self, compared: &[Candidate], wanted: OriginalId, number: usize, is_small: bool) {
        self.suspects += 1;
        self.small[0] += usize::from(is_small);
        // `sigmark library search` looks at no others.
        let mut near = compared
            .iter()
            .take(FIRST)
            .take_while(|candidate| candidate.is_worth_a_look);
        match near.position(|candidate| candidate.original == wanted) {
            Some(place) => {
                self.first += usize::from(place == 0);
                self.among_ten += 1;
                self.small[1] += usize::from(is_small);
            }
            None => self.missed.push(number),
        }
        let Some(own) = compared.iter().find(|candidate| candidate.original == wanted) else {
            return;
        };
        for (by, count) in self.by.iter_mut().enumerate() {
            let likeness = own.likeness[by];
            let nearer = compared.iter().filter(|other| other.likeness[by] > likeness);
            *count += usize::from(likeness > 0.0 && nearer.count() < 3);
        }
    }
}

/// The originals that are attacked: the real meshes first, then by chance.
fn chosen(bases: &[Base], options: &LibraryBench) -> Vec<usize> {
    let real = bases.iter().filter(|base| base.whole.is_some()).count();
    let mut draw = Draw::new(31, u64::from(options.tune));
    let mut chosen: Vec<usize> = (0..real.min(options.size))
        .filter(|&b| bases[b].tunes == options.tune)
        .collect();
    while chosen.len() < options.suspects && options.size > real {
        let number = real + draw.one_of(options.size - real);
        if bases[number % bases.len()].tunes == options.tune {
            chosen.push(number);
        }
    }
    chosen.truncate(options.suspects);
    chosen
}

/// What strangers' models brought up.
#[derive(Debug, Default, Serialize)]
pub(super) struct Strangers {
    /// How many variations of the library's bases, and of other shapes, were searched, how many have a candidate that is near enough to be aligned, and all such candidates.
    pub(super) searched: [Searched; 2],
    /// Candidates that were signed, and whose mark was looked for in the stranger's model.
    pub(super) read: usize,
    /// Of these, on how many the stranger's model lies.
    pub(super) lying: usize,
    /// Marks that were found where there are none.
    pub(super) claims: usize,
    /// The least p.
    pub(super) least_p: f64,
    /// Seconds of an alignment and reading: median.
    pub(super) seconds: f64,
}

/// How many strangers came how far.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Searched {
    pub(super) suspects: usize,
    pub(super) with_candidates: usize,
    pub(super) candidates: usize,
}

/// Looks for models that are not in the library, and reads some of what comes up.
pub(super) fn strangers(
    bases: &[Base],
    built: &Built,
    options: &LibraryBench,
    job: &Job,
) -> Result<Strangers> {
    let mut told = Strangers {
        least_p: 1.0,
        ..Strangers::default()
    };
    let mut near = Vec::new();
    for start in (0..options.strangers).step_by(64) {
        let count = 64.min(options.strangers - start);
        let queries = job.map(count, 1, |i| Query::of(&stranger(bases, start + i), &job.alone()))?;
        for (i, query) in queries.into_iter().enumerate() {
            let mut candidates = built.index.search(&built.library, &query?, FIRST, job)?;
            candidates.retain(|candidate| candidate.is_worth_a_look);
            let searched = &mut told.searched[(start + i) % 2];
            searched.suspects += 1;
            searched.with_candidates += usize::from(!candidates.is_empty());
            searched.candidates += candidates.len();
            near.extend(
                candidates
                    .into_iter()
                    .map(|found| (found.score, start + i, found.original)),
            );
        }
    }
    if options.tune {
        println!("{}", serde_json::to_string(&told)?);
        return Ok(told);
    }
    // The nearest say most.
    near.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([3; 32]));
    let mut seconds = Vec::new();
    for &(_, number, id) in &near {
        if told.read == options.read {
            break;
        }
        let place = built
            .ids
            .iter()
            .position(|&own| own == id)
            .context("an original of the library")?;
        let model = original(bases, place);
        // Some shapes are too small to be signed.
        let Ok(signed) = Embedder::new(&key).embed(&model.mesh, job) else {
            continue;
        };
        let verifier =
            Verifier::new(&model.mesh, signed.certificate(), &key.public_key())?.p_bound(1e-6 / FIRST as f64);
        let begun = Instant::now();
        let verdict = verifier.verify(stranger(bases, number), job)?;
        seconds.push(begun.elapsed().as_secs_f64());
        told.read += 1;
        told.lying += usize::from(verdict.mismatch.is_none());
        told.claims += usize::from(verdict.outcome.is_found());
        told.least_p = told.least_p.min(verdict.p_value * FIRST as f64);
    }
    told.seconds = median(seconds);
    println!("{}", serde_json::to_string(&told)?);
    Ok(told)
}

/// How fast originals are added.
#[derive(Debug, Serialize)]
pub(super) struct Speed {
    pub(super) what: String,
    pub(super) models: usize,
    pub(super) triangles: usize,
    /// CPU seconds to describe, pack and write a model, and those to describe it alone.
    pub(super) seconds: f64,
    pub(super) describing: f64,
    /// Of the packed geometry, and of the same as doubles and indices.
    pub(super) bytes: usize,
    pub(super) raw: usize,
}

/// Adds variations, and each real mesh of some size, on one thread.
pub(super) fn speed(bases: &[Base]) -> Result<Vec<Speed>> {
    let folder = tempfile::tempdir()?;
    let mut library = Library::create(&folder.path().join("speed.sigmark"))?;
    let mut all = Vec::new();
    let variations = (0..40)
        .map(|i| variation(bases, &bases[i % bases.len()].small, STRANGERS - 1 - i as u64))
        .collect();
    let mut sets = vec![("variations".to_string(), variations)];
    sets.extend(
        bases
            .iter()
            .filter_map(|base| Some((base.name.clone(), vec![base.whole.clone()?]))),
    );
    for (what, meshes) in sets {
        let mut speed = Speed {
            what,
            models: meshes.len(),
            triangles: 0,
            seconds: 0.0,
            describing: 0.0,
            bytes: 0,
            raw: 0,
        };
        for mesh in &meshes {
            let (entry, cost) = timed(|| -> Result<Entry> {
                let entry = Entry::of(&speed.what, mesh, true)?;
                library.add(&entry)?;
                Ok(entry)
            });
            speed.seconds += cost.cpu / meshes.len() as f64;
            speed.describing += timed(|| library::Descriptor::of(mesh)).1.cpu / meshes.len() as f64;
            speed.triangles += mesh.triangle_count() / meshes.len();
            speed.bytes += entry?.geometry.map_or(0, |packed| packed.len()) / meshes.len();
            speed.raw += (24 * mesh.vertex_count() + 12 * mesh.triangle_count()) / meshes.len();
        }
        all.push(speed);
    }
    Ok(all)
}
