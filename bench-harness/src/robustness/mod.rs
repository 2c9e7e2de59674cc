//! What is read of models that were signed as people sign them, after every attack of the list.

mod page;

use std::{
    num::NonZero,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
};

use anyhow::{Result, ensure};
use clap::Args;
use evaluation::{
    attacks::{random_similarity, tables},
    inputs::{is_chosen, mesh_files, name_of},
    python::Python,
    sources,
};
use job::Job;
use mesh::{TriMesh, shapes};
use mesh_io::Asset;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use serde::{Deserialize, Serialize};
use sigmark::{Curve, Embedder, PayloadKind, SigningKey, Verdict, Verifier};

use crate::{
    kept::{self, Key},
    suspects::attacked,
};

/// What to sign and attack.
#[derive(Args)]
pub struct RobustnessBench {
    /// Mesh files
    #[arg(long, value_name = "DIR")]
    pub meshes: PathBuf,
    /// Only files whose name begins so; may be given again [default: all below two hundred thousand vertices]
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Hold the tag in the shape in place of the whole signature
    #[arg(long)]
    pub tag: bool,
}

/// Larger models are attacked where they are asked for.
const MOST_VERTICES: usize = 200_000;

/// What a verdict says of a model after an attack.
#[derive(Serialize, Deserialize)]
struct Read {
    outcome: String,
    is_evidence: bool,
    /// T₀, of the patches that were read.
    margin: Option<f64>,
    p: f64,
    /// Bits of which something was read, and how many of them are wrong.
    bits: usize,
    errors: Option<usize>,
    patches: usize,
}

/// A model with what was read of it after each attack.
#[derive(Serialize, Deserialize)]
struct Attacked {
    model: String,
    /// T₀ as it was foretold, under noise of 0.1 %.
    foretold: f64,
    /// By the attack's spec; none where it could not be carried out.
    read: Vec<(String, Option<Read>)>,
}

impl RobustnessBench {
    /// Signs, attacks and verifies, and writes `results/robustness.md` and its CSV; with the tag `robustness_tag`.
    pub fn run(&self) -> Result<()> {
        let python = Python::prepare()?;
        let code = sources::digest_of_all_but(&NO_PART)?;
        let payload = match self.tag {
            true => PayloadKind::Tag,
            false => PayloadKind::Signature,
        };
        let folder = kept::folder(&format!("robustness/{code}"))?;
        let mut models = Vec::new();
        for path in mesh_files(&self.meshes)? {
            let name = name_of(&path);
            if !is_chosen(&name, &self.only) {
                continue;
            }
            let asset = Asset::open(&path)?;
            if self.only.is_empty() && asset.mesh().vertex_count() >= MOST_VERTICES {
                continue;
            }
            let model = SignedModel {
                name: &name,
                mesh: asset.mesh(),
                payload,
                folder: &folder,
            };
            let all_read = |attacked: &Attacked| attacked.read.iter().all(|(_, read)| read.is_some());
            let figures = || model.attacked(&python);
            models.push(kept::figures_if(&folder, &model.key("all"), all_read, figures)?);
        }
        let shown = self.meshes.display();
        ensure!(
            !models.is_empty(),
            "{shown}: no mesh file there has a name that was asked for"
        );
        page::write(&models, payload, &python, &code)
    }
}

/// A model, and what is kept of it.
struct SignedModel<'a> {
    name: &'a str,
    mesh: &'a TriMesh,
    payload: PayloadKind,
    folder: &'a Path,
}

impl SignedModel<'_> {
    fn key(&self, what: &str) -> Key {
        let words = format!("{}-{}-{}", self.name, self.payload.name(), what.replace(':', "-"));
        Key::new(words).of_mesh(self.mesh)
    }

    /// What is read of it after every attack. An attack that failed is none of what is kept, and the next run tries it again.
    fn attacked(&self, python: &Python) -> Result<Attacked> {
        let job = Job::new(thread::available_parallelism().map_or(1, NonZero::get));
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([1; 32]));
        let embedder = Embedder::new(&key).payload(Some(self.payload));
        let original = Arc::new(embedder.cut(self.mesh, &job)?);
        original.keep_bases(&job)?;
        let foretold = embedder.predict(&original)?.margin;
        let signed = embedder.embed_in(&original, &job)?;
        let verifier = Verifier::with_original(&original, signed.certificate(), &key.public_key())?;
        let mut read = Vec::new();
        for (seed, attack) in (1..).zip(tables().of_marks()) {
            let after = || {
                // A decimation may stop short of what was asked for.
                let suspect = attacked(python, signed.mesh(), self.name, &attack.spec, seed);
                let suspect =
                    suspect.inspect_err(|error| eprintln!("{}: {}: {error:#}", self.name, attack.name));
                let verdict = suspect.ok().map(|suspect| {
                    let moved = shapes::moved(&suspect, &random_similarity(&suspect, seed));
                    verifier.verify(moved, &job)
                });
                anyhow::Ok(verdict.transpose()?.as_ref().map(Read::of))
            };
            let after = kept::figures_if(self.folder, &self.key(&attack.spec), Option::is_some, after)?;
            let outcome = after.as_ref().map_or("-", |read: &Read| &read.outcome);
            println!("{}: {}: {outcome}", self.name, attack.name);
            read.push((attack.spec.clone(), after));
        }
        Ok(Attacked {
            model: self.name.into(),
            foretold,
            read,
        })
    }
}

impl Read {
    fn of(verdict: &Verdict) -> Self {
        Self {
            outcome: verdict.outcome.name().replace('_', " "),
            is_evidence: verdict.is_evidence(),
            margin: verdict.margin,
            p: verdict.p_value,
            bits: verdict.bits,
            errors: verdict.bit_errors,
            patches: verdict.patches_read,
        }
    }
}

/// What has no part in the figures.
const NO_PART: [&str; 11] = [
    "crates/baselines",
    "crates/cli",
    "crates/evaluation/src/pages",
    "crates/sigmark/tests",
    "bench-harness/src/code",
    "bench-harness/src/eigen",
    "bench-harness/src/formats",
    "bench-harness/src/partition",
    "bench-harness/src/registration",
    "bench-harness/src/robustness/page.rs",
    "bench-harness/src/security",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_part_is_there() {
        kept::assert_is_there(&NO_PART);
    }

    #[test]
    fn no_attack_is_listed_twice() {
        let mut specs: Vec<&str> = tables().of_marks().map(|attack| attack.spec.as_str()).collect();
        let count = specs.len();
        specs.sort_unstable();
        specs.dedup();
        assert_eq!(specs.len(), count);
    }
}
