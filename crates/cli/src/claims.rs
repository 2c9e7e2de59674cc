//! The files of a claim: certificate, original, public key.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use mesh::Rig;
use mesh_io::Asset;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use sigmark::{Certificate, GeometryDigest, PublicKey, SigmarkError, Verifier};

use crate::{
    files::{self, Text},
    keys, report,
};

/// What a name of a certificate ends in.
pub(crate) const CERTIFICATE_SUFFIX: &str = ".cert.json";

/// Where the files of a claim lie.
#[derive(Clone, Debug)]
pub(crate) struct ClaimFiles {
    pub(crate) certificate: PathBuf,
    pub(crate) original: Option<PathBuf>,
    pub(crate) public_key: Option<PathBuf>,
}

/// A claim that was read. Original, certificate and key are not compared yet.
pub(crate) struct Claim {
    pub(crate) certificate: Certificate,
    pub(crate) certificate_file: ReadFile,
    /// The file of the key; `None` where it was taken from the certificate.
    pub(crate) key_file: Option<ReadFile>,
    pub(crate) original: Asset,
    pub(crate) original_path: PathBuf,
    /// What poses the original.
    pub(crate) rig: Option<Rig>,
    pub(crate) public_key: PublicKey,
    /// Whether the key was taken from the certificate, and says nothing of who the signer is.
    pub(crate) own_key: bool,
}

/// A file, and which bytes were read from it.
#[derive(Clone, Debug)]
pub(crate) struct ReadFile {
    pub(crate) path: PathBuf,
    pub(crate) bytes: usize,
    pub(crate) sha256: [u8; 32],
}

impl ReadFile {
    pub(crate) fn of(path: &Path, bytes: &[u8]) -> Self {
        Self {
            path: path.into(),
            bytes: bytes.len(),
            sha256: Sha256::digest(bytes).into(),
        }
    }
}

/// A mesh that was read, with the files to which it refers and which were read, too.
#[derive(Clone, Debug)]
pub(crate) struct ReadMesh {
    pub(crate) file: ReadFile,
    /// Buffers, materials and pictures.
    pub(crate) companions: Vec<ReadFile>,
}

impl ReadMesh {
    pub(crate) fn of(path: &Path, asset: &Asset) -> Self {
        let companions = asset.companions();
        Self {
            file: ReadFile::of(path, &asset.to_bytes()),
            companions: companions
                .map(|(name, bytes)| ReadFile::of(&path.with_file_name(name), bytes))
                .collect(),
        }
    }

    pub(crate) fn files(&self) -> impl Iterator<Item = &ReadFile> {
        std::iter::once(&self.file).chain(&self.companions)
    }
}

/// A claim file: names of files, from the folder in which it lies.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimDocument {
    certificate: PathBuf,
    original: PathBuf,
    public_key: PathBuf,
}

impl ClaimFiles {
    /// The files that a claim file names.
    pub(crate) fn listed_in(path: &Path) -> Result<Self> {
        let text = files::read_text(path, Text::Claim)?;
        let document: ClaimDocument = serde_json::from_str(&text).with_context(|| {
            format!(
                "{}: is no claim; write {{\"original\": FILE, \"certificate\": FILE, \"public_key\": FILE}} into it",
                path.display()
            )
        })?;
        let folder = files::folder_of(path);
        Ok(Self {
            certificate: folder.join(document.certificate),
            original: Some(folder.join(document.original)),
            public_key: Some(folder.join(document.public_key)),
        })
    }

    /// Reads all of them. What is not given is looked for: the original beside the certificate, the key in it.
    pub(crate) fn read(&self) -> Result<Claim> {
        let text = files::read_text(&self.certificate, Text::Certificate)?;
        let certificate =
            Certificate::from_json(&text).with_context(|| self.certificate.display().to_string())?;
        let (public_key, key_file) = match &self.public_key {
            Some(path) => {
                let (key, pem) = keys::read_public(path)?;
                (key, Some(ReadFile::of(path, pem.as_bytes())))
            }
            None => (*certificate.public_key(), None),
        };
        let (original_path, original) = match &self.original {
            Some(path) => (path.clone(), files::open_mesh(path)?),
            None => find_original(&certificate, &self.certificate)?,
        };
        Ok(Claim {
            certificate,
            certificate_file: ReadFile::of(&self.certificate, text.as_bytes()),
            key_file,
            rig: rig_of(&original, &original_path),
            original,
            original_path,
            public_key,
            own_key: self.public_key.is_none(),
        })
    }
}

impl Claim {
    /// Judges suspects by this claim, and undoes poses by the original's rig; fails where original, certificate and key don't belong together.
    pub(crate) fn verifier(&self) -> Result<Verifier, SigmarkError> {
        let verifier = Verifier::new(self.original.mesh(), &self.certificate, &self.public_key)?;
        self.warn_of_rig();
        Ok(verifier.with_rig(self.rig.clone()))
    }

