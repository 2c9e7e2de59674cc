//! The programs that a model goes through.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::Result;
use evaluation::{
    process::{output, output_within},
    python::Python,
};

use super::{npm, trial::in_short};

/// A program, and the format in which it gives the model back.
#[derive(Clone, Copy)]
pub(super) struct Conversion {
    pub(super) tool: &'static str,
    pub(super) ending: &'static str,
}

const fn to(tool: &'static str, ending: &'static str) -> Conversion {
    Conversion { tool, ending }
}

const ALL: [Conversion; 17] = [
    to("Blender", "glb"),
    to("Blender", "obj"),
    to("Blender", "stl"),
    to("Blender", "ply"),
    to("trimesh", "glb"),
    to("trimesh", "obj"),
    to("trimesh", "stl"),
    to("trimesh", "ply"),
    to("assimp", "obj"),
    to("assimp", "stl"),
    to("assimp", "ply"),
    to("gltf-transform copy", "glb"),
    to("gltf-transform weld", "glb"),
    to("gltf-transform optimize", "glb"),
    to("gltf-transform quantize", "glb"),
    to("gltfpack", "glb"),
    to("gltfpack -noq", "glb"),
];

/// Seconds that a program may take.
const LIMIT: u64 = 300;

/// The programs that are there; the others are left out, and said.
pub(super) struct Converters {
    python: Python,
    /// Where npm put its programs.
    npm: Option<PathBuf>,
    missing: Vec<&'static str>,
}

impl Converters {
    /// `npm` is where its programs are, or why there are none.
    pub(super) fn prepare(folder: &Path, npm: &Result<PathBuf>) -> Result<Self> {
        let scripts = npm::scripts();
        let python = Python::prepare_in(scripts.clone(), folder.join("venv"))?;
        let mut missing = Vec::new();
        let has_blender = || output(&mut python.command_of_code("import bpy")).is_ok();
        if !has_blender() && python.install(&scripts.join("requirements-blender.txt")).is_err() {
            println!("Blender is left out: its package (bpy) wants another Python");
            missing.push("Blender");
        }
        if output(Command::new("assimp").arg("version")).is_err() {
            println!("assimp is left out (Debian: apt-get install assimp-utils)");
            missing.push("assimp");
        }
        if let Err(error) = npm {
            println!("gltf-transform, gltfpack and the validator are left out: {error:#}");
            missing.push("gltf");
        }
        Ok(Self {
            python,
            npm: npm.as_ref().ok().cloned(),
            missing,
        })
    }

    /// Those that can be asked, of a model in a format.
    pub(super) fn conversions(&self, ending: &str) -> impl Iterator<Item = Conversion> {
        let is_scene = matches!(ending, "glb" | "gltf");
        let is_there = |tool: &str| self.missing.iter().all(|missing| !tool.starts_with(missing));
        ALL.into_iter().filter(move |conversion| {
            is_there(conversion.tool) && (is_scene || !conversion.tool.starts_with("gltf"))
        })
    }

    /// Takes a model through a program; says why it failed.
    pub(super) fn convert(&self, conversion: Conversion, from: &Path, to: &Path) -> Result<(), String> {
        let mut command = self.python.command("convert.py", [conversion.tool]);
        command.args([from, to]);
        if let Some(npm) = &self.npm {
            command.arg(npm.join("node_modules/.bin"));
        }
        match output_within(LIMIT, &command) {
            Ok(Some(_)) if to.is_file() => Ok(()),
            Ok(Some(_)) => Err("it wrote nothing".into()),
            Ok(None) => Err(format!("it took more than {LIMIT} s")),
            Err(error) => Err(in_short(&error)),
        }
    }

    /// What else than positions differs between two glTF, GLB or OBJ.
    pub(super) fn outside_positions(&self, before: &Path, after: &Path) -> Result<String> {
        Ok(self.python.run("same.py", [before, after])?.trim().into())
    }

    /// What Khronos' validator finds in the second file and did not find in the first.
    pub(super) fn new_issues(&self, before: &Path, after: &Path) -> Option<Vec<String>> {
        #[derive(serde::Deserialize)]
        struct Report {
            fresh: Vec<String>,
        }
        let npm = self.npm.as_ref()?;
        let printed = output(
            Command::new("node")
                .arg(npm.join("validate.js"))
                .args([before, after]),
        )
        .ok()?;
        serde_json::from_str::<Report>(&printed)
            .ok()
            .map(|report| report.fresh)
    }

    /// What there was, as the page says it.
    pub(super) fn versions(&self) -> Result<String> {
        Ok(match self.npm {
            Some(_) => format!(
                "{}, @gltf-transform/cli, gltfpack and gltf-validator as package.json says",
                self.python.versions()?
            ),
            None => self.python.versions()?,
        })
    }
}
