//! Suspects that don't bear the mark, each asked for many random signatures.

use anyhow::Result;
use evaluation::{attacks::random_similarity, python::Python};
use job::Job;
use mesh::{TriMesh, shapes};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sigmark::{
    Embedder,
    claim::statistics::p_of_chosen,
    mark::{JointEstimator, Reader, ReadingMethod},
};

use super::marked::{Marked, job, key};
use crate::suspects::attacked;

/// Probabilities at which p-values are counted.
pub(super) const LEVELS: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];

/// An original and a suspect that was never marked for it.
#[derive(Serialize, Deserialize)]
pub(super) struct NullPair {
    pub(super) model: String,
    pub(super) suspect: String,
    /// Of how many readings the best was taken; none where the suspect does not lie on the original, and p is 1.
    pub(super) tries: Option<usize>,
    pub(super) trials: usize,
    /// How many p-values were at most each of [`LEVELS`].
    pub(super) below: [usize; 4],
}

/// Shapes that lie on themselves in many ways, and some that don't; with another that is no copy.
pub(super) fn shapes() -> [(&'static str, TriMesh, TriMesh); 4] {
    let (sphere, torus) = (shapes::icosphere(4), shapes::torus(72, 36, 2.0, 0.8));
    let (bumpy, ring) = (shapes::bumpy_sphere(4, 9), shapes::bumpy_torus(72, 36, 2));
    let block = shapes::block(1, 10);
    [
        ("sphere", sphere.clone(), shapes::bumped(&sphere, 0.01, 8)),
        ("bumpy sphere", bumpy, shapes::bumpy_sphere(4, 10)),
        ("bumpy torus", ring, torus),
        ("block", block, shapes::bumpy_block(1, 10, 3)),
    ]
}

/// All suspects of a model. `another` is another model, where there is one.
pub(super) fn of(
    marked: &Marked,
    another: Option<&TriMesh>,
    attacks: &Python,
    trials: usize,
) -> Result<Vec<NullPair>> {
    let layout = marked.signed.layout();
    let mesh = marked.signed.original().mesh();
    let method = ReadingMethod::joint(JointEstimator::new(layout).into());
    let reader = Reader::new(mesh)?;
    let mut pairs = Vec::new();
    for (number, (suspect, mesh)) in suspects(marked, another, attacks)?.into_iter().enumerate() {
        let moved = shapes::moved(&mesh, &random_similarity(&mesh, number as u64));
        let found = reader.find(&moved, &job())?;
        let mut pair = NullPair {
            model: marked.name.clone(),
            suspect: suspect.into(),
            tries: None,
            trials,
            below: [0; 4],
        };
        if found.alignment().is_none_or(|alignment| alignment.aligned) {
            let readings = found.readings(&method, &job())?;
            let bits = layout.bits();
            let asked: Result<Vec<(usize, f64)>> = (0..trials)
                .into_par_iter()
                .map(|trial| {
                    let expected = random_bits(bits, number, trial);
                    let reading = readings.best(&expected, &Job::default())?;
                    Ok((reading.tries, p_of_chosen(&expected, &reading)))
                })
                .collect();
            let asked = asked?;
            pair.tries = asked.first().map(|&(tries, _)| tries);
            pair.below = LEVELS.map(|level| asked.iter().filter(|&&(_, p)| p <= level).count());
        }
        println!("{}", serde_json::to_string(&pair)?);
        pairs.push(pair);
    }
    Ok(pairs)
}

/// None bears the owner's mark.
fn suspects(
    marked: &Marked,
    another: Option<&TriMesh>,
    attacks: &Python,
) -> Result<Vec<(&'static str, TriMesh)>> {
    let original = marked.signed.original();
    let mesh: &TriMesh = original.mesh();
    let theirs = Embedder::new(&key(2)).embed_in(original, &job())?;
    let name = format!("{}-unmarked", marked.name.replace(' ', "-"));
    let suspects = [
        ("the original", mesh.clone()),
        ("the original, noisy", shapes::jittered(mesh, 0.3, 1)),
        ("the original with other triangles", shapes::flipped(mesh, 2)),
        (
            "the original, simplified",
            attacked(attacks, mesh, &name, "simplify:50", 0)?,
        ),
        ("the original in a mirror", shapes::mirrored(mesh)),
        ("a stranger's mark", theirs.mesh().clone()),
        (
            "a stranger's mark with other triangles",
            shapes::flipped(theirs.mesh(), 2),
        ),
        ("the original with bumps of 0.5 %", shapes::bumped(mesh, 0.005, 4)),
        (
            "the original with other bumps and triangles",
            shapes::flipped(&shapes::bumped(mesh, 0.005, 5), 3),
        ),
    ];
    let another = another.map(|another| ("another model", another.clone()));
    Ok(suspects.into_iter().chain(another).collect())
}

fn random_bits(bits: usize, suspect: usize, trial: usize) -> Vec<bool> {
    let mut rng = ChaCha20Rng::seed_from_u64((suspect as u64) << 40 | trial as u64);
    (0..bits).map(|_| rng.next_u32() & 1 == 1).collect()
}