    /// As [`verifier`](Self::verifier), and for the owner's information also where the original is of the same geometry and not the very file.
    pub(crate) fn verifier_for_owner(&self) -> Result<Verifier, SigmarkError> {
        let refused = match self.verifier() {
            Err(error @ SigmarkError::AnotherOriginal { .. }) => error,
            other => return other,
        };
        Verifier::for_owner(self.original.mesh(), &self.certificate, &self.public_key).map_err(|error| {
            match error {
                SigmarkError::AnotherOriginal { .. } => refused,
                error => error,
            }
        })
    }
}

impl Claim {
    /// Says why poses are not undone, where the certificate and the original's rig do not belong together.
    fn warn_of_rig(&self) {
        let is_bound = self.certificate.statement().original.rig.is_some();
        let why = match (&self.rig, is_bound) {
            (Some(rig), _) if !self.certificate.binds(rig) => {
                "its joints or morph targets are not those that were signed with it"
            }
            (None, true) => "the joints or morph targets that were signed with it are not in this file",
            _ => return,
        };
        let path = self.original_path.display();
        report::warning(&format!(
            "{path}: {why}, so a suspect in another pose can't be brought back"
        ));
    }
}

/// What poses a model. One that is damaged costs nobody a claim: the mesh is what is signed.
pub(crate) fn rig_of(asset: &Asset, path: &Path) -> Option<Rig> {
    asset.rig().unwrap_or_else(|error| {
        report::warning(&format!(
            "{}: what poses it is passed over: {error}",
            path.display()
        ));
        None
    })
}

/// Reads and checks a certificate.
pub(crate) fn read_certificate(path: &Path) -> Result<Certificate> {
    Ok(read_certificate_text(path)?.0)
}

/// Reads and checks a certificate; with its text.
pub(crate) fn read_certificate_text(path: &Path) -> Result<(Certificate, String)> {
    let text = files::read_text(path, Text::Certificate)?;
    let certificate = Certificate::from_json(&text).with_context(|| path.display().to_string())?;
    Ok((certificate, text))
}

/// The original in the certificate's folder: the file of its name, or else any mesh, with the digest of the certificate; else one of its geometry.
fn find_original(certificate: &Certificate, path: &Path) -> Result<(PathBuf, Asset)> {
    let folder = files::folder_of(path);
    let mut candidates =
        meshes_in(folder).with_context(|| format!("{}: can't be listed", folder.display()))?;
    // A name with a folder in it, which no embed writes, matches none.
    candidates.sort_by_key(|path| path.file_name() != Some(certificate.original_name().as_ref()));
    let mut alike = None;
    for candidate in candidates {
        // What can't be read is not the original, which could be.
        let Ok(asset) = files::open_mesh(&candidate) else {
            continue;
        };
        if GeometryDigest::of(asset.mesh()) == certificate.statement().original.digest {
            return Ok((candidate, asset));
        }
        let is_alike = || {
            let sketch = certificate.sketch_for(asset.mesh());
            sketch.is_some_and(|sketch| sketch.recognise(asset.mesh()).is_some())
        };
        if alike.is_none() && is_alike() {
            alike = Some((candidate, asset));
        }
    }
    if let Some(alike) = alike {
        return Ok(alike);
    }
    let name = match certificate.original_name() {
        "" => String::new(),
        name => format!(" ({name})"),
    };
    bail!(
        "{}: its original{name} is not beside it (the signed copy is another file, whatever its name); give the very file that was signed with --original",
        path.display()
    )
}

/// The files of a folder whose names are those of meshes, in the order of their names.
fn meshes_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut meshes = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let path = path.strip_prefix(".").map(Path::to_path_buf).unwrap_or(path);
        if mesh_io::Format::of_path(&path).is_some() && path.is_file() {
            meshes.push(path);
        }
    }
    meshes.sort();
    Ok(meshes)
}

/// The files that were named, and in the order of their names those in folders that were and that are named as certificates are.
pub(crate) fn certificates_in(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for path in named {
        if !path.is_dir() {
            paths.push(path.clone());
            continue;
        }
        let mut inside = Vec::new();
        walk_for_certificates(path, &mut inside)
            .with_context(|| format!("{}: can't be listed; allow it with chmod", path.display()))?;
        inside.sort();
        paths.append(&mut inside);
    }
    Ok(paths)
}

/// Hidden files are passed over, and folders are not followed through links.
fn walk_for_certificates(folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with('.') {
            continue;
        }
        if entry.file_type()?.is_dir() {
            walk_for_certificates(&entry.path(), found)?;
        } else if name.ends_with(CERTIFICATE_SUFFIX) {
            found.push(entry.path());
        }
    }
    Ok(())
}
