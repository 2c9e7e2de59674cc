//! Two marks that outlast as much: how strong the second has to be, and what is seen of both then.

use anyhow::Result;
use evaluation::python::Python;
use mesh_io::Asset;
use serde::{Deserialize, Serialize};
use sigmark::mark::JointModel;

use super::{
    layouts::{SEAMED, TODAY_REPEATED},
    trial::{Look, Marked, Read},
};

/// What both have to outlast.
const ATTACKS: [&str; 3] = ["laplacian:5", "noise:0.1", "simplify:10"];

/// What is read of both, [`ATTACKS`] first. Under noise of half a per cent T₀ can be told, under a fifth of it all bits are right: it falls with the strength of a mark, wherever that lies.
pub(super) const READ: [&str; 4] = [ATTACKS[0], ATTACKS[1], ATTACKS[2], "noise:0.5"];

/// The readers that the seamed mark is read by: the nearest to the one that there was, and today's.
pub(super) const READERS: [(&str, JointModel); 2] = [
    ("least squares with interference", JointModel::Interference),
    ("today's", JointModel::Noise),
];

/// Strengths that are tried one after the other; each hits better than the last.
const ROUNDS: usize = 5;

/// How near the least of T₀ has to come to what it is compared with.
const NEAR: f64 = 0.02;

/// T₀ at which half of one of 512 bits is wrong: where all are right no more is known, and no more asked for.
pub(super) const ALL_BITS: f64 = 70.0;

/// No mark is tried that is stronger.
const STRONGEST: f64 = 2e-3;

/// A mark, how strong it is, and what that comes to.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Weighed {
    pub(super) strength: f64,
    /// In the order of [`READ`].
    pub(super) read: Vec<Read>,
    pub(super) look: Look,
}

/// The seamed mark as one reader reads it, and today's at the strength at which it outlasts as much.
#[derive(Serialize, Deserialize)]
pub(super) struct Equal {
    pub(super) model: String,
    /// One of [`READERS`], by its number.
    pub(super) reader: usize,
    pub(super) seamed: Weighed,
    pub(super) today: Weighed,
}

/// Compares the two on a model.
pub(super) fn of(name: &str, asset: &Asset, attacks: &Python) -> Result<Vec<Equal>> {
    let all = usize::MAX;
    let seamed = Marked::new(name, asset, &SEAMED)?;
    let look = seamed.look(all)?;
    let first = Marked::new(name, asset, &TODAY_REPEATED)?;
    let (mut strength, mut found) = (TODAY_REPEATED.strength, Vec::new());
    for (reader, (_, model)) in READERS.into_iter().enumerate() {
        let read = seamed.read(READ.into_iter(), model, attacks)?;
        let mut best = None;
        for _ in 0..ROUNDS {
            let marked = first.with_strength(strength)?;
            let today = marked.read(READ.into_iter(), JointModel::Noise, attacks)?;
            let lacking = |(then, now): (&Read, &Read)| then.margin.min(ALL_BITS) / now.margin;
            let both = read.iter().zip(&today).take(ATTACKS.len());
            let lacking = both.map(lacking).fold(0.0, f64::max);
            println!("{name}: {strength:.2e} lacks {lacking:.3}");
            let is_enough = lacking <= 1.0;
            if is_enough {
                best = Some((marked, strength, today));
            }
            if is_enough && lacking >= 1.0 - NEAR {
                break;
            }
            // A little more than is lacking, so that the next is enough.
            strength = (strength * lacking * (1.0 + 0.5 * NEAR)).min(STRONGEST);
        }
        let Some((marked, strength, today)) = best else {
            println!("{name}: no strength was enough in {ROUNDS} rounds");
            continue;
        };
        found.push(Equal {
            model: name.into(),
            reader,
            seamed: Weighed {
                strength: SEAMED.strength,
                read,
                look,
            },
            today: Weighed {
                strength,
                read: today,
                look: marked.look(all)?,
            },
        });
    }
    Ok(found)
}
