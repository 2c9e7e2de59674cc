//! One model and one way to mark it: its strength, its marks, and what is left of them after each attack.

mod by_bits;
mod cell;
mod mark;
mod marking;
pub(crate) mod metrics;
pub(crate) mod product;
mod record;
pub(crate) mod steps;
mod strength;

pub(crate) use by_bits::ByBits;
pub(crate) use marking::Marking;
pub(crate) use record::{Cell, Mark, Preparation, Rated, Step, Strength, Target};

use marking::Ready;
use metrics::Metrics;

use std::{path::Path, sync::OnceLock, time::Instant};

use anyhow::{Context, Result};
use job::{Job, JobError};
use mesh::TriMesh;
use serde_json::{Value, json};
use sigmark::{
    PublicKey, Scheme, Signature,
    mark::{PatchCount, Patches},
};

use crate::{models::Standin, progress::Progress, python::Python, store::Store};

/// l: the paper's signatures.
pub(crate) const SCHEME: Scheme = Scheme::EcdsaB163Sha1;

/// A message and its signature, whose bits are the mark.
pub(crate) struct Signed {
    /// From 0; also the seed of attacks.
    pub(crate) number: usize,
    pub(crate) message: String,
    pub(crate) signature: Signature,
}

/// What a study works with.
pub(crate) struct Setup<'a> {
    pub(crate) python: &'a Python,
    pub(crate) store: &'a Store,
    /// For files that are soon deleted.
    pub(crate) work: &'a Path,
    pub(crate) signatures: &'a [Signed],
    /// Signatures that are in no mesh.
    pub(crate) strangers: &'a [Signature],
    pub(crate) public_key: PublicKey,
    pub(crate) progress: &'a Progress,
    pub(crate) threads: usize,
}

/// A model and its patches: what all algorithms share.
pub(crate) struct Scene<'a> {
    pub(crate) setup: &'a Setup<'a>,
    pub(crate) standin: &'a Standin,
    patches: Patches,
    metrics: OnceLock<Metrics>,
}

/// One way to mark on one scene. What costs much is computed when it is first needed.
pub(crate) struct Study<'a> {
    scene: &'a Scene<'a>,
    pub(crate) marking: &'a dyn Marking,
    /// d_rmse, in per cent.
    pub(crate) distortion: f64,
    prepared: OnceLock<Box<dyn Ready>>,
}

impl<'a> Scene<'a> {
    pub(crate) fn new(setup: &'a Setup<'a>, standin: &'a Standin) -> Result<Self> {
        // Patches must have room for the harmonics of three chips a bit.
        let functions = SCHEME.bits() + 1;
        let count = PatchCount::Exactly(standin.model.patches);
        Ok(Self {
            setup,
            standin,
            patches: Patches::cut(&standin.mesh, functions, count, &Job::new(setup.threads))?,
            metrics: OnceLock::new(),
        })
    }

    /// Made once for all marks.
    fn metrics(&self) -> Result<&Metrics> {
        if self.metrics.get().is_none() {
            let _ = self.metrics.set(Metrics::of(&self.standin.mesh)?);
        }
        self.metrics.get().context("they were just made")
    }
}

impl<'a> Study<'a> {
    pub(crate) fn new(scene: &'a Scene<'a>, marking: &'a dyn Marking, distortion: f64) -> Self {
        Self {
            scene,
            marking,
            distortion,
            prepared: OnceLock::new(),
        }
    }

    /// What everything here depends on, and `more`: the key of finished work.
    fn inputs(&self, more: Value) -> Value {
        let mut inputs = json!({
            "mesh": self.scene.standin.digest,
            "patches": self.scene.patches.len(),
            "algorithm": self.marking.key(),
            "scheme": SCHEME,
        });
        if let (Some(all), Value::Object(more)) = (inputs.as_object_mut(), more) {
            all.extend(more);
        }
        inputs
    }

    fn setup(&self) -> &Setup<'a> {
        self.scene.setup
    }

    fn store(&self) -> &Store {
        self.scene.setup.store
    }

    fn job(&self) -> Job {
        Job::new(self.setup().threads)
    }

    fn original(&self) -> &TriMesh {
        &self.scene.standin.mesh
    }

    fn signature(&self, number: usize) -> &Signature {
        &self.setup().signatures[number].signature
    }

    /// Computes what does not depend on the signature, if it is not there yet and the time is not over.
    pub(crate) fn prepare(&self) -> Result<&dyn Ready> {
        if self.prepared.get().is_none() {
            if self.setup().progress.is_over() {
                return Err(JobError::Cancelled.into());
            }
            let begun = Instant::now();
            let prepared = self.marking.prepare(self.scene, &self.job())?;
            let preparation = Preparation {
                patches: prepared.patches(),
                functions: prepared.functions(),
                seconds: begun.elapsed().as_secs_f64(),
                threads: self.setup().threads,
            };
            self.store()
                .put("preparation", &self.inputs(Value::Null), &preparation)?;
            let _ = self.prepared.set(prepared);
        }
        let prepared = self.prepared.get().context("it was just prepared")?;
        Ok(prepared.as_ref())
    }

    /// What preparing took, now or when it was last done.
    pub(crate) fn preparation(&self) -> Result<Preparation> {
        let kept = || self.store().get("preparation", &self.inputs(Value::Null));
        if let Some(kept) = kept() {
            return Ok(kept);
        }
        self.prepare()?;
        kept().context("the times of preparation were not kept")
    }

    fn positions(&self, signature: usize, alpha: f64) -> Result<Vec<[f64; 3]>> {
        let signed = &self.setup().signatures[signature];
        self.prepare()?.positions(signed, alpha, &self.job())
    }

    /// The mesh with a signature.
    fn marked(&self, signature: usize, alpha: f64) -> Result<TriMesh> {
        Ok(self
            .original()
            .with_positions(self.positions(signature, alpha)?)?)
    }
}
