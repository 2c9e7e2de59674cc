//! Attacked meshes, and how far one lies from where it belongs.

use std::{
    fs,
    path::{Path, PathBuf},
    process,
};

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
    let stem = format!("{name}-{name_of_attack}-{seed}-{inputs}");
    let result = made_once(&folder, &stem, &bytes, |source, target| {
        let seed = seed.to_string();
        let words = [spec, "--seed", &seed].map(AsRef::as_ref);
        let files = [source.as_os_str(), target.as_os_str()];
        attacks.run("attack.py", files.into_iter().chain(words)).map(drop)
    })?;
    Ok(Asset::open(&result)?.mesh().clone())
}

/// The file `{stem}.ply`, which `make` makes of a file that holds `bytes`, unless it is there. What it is made of, and the file itself until it is
/// whole, have names of this process alone: another may make the same, or something else of another model of this name.
fn made_once(
    folder: &Path,
    stem: &str,
    bytes: &[u8],
    make: impl FnOnce(&Path, &Path) -> Result<()>,
) -> Result<PathBuf> {
    let result = folder.join(format!("{stem}.ply"));
    if result.is_file() {
        return Ok(result);
    }
    let named = |part: &str| folder.join(format!("{stem}.{}.{part}.ply", process::id()));
    let (source, partial) = (named("source"), named("partial"));
    results::write(&source, bytes)?;
    let made = make(&source, &partial)
        .and_then(|()| fs::rename(&partial, &result).with_context(|| result.display().to_string()));
    for left in [source, partial] {
        let _ = fs::remove_file(left);
    }
    made.map(|()| result)
}

/// The number of another of so many models than number `i`: of the one so many places on, or of the next behind that; none where there is no other.
pub(crate) fn another(i: usize, places: usize, count: usize) -> Option<usize> {
    (places..places + 2)
        .map(|places| (i + places) % count)
        .find(|&other| other != i)
}

/// Root mean square distance by which a transform moves the vertices of a mesh.
pub(crate) fn misfit(mesh: &TriMesh, transform: &Similarity) -> f64 {
    let moved = (0..mesh.vertex_count()).map(|v| {
        let p = mesh.point(v);
        (p - transform.apply(p)).squared()
    });
    (moved.sum::<f64>() / mesh.vertex_count() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_model_is_never_the_model_itself() {
        for count in 2..9 {
            for places in 1..6 {
                let others = (0..count).map(|i| (i, another(i, places, count)));
                assert!(
                    others
                        .clone()
                        .all(|(i, other)| other.is_some_and(|other| other != i && other < count))
                );
                // As before, where that is another.
                assert!(
                    others
                        .clone()
                        .all(|(i, other)| places % count == 0 || other == Some((i + places) % count))
                );
            }
        }
        assert_eq!([another(0, 1, 1), another(0, 4, 1)], [None; 2]);
    }

    #[test]
    fn a_suspect_is_made_of_the_mesh_that_was_given_while_another_is_made_of_the_same_name() {
        let folder = tempfile::tempdir().unwrap();
        let copied = |source: &Path, target: &Path| {
            fs::copy(source, target)?;
            Ok(())
        };
        let one = made_once(folder.path(), "model-noise-1-aa", b"one", |source, target| {
            // Another of the same name in the middle.
            made_once(folder.path(), "model-noise-1-bb", b"other", copied)?;
            copied(source, target)
        });
        assert_eq!(fs::read(one.unwrap()).unwrap(), b"one");
        let other = made_once(folder.path(), "model-noise-1-bb", b"", |_, _| {
            panic!("it is there")
        });
        assert_eq!(fs::read(other.unwrap()).unwrap(), b"other");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_suspect_that_could_not_be_made_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let made = made_once(folder.path(), "model", b"one", |_, target| {
            fs::write(target, "a half")?;
            anyhow::bail!("interrupted")
        });
        assert!(made.is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
