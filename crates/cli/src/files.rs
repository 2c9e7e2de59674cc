//! Files: which may be written, which may not, and those that are no meshes: keys, certificates, time stamps, graphs, arrays.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, anyhow, bail};
use mesh_io::Asset;

use crate::interrupt;

const KEY: &str = "a key";
const CERTIFICATE: &str = "a certificate";
const ROOTS: &str = "a list of root certificates";

/// A kind of file that a command reads; all are text but a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Text {
    PrivateKey,
    PublicKey,
    Certificate,
    Claim,
    Roots,
    Reply,
    Graph,
    Points,
    Recipients,
}

impl Text {
    fn name(self) -> &'static str {
        match self {
            Self::PrivateKey => "a private key",
            Self::PublicKey => "a public key",
            Self::Certificate => CERTIFICATE,
            Self::Claim => "a claim",
            Self::Roots => ROOTS,
            Self::Reply => "an authority's reply",
            Self::Graph => "a graph",
            Self::Points => "a list of points",
            Self::Recipients => "a list of recipients",
        }
    }

    /// As `recognised` calls it: which key it is, is said by whoever reads it.
    fn family(self) -> &'static str {
        match self {
            Self::PrivateKey | Self::PublicKey => KEY,
            other => other.name(),
        }
    }

    fn remedy(self) -> &'static str {
        match self {
            Self::PrivateKey => "give the .pem file that `sigmark keygen` wrote",
            Self::PublicKey => "give the .pub.pem file that `sigmark keygen` wrote",
            Self::Certificate => "give the .cert.json file that `sigmark embed` wrote",
            Self::Claim => "give a JSON file that names original, certificate and public_key",
            Self::Roots => "give the PEM file of the authority's root certificate",
            Self::Reply => "give the file that the authority sent, in DER",
            Self::Graph => "give a .graph file in METIS format",
            Self::Recipients => "give a CSV file in UTF-8 with a recipient in each line",
            Self::Points => {
                "give a text file with a pair of points in each line, as `sigmark align --help` says"
            }
        }
    }

    /// A file larger than this is not of this kind; it is not read into memory.
    fn largest(self) -> u64 {
        match self {
            Self::Graph => mesh_io::LARGEST,
            Self::Points | Self::Recipients => 64 << 20,
            Self::Roots | Self::Reply => time_stamp::MOST_BYTES as u64,
            _ => sigmark::claim::LARGEST as u64,
        }
    }
}

/// Reads a text file of a kind.
pub(crate) fn read_text(path: &Path, kind: Text) -> Result<String> {
    let bytes = read_bytes(path, kind)?;
    String::from_utf8(bytes).map_err(|error| {
        let (name, remedy) = (kind.name(), kind.remedy());
        let place = error.utf8_error().valid_up_to();
        anyhow!(
            "{}: is not text (byte {place}), so it is not {name}: {remedy}",
            path.display()
        )
    })
}

/// Reads a file of a kind.
pub(crate) fn read_bytes(path: &Path, kind: Text) -> Result<Vec<u8>> {
    let (name, remedy) = (kind.name(), kind.remedy());
    let failed = |error: &io::Error| {
        let remedy = match error.kind() {
            io::ErrorKind::NotFound => "check the spelling and the folder",
            io::ErrorKind::PermissionDenied => "allow it with chmod, or ask the owner of the file",
            _ => "check the disk and the path",
        };
        anyhow!("{}: can't be read ({error}): {remedy}", path.display())
    };
    let metadata = fs::metadata(path).map_err(|error| failed(&error))?;
    if !metadata.is_file() {
        let found = if metadata.is_dir() {
            "a directory"
        } else {
            "not a regular file"
        };
        bail!("{}: is {found}, not {name}: {remedy}", path.display());
    }
    if metadata.len() > kind.largest() {
        let size = metadata.len() >> 20;
        bail!(
            "{}: has {size} MiB, far more than {name} ever has: {remedy}",
            path.display()
        );
    }
    let bytes = fs::read(path).map_err(|error| failed(&error))?;
    if bytes.is_empty() {
        bail!("{}: is empty, not {name}: {remedy}", path.display());
    }
    if let Some(found) = recognised(&bytes).filter(|&found| found != kind.family()) {
        bail!("{}: is {found}, not {name}: {remedy}", path.display());
    }
    Ok(bytes)
}

/// Opens a mesh; a certificate or a key in its place is recognised.
pub(crate) fn open_mesh(path: &Path) -> Result<Asset> {
    Asset::open(path).map_err(|error| {
        let mut beginning = Vec::new();
        let read = fs::File::open(path).and_then(|file| file.take(200).read_to_end(&mut beginning));
        match recognised(&beginning).filter(|_| read.is_ok()) {
            Some(found) => anyhow!(
                "{}: is {found}, but a mesh belongs here: see --help for which file goes where",
                path.display()
            ),
            None => error.into(),
        }
    })
}

