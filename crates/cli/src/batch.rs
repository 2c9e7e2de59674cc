//! Several files at once: folders that are walked for meshes, and how they are counted.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use mesh_io::Format;

use crate::files;

/// A mesh file that was named, or found in a folder that was.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Found {
    /// The file.
    pub(crate) path: PathBuf,
    /// Its path from the folder that was named; of a file that was named, its name.
    pub(crate) relative: PathBuf,
}

/// Whether these arguments are more than one file.
pub(crate) fn is_batch(paths: &[PathBuf]) -> bool {
    paths.len() > 1 || paths.iter().any(|path| path.is_dir())
}

/// The files that were named, and in the order of their names those in folders that were. What lies in `except` is left out, unless it
/// was named.
pub(crate) fn meshes(paths: &[PathBuf], except: Option<&Path>) -> Result<Vec<Found>> {
    let except = except.and_then(|path| fs::canonicalize(path).ok());
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            let relative = path.file_name().map_or_else(|| path.clone(), PathBuf::from);
            found.push(Found {
                path: path.clone(),
                relative,
            });
            continue;
        }
        let mut inside = Vec::new();
        walk(path, Path::new(""), except.as_deref(), &mut inside)?;
        if inside.is_empty() {
            bail!(
                "{}: is a directory, and no file in it is named as a mesh is; name a file, or a folder with meshes",
                path.display()
            );
        }
        inside.sort();
        found.append(&mut inside);
    }
    Ok(found)
}

/// Hidden files are passed over, and folders are not followed through links, which may lead in circles.
fn walk(folder: &Path, relative: &Path, except: Option<&Path>, found: &mut Vec<Found>) -> Result<()> {
    let listed = || {
        format!(
            "{}: can't be listed; allow it with chmod, or name its files",
            folder.display()
        )
    };
    let entries: io::Result<Vec<fs::DirEntry>> = fs::read_dir(folder).and_then(Iterator::collect);
    for entry in entries.with_context(listed)? {
        let (path, relative) = (entry.path(), relative.join(entry.file_name()));
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let is_folder = entry.file_type().with_context(listed)?.is_dir();
        let is_except = || except.is_some() && fs::canonicalize(&path).ok().as_deref() == except;
        if is_folder && !is_except() {
            walk(&path, &relative, except, found)?;
        } else if Format::of_path(&path).is_some() && path.is_file() {
            found.push(Found { path, relative });
        }
    }
    Ok(())
}

/// What two names of one file have in common: some systems take names that differ in case alone for the same.
pub(crate) fn name_key(path: &Path) -> PathBuf {
    match cfg!(any(windows, target_os = "macos")) {
        true => PathBuf::from(path.to_string_lossy().to_lowercase()),
        false => path.into(),
    }
}

/// Refuses models whose signed copies would have one name.
pub(crate) fn check_apart(models: &[Found]) -> Result<()> {
    let keyed = models.iter().map(|model| (name_key(&model.relative), model));
    let mut named: Vec<(PathBuf, &Found)> = keyed.collect();
    named.sort();
    for pair in named.windows(2) {
        if let [(name, first), (other, second)] = pair
            && name == other
        {
            bail!(
                "{} and {} would both become {}; sign them in two runs",
                first.path.display(),
                second.path.display(),
                first.relative.display()
            );
        }
    }
    Ok(())
}

/// Makes the folder of a file, if there is none.
pub(crate) fn make_folder_of(path: &Path) -> Result<()> {
    let folder = files::folder_of(path);
    fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: this folder can't be made; choose another, or allow it with chmod",
            folder.display()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(path: &str, relative: &str) -> Found {
        Found {
            path: path.into(),
            relative: relative.into(),
        }
    }

    #[test]
    fn folders_are_walked_in_order_for_meshes_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("models");
        for name in [
            "b.ply",
            "a.obj",
            "deep/er/c.STL.gz",
            "a.obj.cert.json",
            ".d.obj",
            ".git/e.obj",
            "out/f.off",
        ] {
            let path = root.join(name);
            make_folder_of(&path).unwrap();
            fs::write(path, "").unwrap();
        }
        let file = folder.path().join("z.obj");
        let given = [file.clone(), root.clone()];
        let names = |found: Vec<Found>| -> Vec<String> {
            found
                .iter()
                .map(|found| found.relative.to_string_lossy().replace('\\', "/"))
                .collect()
        };
        let all = meshes(&given, None).unwrap();
        assert_eq!(
            all[0],
            Found {
                path: file,
                relative: "z.obj".into()
            }
        );
        assert_eq!(
            names(all),
            ["z.obj", "a.obj", "b.ply", "deep/er/c.STL.gz", "out/f.off"]
        );
        let others = meshes(&given[1..], Some(&root.join("out"))).unwrap();
        assert_eq!(names(others), ["a.obj", "b.ply", "deep/er/c.STL.gz"]);

        let empty = folder.path().join("empty");
        fs::create_dir(&empty).unwrap();
        assert!(
            meshes(&[empty], None)
                .unwrap_err()
                .to_string()
                .contains("no file in it is named as a mesh is")
        );
    }

    #[test]
    fn names_that_would_collide_are_refused() {
        let apart = [found("a.obj", "a.obj"), found("m/b/a.obj", "b/a.obj")];
        assert!(check_apart(&apart).is_ok());
        let together = [
            found("m/a.obj", "a.obj"),
            found("b.obj", "b.obj"),
            found("n/a.obj", "a.obj"),
        ];
        let error = check_apart(&together).unwrap_err().to_string();
        assert!(
            error.starts_with("m/a.obj and n/a.obj would both become a.obj"),
            "{error}"
        );
    }
}
