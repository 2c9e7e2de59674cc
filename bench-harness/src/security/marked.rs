//! A model with its owner's mark, and those who read it.

use std::{cell::OnceCell, num::NonZero, sync::Arc, thread};

use anyhow::{Context, Result};
use job::Job;
use mesh::TriMesh;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{
    Curve, Embedder, Signed, SigningKey, Verifier,
    mark::{CoefficientDetector, Original, Pool},
};

/// What `sigmark embed` writes by default.
const BITS: usize = 512;

/// All cores.
pub(super) fn job() -> Job {
    Job::new(thread::available_parallelism().map_or(1, NonZero::get))
}

/// The key of a person.
pub(super) fn key(person: u8) -> SigningKey {
    SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([person; 32]))
}

/// A mesh that is cut for a mark by default, with its bases.
pub(super) fn cut(mesh: &TriMesh) -> Result<Arc<Original>> {
    let original = Original::pooled(mesh.clone(), BITS, Pool::default(), &job())?;
    original.keep_bases(&job())?;
    Ok(Arc::new(original))
}

/// A model that is marked when something of it is asked for, since kept figures need no mark.
pub(super) struct MarkedModel<'a> {
    name: &'a str,
    mesh: &'a TriMesh,
    marked: OnceCell<Marked>,
}

impl<'a> MarkedModel<'a> {
    pub(super) fn new(name: &'a str, mesh: &'a TriMesh) -> Self {
        Self {
            name,
            mesh,
            marked: OnceCell::new(),
        }
    }

    pub(super) fn name(&self) -> &str {
        self.name
    }

    pub(super) fn mesh(&self) -> &TriMesh {
        self.mesh
    }

    pub(super) fn get(&self) -> Result<&Marked> {
        if self.marked.get().is_none() {
            let marked = Marked::new(self.name, self.mesh)?;
            let _ = self.marked.set(marked);
        }
        self.marked.get().context("just marked")
    }
}

/// A model, marked as `sigmark embed` does it by default.
pub(super) struct Marked {
    pub(super) name: String,
    /// The copy of recipient 0.
    pub(super) signed: Signed,
    /// As `sigmark verify` reads it: by the joint estimate.
    pub(super) ours: Verifier,
    /// By the paper's rule.
    pub(super) paper: Verifier,
}

impl Marked {
    fn new(name: &str, mesh: &TriMesh) -> Result<Self> {
        let original = cut(mesh)?;
        let signed = copy(&original, 0)?;
        let verifier = Verifier::with_original(&original, signed.certificate(), &key(OWNER).public_key())?;
        Ok(Self {
            name: name.into(),
            paper: verifier.clone().detector(CoefficientDetector::new),
            ours: verifier,
            signed,
        })
    }

    /// The copy of another recipient.
    pub(super) fn copy(&self, recipient: usize) -> Result<Signed> {
        copy(self.signed.original(), recipient)
    }
}

const OWNER: u8 = 1;

fn copy(original: &Arc<Original>, recipient: usize) -> Result<Signed> {
    let embedder = Embedder::new(&key(OWNER)).recipient(format!("recipient {recipient}"));
    Ok(embedder.embed_in(original, &job())?)
}
