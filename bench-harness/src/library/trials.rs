//! Suspects, and what the library says of them.

use std::time::Instant;

use anyhow::{Context, Result};
use job::Job;
use library::{Entry, Index, Library, OriginalId, Query};
use rayon::prelude::*;
use serde::Serialize;
use sigmark::{Curve, Embedder, SigningKey, Verifier};

use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};

use super::{
    FIRST, LibraryBench,
    built::Built,
    draw::Draw,
    models::{Base, original, variation},
    suspects::{ATTACKS, Group},
};
use crate::measure::{median, timed};

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
    /// It was among the first three by the whole, by the surface, by small shapes.
    pub(super) by: [usize; 4],
    /// The distances of originals that were among the ten, by what was nearest: the greatest.
    pub(super) farthest: [f64; 4],
    /// Of the nearest other.
    pub(super) nearest_other: [f64; 4],
    /// Milliseconds of a search, wall time: median and the worst of a hundred.
    pub(super) milliseconds: [f64; 2],
    /// To describe a suspect.
    pub(super) describing: f64,
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
        let seeds: Vec<u64> = (0..chosen.len() as u64).map(|i| i + 1000 * a as u64).collect();
        let queries: Vec<Result<(Query, f64)>> = job.install(|| {
            (0..chosen.len())
                .into_par_iter()
                .map(|i| {
                    let mesh = attack.on(&original(bases, chosen[i]).mesh, seeds[i])?;
                    let begun = Instant::now();
                    let query =
                        Query::of(&mesh).with_context(|| format!("{} of {}", attack.name, chosen[i]))?;
                    Ok((query, begun.elapsed().as_secs_f64()))
                })
                .collect()
        })?;
        let mut found = Found {
            attack: attack.name,
            group: attack.group,
            suspects: 0,
            first: 0,
            among_ten: 0,
            by: [0; 4],
            farthest: [0.0; 4],
            nearest_other: [f64::INFINITY; 4],
            milliseconds: [0.0; 2],
            describing: 0.0,
            missed: Vec::new(),
        };
        let (mut seconds, mut describing) = (Vec::new(), Vec::new());
        for (query, &number) in queries.into_iter().zip(&chosen) {
            let (query, took) = query?;
            describing.push(1e3 * took);
            let wanted = built.ids[number];
            let begun = Instant::now();
            let lists = built.index.lists(&built.library, &query, FIRST, job)?;
            // `sigmark library search` looks at no others.
            let mut candidates = Index::candidates(&lists, FIRST);
            candidates.retain(|candidate| candidate.score > 0.0);
            seconds.push(1e3 * begun.elapsed().as_secs_f64());
            found.suspects += 1;
            found.first += usize::from(
                candidates
                    .first()
                    .is_some_and(|candidate| candidate.original == wanted),
            );
            match candidates.iter().any(|candidate| candidate.original == wanted) {
                true => found.among_ten += 1,
                false => found.missed.push(number),
            }
            if options.tune {
                tell(attack.name, number, &lists, |id| id == wanted);
                tell("others", number, &lists, |id| id != wanted);
            }
            for (by, list) in lists.iter().enumerate() {
                if let Some(place) = list.iter().position(|&(id, _)| id == wanted) {
                    found.by[by] += usize::from(place < 3);
                    found.farthest[by] = found.farthest[by].max(list[place].1);
                }
                if let Some(&(_, distance)) = list.iter().find(|&&(id, _)| id != wanted) {
                    found.nearest_other[by] = found.nearest_other[by].min(distance);
                }
            }
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

/// Prints the least distance of some originals by each of [`By::ALL`](library::By::ALL), to choose thresholds by.
fn tell(what: &str, number: usize, lists: &[Vec<(OriginalId, f64)>], is_asked: impl Fn(OriginalId) -> bool) {
    let least = |list: &Vec<(OriginalId, f64)>| {
        let asked = list.iter().filter(|(id, _)| is_asked(*id));
        asked.map(|(_, distance)| *distance).fold(f64::INFINITY, f64::min)
    };
    let least: Vec<String> = lists.iter().map(|list| format!("{:.3}", least(list))).collect();
    println!("{what},{number},{}", least.join(","));
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
    pub(super) suspects: usize,
    /// Those with a candidate near enough to be aligned, and all such candidates.
    pub(super) with_candidates: usize,
    pub(super) candidates: usize,
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

/// Numbers of variations that are in no library.
const STRANGERS: u64 = 1 << 40;

/// Looks for models that are not in the library, and reads some of what comes up.
pub(super) fn strangers(
    bases: &[Base],
    built: &Built,
    options: &LibraryBench,
    job: &Job,
) -> Result<Strangers> {
    let stranger = |i: usize| variation(bases, i % bases.len(), STRANGERS + i as u64);
    let mut told = Strangers {
        least_p: 1.0,
        ..Strangers::default()
    };
    let mut near = Vec::new();
    for start in (0..options.strangers).step_by(64) {
        let count = 64.min(options.strangers - start);
        let queries = job.map(count, 1, |i| Query::of(&stranger(start + i)))?;
        for (i, query) in queries.into_iter().enumerate() {
            let lists = built.index.lists(&built.library, &query?, FIRST, job)?;
            if options.tune {
                tell("strangers", start + i, &lists, |_| true);
            }
            let candidates: Vec<_> = Index::candidates(&lists, FIRST)
                .into_iter()
                .filter(|candidate| candidate.score > 0.0)
                .collect();
            told.suspects += 1;
            told.with_candidates += usize::from(!candidates.is_empty());
            told.candidates += candidates.len();
            near.extend(
                candidates
                    .into_iter()
                    .map(|candidate| (candidate.score, start + i, candidate.original)),
            );
        }
    }
    if options.tune {
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
        let verdict = verifier.verify(stranger(number), job)?;
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
        .map(|i| variation(bases, i % bases.len(), STRANGERS - 1 - i as u64))
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
