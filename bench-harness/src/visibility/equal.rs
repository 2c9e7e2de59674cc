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

/// So many strengths are tried at most.
const ROUNDS: usize = 10;

/// How near the least of T₀ has to come to what it is compared with.
const NEAR: f64 = 0.02;

/// T₀ at which one of 512 bits is wrong: of three draws no more is known beyond it, and no more asked for.
pub(super) const ALL_BITS: f64 = 65.0;

/// [`ALL_BITS`] to the T₀ of which one bit of all draws is wrong; where none is, T₀ is above.
const ALL_RIGHT_LACKS: f64 = 0.87;

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
pub(super) fn of(name: &str, asset: &Asset, draws: u8, attacks: &Python) -> Result<Vec<Equal>> {
    let all = usize::MAX;
    let seamed = Marked::new(name, asset, &SEAMED)?;
    let look = seamed.look(all)?;
    let first = Marked::new(name, asset, &TODAY_REPEATED)?;
    let (mut strength, mut found) = (TODAY_REPEATED.strength, Vec::new());
    for (reader, (_, model)) in READERS.into_iter().enumerate() {
        let read = seamed.read(READ.into_iter(), draws, model, attacks)?;
        let (mut too_weak, mut enough) = (None, None);
        for _ in 0..ROUNDS {
            let marked = first.with_strength(strength)?;
            let today = marked.read(ATTACKS.into_iter(), draws, JointModel::Noise, attacks)?;
            let lacking = |(then, now): (&Read, &Read)| then.margin.min(ALL_BITS) / now.margin;
            let lacking = read.iter().zip(&today).map(lacking).fold(0.0, f64::max);
            println!("{name}: {strength:.2e} lacks {lacking:.3}");
            if lacking <= 1.0 {
                enough = Some((marked, strength));
            } else {
                too_weak = Some(strength);
            }
            let strongest = enough.as_ref().map(|&(_, strength)| strength);
            match next_strength(strength, lacking, too_weak, strongest) {
                Some(next) => strength = next,
                None => break,
            }
        }
        let Some((marked, strength)) = enough else {
            println!("{name}: no strength was enough in {ROUNDS} rounds");
            continue;
        };
        let today = marked.read(READ.into_iter(), draws, JointModel::Noise, attacks)?;
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

/// The strength to try after one that lacks so much of T₀; none where the least that is enough is known well enough.
///
/// T₀ is proportional to the strength. Where all bits are right it may be any above [`ALL_BITS`], and half of the strength enough.
fn next_strength(tried: f64, lacking: f64, too_weak: Option<f64>, enough: Option<f64>) -> Option<f64> {
    let by_lack = tried * lacking * (1.0 + 0.5 * NEAR);
    let is_told = lacking > ALL_RIGHT_LACKS;
    match (too_weak, enough) {
        (_, Some(enough)) if tried == enough && lacking >= 1.0 - NEAR => None,
        (Some(weak), Some(enough)) if enough <= weak * (1.0 + NEAR) => None,
        (Some(weak), Some(enough)) if is_told && weak < by_lack && by_lack < enough => Some(by_lack),
        (Some(weak), Some(enough)) => Some((weak * enough).sqrt()),
        (None, _) if !is_told => Some(0.5 * tried),
        (None, _) => Some(by_lack),
        (Some(weak), None) if weak >= STRONGEST => None,
        (Some(_), None) => Some(by_lack.min(STRONGEST)),
    }
}

#[cfg(test)]
mod tests {
    use evaluation::margin::margin_of_rate;

    use super::{super::trial::DRAWS, *};

    /// T₀ for a strength, as a search sees it: no more than where all bits of all draws are right.
    fn seen(strength: f64, per_strength: f64) -> f64 {
        let read = usize::from(DRAWS) * 512;
        (strength * per_strength).min(margin_of_rate(1.0, 512, read))
    }

    #[test]
    fn the_search_ends_just_above_the_least_strength_that_is_enough() {
        for (asked, per_strength) in [
            (65.0, 1.9e5),
            (65.0, 9e5),
            (65.0, 3e6),
            (34.0, 4e5),
            (60.0, 1.2e5),
        ] {
            let least = asked / per_strength;
            let (mut strength, mut weak, mut enough) = (4e-4, None, None);
            for _ in 0..ROUNDS {
                let lacking = asked / seen(strength, per_strength);
                *(if lacking <= 1.0 { &mut enough } else { &mut weak }) = Some(strength);
                match next_strength(strength, lacking, weak, enough) {
                    Some(next) => strength = next,
                    None => break,
                }
            }
            let found = enough.expect("one is enough");
            assert!(found >= least && found <= 1.04 * least, "{found:e} for {least:e}");
        }
    }

    #[test]
    fn no_mark_is_tried_beyond_the_strongest() {
        assert_eq!(next_strength(1e-3, 9.0, Some(1e-3), None), Some(STRONGEST));
        assert_eq!(next_strength(STRONGEST, 1.2, Some(STRONGEST), None), None);
    }
}