/// What a file is, if it is one that this program writes and no mesh.
fn recognised(beginning: &[u8]) -> Option<&'static str> {
    let beginning = String::from_utf8_lossy(&beginning[..beginning.len().min(200)]);
    if beginning.starts_with('{') && beginning.contains("sigmark-certificate") {
        Some(CERTIFICATE)
    } else if beginning.starts_with("-----BEGIN CERTIFICATE") {
        Some(ROOTS)
    } else if beginning.starts_with("-----BEGIN ") {
        Some(KEY)
    } else {
        None
    }
}

/// Refuses early, before the work is done, to write where a file stands or where nothing can be written.
pub(crate) fn check_free(path: &Path, force: bool) -> Result<()> {
    let shown = path.display();
    if path.is_dir() {
        bail!("{shown}: is a directory; name a file in it");
    }
    if !force && fs::symlink_metadata(path).is_ok() {
        bail!("{shown}: exists already; use --force to replace it, or another name");
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        bail!("{shown}: there is no folder {}; make it first", folder.display());
    }
    let _whole = interrupt::writing();
    tempfile::Builder::new()
        .prefix(".sigmark-")
        .tempfile_in(folder)
        .with_context(|| {
            format!("{shown}: nothing can be written in this folder; choose another, or allow it with chmod")
        })?;
    Ok(())
}

/// Refuses to write over what is read, even with `--force`: without the original nothing can be verified, without the key
/// nothing signed.
pub(crate) fn check_apart(output: &Path, input: &Path, what: &str) -> Result<()> {
    if resolved(output) == resolved(input) {
        bail!("{}: is {what}; write to another file", output.display());
    }
    Ok(())
}

/// A path without links and dots, whether or not the file exists.
pub(crate) fn resolved(path: &Path) -> PathBuf {
    let folder = || Some(fs::canonicalize(folder_of(path)).ok()?.join(path.file_name()?));
    fs::canonicalize(path)
        .ok()
        .or_else(folder)
        .unwrap_or_else(|| path.into())
}

pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// A file to be written.
pub(crate) struct Output<'a> {
    pub(crate) path: &'a Path,
    pub(crate) bytes: &'a [u8],
    /// Readable by its owner alone.
    pub(crate) private: bool,
}

impl<'a> Output<'a> {
    /// Readable by all whom the umask lets.
    pub(crate) fn public((path, bytes): (&'a Path, &'a [u8])) -> Self {
        let private = false;
        Self { path, bytes, private }
    }
}

/// Writes files that belong together: if one can't be written, those before it that are new go away again. Ctrl-C waits.
pub(crate) fn write_together(outputs: &[Output<'_>], force: bool) -> Result<()> {
    let _whole = interrupt::writing();
    let mut new: Vec<&Path> = Vec::new();
    for output in outputs {
        let stood = fs::symlink_metadata(output.path).is_ok();
        let write = if output.private {
            mesh_io::write_private_file
        } else {
            mesh_io::write_file
        };
        if let Err(error) = write(output.path, output.bytes, force) {
            for path in new {
                // The failure to write is what the user has to know; a file that stays besides does no harm.
                let _ = fs::remove_file(path);
            }
            return Err(error.into());
        }
        if !stood {
            new.push(output.path);
        }
    }
    Ok(())
}

/// Whether a name ends in `.extension`, in upper or lower case.
pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    let own = path.extension();
    own.is_some_and(|own| own.eq_ignore_ascii_case(extension))
}

/// `path` with `suffix` behind its whole name.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_os_string();
    name.push(suffix);
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_files_that_belong_together_all_are_written_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let (first, second) = (
            folder.path().join("first"),
            folder.path().join("no folder/second"),
        );
        let outputs = [&first, &second].map(|path| Output {
            path,
            bytes: b"x",
            private: false,
        });
        assert!(write_together(&outputs, false).is_err());
        assert!(!first.exists());
        assert!(write_together(&outputs[..1], false).is_ok());
        assert!(first.exists());
    }

    #[test]
    fn a_file_is_the_same_under_any_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.obj");
        let other = folder
            .path()
            .join("..")
            .join(folder.path().file_name().unwrap())
            .join("model.obj");
        assert!(check_apart(&path, &other, "the model").is_err());
        fs::write(&path, "v").unwrap();
        assert!(check_apart(&path, &other, "the model").is_err());
        assert!(check_apart(&path, &folder.path().join("signed.obj"), "the model").is_ok());
    }
}
