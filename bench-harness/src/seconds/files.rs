//! The meshes that the program reads and writes.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use evaluation::python::Python;
use mesh::{Similarity, TriMesh, shapes};
use mesh_io::{Asset, Format, Precision, write_mesh};

use super::runs::{Layout, Work};
use crate::{kept, results, suspects::attacked};

/// A mesh's folder: the model, what was signed, and what became of that.
pub(super) struct MeshFiles {
    name: String,
    folder: PathBuf,
}

impl MeshFiles {
    /// Writes the model, as binary PLY in single precision, unless it is there. What other code made of it, or of another mesh of this name, is removed: it would be
    /// read in place of what this code makes. `key` tells code and mesh from others.
    pub(super) fn of(name: &str, mesh: TriMesh, key: &str) -> Result<Self> {
        let path = format!("seconds/files/{name}");
        let mut folder = kept::folder(&path)?;
        let stamp = folder.join("key.txt");
        if !fs::read_to_string(&stamp).is_ok_and(|made_by| made_by == key) {
            fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
            folder = kept::folder(&path)?;
            results::write(&stamp, key)?;
        }
        let files = Self {
            name: name.into(),
            folder,
        };
        if !files.model().is_file() {
            write(&files.model(), &mesh)?;
        }
        Ok(files)
    }

    pub(super) fn model(&self) -> PathBuf {
        self.folder.join("model.ply")
    }

    pub(super) fn marked(&self, layout: Layout) -> PathBuf {
        self.folder.join(format!("{layout}.ply"))
    }

    pub(super) fn certificate(&self, layout: Layout) -> PathBuf {
        self.folder.join(format!("{layout}.ply.cert.json"))
    }

    /// The file that is verified: the one that was signed, or a copy that is made of it.
    pub(super) fn suspect(&self, layout: Layout, work: Work, attacks: &Python) -> Result<PathBuf> {
        let marked = self.marked(layout);
        let asset = match work {
            Work::Embed | Work::Untouched => return Ok(marked),
            Work::Moved | Work::Decimated(_) => Asset::open(&marked)?,
        };
        let copy = match work {
            Work::Decimated(share) => {
                let name = format!("{}-{layout}", self.name);
                attacked(attacks, asset.mesh(), &name, &format!("simplify:{share}"), 0)?
            }
            _ => exactly_moved(asset.mesh()),
        };
        let path = self.folder.join(format!("{layout}-suspect.ply"));
        write(&path, &copy)?;
        Ok(path)
    }
}

/// Half as large and turned by a quarter about z: coordinates change places, signs and exponents, and are not rounded.
const EXACT_MOVE: Similarity = Similarity {
    scale: 0.5,
    rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    translation: [0.0; 3],
};

/// The mesh moved without rounding, its vertices and triangles in random order.
fn exactly_moved(mesh: &TriMesh) -> TriMesh {
    shapes::shuffled(&shapes::moved(mesh, &EXACT_MOVE), 1)
}

fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    results::write(path, write_mesh(mesh, Format::Ply, Precision::Single))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_that_was_moved_exactly_has_the_bits_of_the_original_in_another_order() {
        let in_single = |mesh: &TriMesh| {
            let bytes = write_mesh(mesh, Format::Ply, Precision::Single);
            Asset::from_bytes(bytes, Format::Ply).unwrap().mesh().clone()
        };
        let sorted = |mut positions: Vec<[f64; 3]>| {
            positions.sort_by(|p, q| p.partial_cmp(q).unwrap());
            positions
        };
        let original = in_single(&shapes::bumpy_sphere(3, 7));
        let moved = in_single(&exactly_moved(&original));
        assert_eq!(moved.triangle_count(), original.triangle_count());
        let back = moved
            .positions()
            .iter()
            .map(|[x, y, z]| [2.0 * y, -2.0 * x, 2.0 * z]);
        let back: Vec<[f64; 3]> = back.collect();
        assert_ne!(back, original.positions());
        assert_eq!(sorted(back), sorted(original.positions().to_vec()));
    }
}
