//! Attacked meshes, and how far one lies from where it belongs.

use std::fs;

use anyhow::{Context, Result};
use evaluation::{
    python::Python,
    sources::{self, digest},
};
use mesh::{Similarity, TriMesh};
use mesh_io::{Asset, Format, Precision, write_mesh};

use crate::{kept, results};

/// A mesh after an attack; finished ones are kept, by the digest of the mesh and of the attacks' code.
pub(crate) fn attacked(
    attacks: &Python,
    original: &TriMesh,
    name: &str,
    spec: &str,
    seed: u64,
) -> Result<TriMesh> {
    let folder = kept::folder("suspects")?;
    let bytes = write_mesh(original, Format::Ply, Precision::Double);
    let inputs = digest(&[&bytes, sources::digest_of_attacks()?.as_bytes()].concat());
    let name_of_attack = spec.replace(':', "-");
    let result = folder.join(format!("{name}-{name_of_attack}-{seed}-{inputs}.ply"));
    if !result.is_file() {
        let source = folder.join(format!("{name}.ply"));
        results::write(&source, bytes)?;
        // Under a name of its own until it is whole.
        let partial = folder.join(format!("{name}-{name_of_attack}-{seed}.partial.ply"));
        let seed = seed.to_string();
        let words = [spec, "--seed", &seed].map(AsRef::as_ref);
        attacks.run(
            "attack.py",
            [source.as_os_str(), partial.as_os_str()].into_iter().chain(words),
        )?;
        fs::rename(&partial, &result).with_context(|| result.display().to_string())?;
    }
    Ok(Asset::open(&result)?.mesh().clone())
}

/// Root mean square distance by which a transform moves the vertices of a mesh.
pub(crate) fn misfit(mesh: &TriMesh, transform: &Similarity) -> f64 {
    let moved = (0..mesh.vertex_count()).map(|v| {
        let p = mesh.point(v);
        (p - transform.apply(p)).squared()
    });
    (moved.sum::<f64>() / mesh.vertex_count() as f64).sqrt()
}
