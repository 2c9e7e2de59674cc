//! Matrices as files, for programs in other languages; and what tells them apart.

use std::{
    fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::Path,
};

use anyhow::{Context, Result, ensure};
use mhb_core::Laplacian;
use sprs::CsMat;

use crate::results;

/// Writes S as compressed rows, `offsets.u64`, `columns.u64`, `values.f64`, and the diagonal of D, `mass.f64`, into a folder:
/// little-endian, without headers, for programs in other languages.
pub(crate) fn write_matrices(folder: &Path, laplacian: &Laplacian) -> Result<()> {
    let stiffness = laplacian.stiffness();
    let integers = |numbers: &[usize]| numbers.iter().flat_map(|&i| (i as u64).to_le_bytes()).collect();
    let reals = |numbers: &[f64]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let files: [(&str, Vec<u8>); 4] = [
        ("offsets.u64", integers(stiffness.indptr().raw_storage())),
        ("columns.u64", integers(stiffness.indices())),
        ("values.f64", reals(stiffness.data())),
        ("mass.f64", reals(laplacian.mass())),
    ];
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for (name, bytes) in files {
        results::write(&folder.join(name), bytes)?;
    }
    Ok(())
}

/// Reads what [`write_matrices`] wrote.
pub(crate) fn read_matrices(folder: &Path) -> Result<Laplacian> {
    let words = |name: &str| {
        let path = folder.join(name);
        let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
        let (words, rest) = bytes.as_chunks::<8>();
        ensure!(rest.is_empty(), "{}: ends within a number", path.display());
        Ok(words.to_vec())
    };
    let integer = |word| u64::from_le_bytes(word) as usize;
    let integers = |name| anyhow::Ok(words(name)?.into_iter().map(integer).collect::<Vec<_>>());
    let reals = |name| {
        anyhow::Ok(
            words(name)?
                .into_iter()
                .map(f64::from_le_bytes)
                .collect::<Vec<_>>(),
        )
    };
    let mass = reals("mass.f64")?;
    let (offsets, columns) = (integers("offsets.u64")?, integers("columns.u64")?);
    let stiffness = CsMat::try_new((mass.len(), mass.len()), offsets, columns, reals("values.f64")?);
    let stiffness = stiffness.map_err(|(_, _, _, error)| error);
    let stiffness = stiffness.with_context(|| folder.display().to_string())?;
    Ok(Laplacian::new(stiffness, mass)?)
}

/// A number that tells matrices apart, so that figures of one problem are not taken for those of another.
pub(crate) fn fingerprint(laplacian: &Laplacian) -> u64 {
    let mut hasher = DefaultHasher::new();
    laplacian.stiffness().indices().hash(&mut hasher);
    let reals = laplacian.stiffness().data().iter().chain(laplacian.mass());
    reals.for_each(|x| x.to_bits().hash(&mut hasher));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface;

    #[test]
    fn matrices_come_back_from_their_files_as_they_were() {
        let laplacian = Laplacian::cotangent(&surface(40)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        write_matrices(folder.path(), &laplacian).unwrap();
        let again = read_matrices(folder.path()).unwrap();
        assert_eq!(
            (again.stiffness(), again.mass()),
            (laplacian.stiffness(), laplacian.mass())
        );
        assert_eq!(fingerprint(&again), fingerprint(&laplacian));
        let other = Laplacian::cotangent(&surface(160)).unwrap();
        assert_ne!(fingerprint(&other), fingerprint(&laplacian));
    }
}
