//! Suspects, and what the library says of them.

use std::time::Instant;

use anyhow::{Context, Result};
use job::Job;
use library::{By, Query};
use mesh::TriMesh;
use rayon::prelude::*;
use serde::Serialize;

use super::{
    FIRST, LibraryBench,
    built::Built,
    draw::Draw,
    models::{Base, original, variation},
    suspects::{ATTACKS, Group},
};
use crate::measure::{greatest, median};

/// What came of an attack's suspects.
#[derive(Debug, Serialize)]
pub(super) struct Found {
    pub(super) attack: &'static str,
    #[serde(skip)]
    pub(super) group: Option<Group>,
    pub(super) suspects: usize,
    /// The original was the first, among the first ten.
    pub(super) first: usize,
    pub(super) among_ten: usize,
    /// It was among the first four by the whole, by a part, by small shapes.
    pub(super) by: [usize; 3],
    /// The distances of originals that were among the ten, by what was nearest: the greatest.
    pub(super) farthest: [f64; 3],
    /// Of the nearest other.
    pub(super) nearest_other: [f64; 3],
    /// Milliseconds of a search, wall time: median and the worst of a hundred.
    pub(super) milliseconds: [f64; 2],
    /// To describe a suspect.
    pub(super) describing: f64,
    /// Those that were missed: numbers of originals.
    pub(super) missed: Vec<usize>,
}

/// Whether suspects are made of a base: half of them are there to choose thresholds by.
pub(super) fn is_tested(base: usize, tunes: bool) -> bool {
    base.is_multiple_of(2) == tunes
}

/// Attacks originals of the library and looks for them.
pub(super) fn attacked(bases: &[Base], built: &Built, options: &LibraryBench, job: &Job) -> Result<Vec<Found>> {
    let chosen = chosen(bases, options);
    let mut all = Vec::new();
    let only = |name: &str| options.only.is_empty() || options.only.iter().any(|part| name.contains(part.as_str()));
    for (a, attack) in ATTACKS.iter().enumerate().filter(|(_, attack)| only(attack.name)) {
        let seeds: Vec<u64> = (0..chosen.len() as u64).map(|i| i + 1000 * a as u64).collect();
        let queries: Vec<Result<(Query, f64)>> = job.install(|| {
            (0..chosen.len())
                .into_par_iter()
                .map(|i| {
                    let mesh = attack.on(&original(bases, chosen[i]).mesh, seeds[i])?;
                    let begun = Instant::now();
                    let query = Query::of(&mesh).with_context(|| format!("{} of {}", attack.name, chosen[i]))?;
                    Ok((query, begun.elapsed().as_secs_f64()))
                })
                .collect()
        })?;
        let mut found = Found {
            attack: attack.name,
            group: Some(attack.group),
            suspects: 0,
            first: 0,
            among_ten: 0,
            by: [0; 3],
            farthest: [0.0; 3],
            nearest_other: [f64::INFINITY; 3],
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
            let candidates = built.index.search(&built.library, &query, FIRST, job)?;
            seconds.push(1e3 * begun.elapsed().as_secs_f64());
            let lists = built.index.lists(&built.library, &query, FIRST, job)?;
            found.suspects += 1;
            found.first += usize::from(candidates.first().is_some_and(|candidate| candidate.original == wanted));
            match candidates.iter().any(|candidate| candidate.original == wanted) {
                true => found.among_ten += 1,
                false => found.missed.push(number),
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
        found.milliseconds = [median(seconds.iter().copied()), seconds.get(worst).copied().unwrap_or(f64::NAN)];
        found.describing = median(describing);
        println!("{}", serde_json::to_string(&found)?);
        all.push(found);
    }
    Ok(all)
}

/// The originals that are attacked: the real meshes first, then by chance.
fn chosen(bases: &[Base], options: &LibraryBench) -> Vec<usize> {
    let real = bases.iter().filter(|base| base.whole.is_some()).count();
    let mut draw = Draw::new(31, u64::from(options.tune));
    let mut chosen: Vec<usize> = (0..real.min(options.size)).filter(|&b| is_tested(b, options.tune)).collect();
    while chosen.len() < options.suspects && options.size > real {
        let number = real + draw.one_of(options.size - real);
        if is_tested(number % bases.len(), options.tune) {
            chosen.push(number);
        }
    }
    chosen.truncate(options.suspects);
    chosen
}
