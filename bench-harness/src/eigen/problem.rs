//! The surfaces that are compared on, and their matrices where other programs read them.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use evaluation::inputs::{mesh_files, name_of};
use job::Job;
use mesh::TriMesh;
use mesh_io::Asset;
use mhb_core::Laplacian;
use sigmark::mark::{LARGEST_PATCH, PatchCount, Patches};

use super::matrices::{fingerprint, write_matrices};

/// A surface whose matrices lie in a folder.
pub(crate) struct EigenProblem {
    pub(crate) name: String,
    pub(crate) laplacian: Laplacian,
    pub(crate) matrices: PathBuf,
}

impl EigenProblem {
    /// Writes the matrices into a folder of their own within `folder`. Finished cells lie beside them, and so belong to them alone.
    pub(crate) fn new(name: &str, mesh: &TriMesh, folder: &Path) -> Result<Self> {
        let laplacian = Laplacian::cotangent(mesh)?;
        let matrices = folder.join(format!("{name}-{:016x}", fingerprint(&laplacian)));
        write_matrices(&matrices, &laplacian)?;
        Ok(Self {
            name: name.into(),
            laplacian,
            matrices,
        })
    }

    /// The surface of a mesh file, or, where it is larger than `sigmark` lets a patch be, the largest of the patches that
    /// the paper's profile cuts it into.
    pub(crate) fn of_file(path: &Path, folder: &Path) -> Result<Self> {
        let asset = Asset::open(path)?;
        let name = name_of(path);
        if asset.mesh().vertex_count() <= LARGEST_PATCH {
            return Self::new(&name, asset.mesh(), folder);
        }
        let patches = cut(asset.mesh(), PatchCount::Paper)?;
        let name = format!("{name}, largest of {} patches", patches.len());
        Self::new(&name, &patches[0], folder)
    }

    pub(crate) fn size(&self) -> usize {
        self.laplacian.mass().len()
    }
}

/// As many harmonics as the paper's patches have.
pub(crate) const HARMONICS: usize = 325;

/// The patches of a mesh, the largest first.
pub(crate) fn cut(mesh: &TriMesh, count: PatchCount) -> Result<Vec<TriMesh>> {
    let patches = Patches::cut(mesh, HARMONICS, count, &Job::new(2))?;
    let mut patches: Vec<TriMesh> = patches.iter().map(|patch| patch.mesh().clone()).collect();
    patches.sort_by_key(|patch| std::cmp::Reverse(patch.vertex_count()));
    Ok(patches)
}

/// The mesh files whose names begin with one of these, in their order.
pub(crate) fn files(folder: &Path, beginnings: &[String]) -> Result<Vec<PathBuf>> {
    let all = mesh_files(folder)?;
    let mut chosen = Vec::new();
    for beginning in beginnings {
        let wanted = |path: &&PathBuf| name_of(path).starts_with(beginning.as_str());
        chosen.extend(all.iter().filter(wanted).cloned());
    }
    let shown = folder.display();
    ensure!(
        !chosen.is_empty(),
        "{shown}: no mesh file there has a name that was asked for"
    );
    Ok(chosen)
}
