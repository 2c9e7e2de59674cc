//! One model: signed by the code of `sigmark embed`, and what came back judged by that of `sigmark verify`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, ensure};
use job::Job;
use mesh::{Similarity, TriMesh, Welded, components, shapes};
use mesh_io::Asset;
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sigmark::{Certificate, Curve, Embedder, SigningKey, Verdict, Verifier};

use super::{Tried, converters::Converters};

/// With this begins what is said where a program made no file.
pub(super) const FAILED: &str = "the program failed";

/// A model that was signed with the default strength.
pub(super) struct SignedAsset {
    original: PathBuf,
    signed: PathBuf,
    folder: PathBuf,
    marked: TriMesh,
    certificate: Certificate,
    verifier: Verifier,
}

/// What was done with the signed model, and what was read then.
pub(super) struct Trial {
    pub(super) what: String,
    pub(super) verdict: Result<Verdict, String>,
}

impl SignedAsset {
    pub(super) fn make(original: &Path, folder: &Path) -> Result<Self> {
        let name = original.file_stem().unwrap_or_default();
        let folder = folder.join("models").join(name);
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        fs::create_dir_all(&folder)?;
        let (asset, job) = (Asset::open(original)?, Job::default());
        let key = SigningKey::generate(Curve::P256, &mut ChaCha20Rng::from_seed([18; 32]));
        let mut signed = Embedder::new(&key).embed(asset.mesh(), &job)?;
        let write = |positions: &[[f64; 3]]| anyhow::Ok(asset.with_positions(positions)?);
        let marked = signed.hold(write, |marked| marked.mesh().positions())?;
        let read_back = signed.read_back(marked.mesh().positions(), &job)?;
        ensure!(
            read_back.is_sound(),
            "the file's precision is too coarse for the mark"
        );
        let path = folder.join(original.file_name().unwrap_or_default());
        marked.save(&path, true)?;
        Ok(Self {
            original: original.into(),
            signed: path,
            folder,
            marked: marked.mesh().clone(),
            certificate: signed.certificate().clone(),
            verifier: Verifier::new(asset.mesh(), signed.certificate(), &key.public_key())?,
        })
    }

    pub(super) fn original(&self) -> &Path {
        &self.original
    }

    pub(super) fn signed(&self) -> &Path {
        &self.signed
    }

    /// As it is, through every program, and in parts.
    pub(super) fn try_all(&self, converters: &Converters) -> Result<Tried> {
        let ending = self
            .signed
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let mut trials = vec![Trial {
            what: "as it is".into(),
            verdict: self.verify_file(&self.signed),
        }];
        let mut of_originals = Vec::new();
        for conversion in converters.conversions(&ending) {
            let what = format!("{} → {}", conversion.tool, conversion.ending);
            let file = what.replace([' ', '→'], "_");
            let convert = |from: &Path, name: &str| {
                let to = self.folder.join(name).with_extension(conversion.ending);
                let converted = converters.convert(conversion, from, &to);
                converted
                    .map(|()| to)
                    .map_err(|error| format!("{FAILED}: {error}"))
            };
            trials.push(Trial {
                verdict: convert(&self.signed, &file).and_then(|to| self.verify_file(&to)),
                what: what.clone(),
            });
            of_originals.push(Trial {
                verdict: convert(&self.original, &format!("original_{file}"))
                    .and_then(|to| self.verify_with(&to)),
                what,
            });
        }
        trials.extend(self.parts());
        let is_scene = matches!(ending.as_str(), "glb" | "gltf");
        Ok(Tried {
            vertices: self.marked.vertex_count(),
            marked_parts: self.verifier.marked_parts(),
            outside_positions: match is_scene || ending == "obj" {
                true => Some(converters.outside_positions(&self.original, &self.signed)?),
                false => None,
            },
            new_issues: converters
                .new_issues(&self.original, &self.signed)
                .filter(|_| is_scene),
            trials,
            of_originals,
        })
    }

    fn verify_file(&self, path: &Path) -> Result<Verdict, String> {
        let judge = || -> Result<Verdict> {
            let suspect = Asset::open(path)?;
            self.verify(&*suspect.scene()?)
        };
        judge().map_err(|error| in_short(&error))
    }

    /// What `sigmark verify` says of the signed file where it is given another file in place of the original.
    fn verify_with(&self, original: &Path) -> Result<Verdict, String> {
        let judge = || -> Result<Verdict> {
            let given = Asset::open(original)?;
            let (certificate, key) = (&self.certificate, self.certificate.public_key());
            let verifier = Verifier::new(given.mesh(), certificate, key)
                .or_else(|_| Verifier::for_owner(given.mesh(), certificate, key))?;
            let suspect = Asset::open(&self.signed)?;
            Ok(verifier.verify(&*suspect.scene()?, &Job::default())?)
        };
        judge().map_err(|error| in_short(&error))
    }

    fn verify(&self, suspect: &TriMesh) -> Result<Verdict> {
        let verdict = self.verifier.verify(suspect, &Job::default());
        verdict.context("can't be judged")
    }

    /// The largest part alone, and all parts elsewhere; of models with several.
    fn parts(&self) -> Vec<Trial> {
        let mut parts = parts(&self.marked);
        if parts.len() < 2 {
            return Vec::new();
        }
        parts.sort_by_key(|part| std::cmp::Reverse(part.vertex_count()));
        let diagonal = self.marked.bounding_box().diagonal();
        let away = |i: usize| Similarity {
            scale: 1.0 + 0.2 * (i % 5) as f64,
            translation: [diagonal * i as f64, 0.0, -0.3 * diagonal],
            ..Similarity::from_quaternion([1.0, 0.3 * i as f64, -0.4, 0.2])
        };
        let apart: Vec<TriMesh> = parts
            .iter()
            .enumerate()
            .map(|(i, part)| shapes::moved(part, &away(i)))
            .collect();
        let shown = |what: &str, suspect: &TriMesh| Trial {
            what: what.into(),
            verdict: self.verify(suspect).map_err(|error| format!("{error:#}")),
        };
        vec![
            shown(
                "largest part alone, turned and scaled",
                &shapes::moved(&parts[0], &away(2)),
            ),
            shown(
                "every part moved, turned and scaled alone",
                &shapes::disjoint_union(&apart),
            ),
        ]
    }
}

/// The last of the causes, in a line, without the folders of this machine.
pub(super) fn in_short(error: &anyhow::Error) -> String {
    let cause = error.root_cause().to_string();
    let last = cause
        .lines()
        .rev()
        .find(|line| !line.trim().is_empty())
        .unwrap_or_default();
    let words = last.split_whitespace().map(|word| match word.rsplit_once('/') {
        Some((_, name)) if word.starts_with(['/', '.']) => name,
        _ => word,
    });
    words.collect::<Vec<_>>().join(" ")
}

/// The connected parts of a mesh.
fn parts(mesh: &TriMesh) -> Vec<TriMesh> {
    let components = components(mesh);
    let mut triangles = vec![Vec::new(); components.count];
    for &corners in mesh.triangles() {
        triangles[components.of_vertex[corners[0] as usize] as usize].push(corners);
    }
    let welded = triangles
        .iter()
        .filter_map(|triangles| Welded::new(mesh.positions(), triangles).ok());
    welded.map(Welded::into_mesh).collect()
}
