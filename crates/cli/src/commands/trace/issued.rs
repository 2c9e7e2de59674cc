//! The certificates of all copies.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use job::Job;
use sigmark::{
    PublicKey, SigmarkError,
    claim::{CertificateReader, Issued, Tracer},
};

use crate::{
    claims::{CERTIFICATE_SUFFIX, ReadFile},
    files::{self, Text},
    report,
};

/// Certificates that are read at a time, so that not all are in memory.
const AT_A_TIME: usize = 256;

/// A copy that is asked for.
#[derive(Clone, Debug)]
pub(crate) struct IssuedCopy {
    pub(crate) recipient: String,
    pub(crate) message: String,
    pub(crate) certificate: PathBuf,
}

/// All copies of an original that are asked for.
pub(crate) struct Copies {
    pub(crate) tracer: Tracer,
    /// In the order of the tracer's numbers.
    pub(crate) copies: Vec<IssuedCopy>,
    pub(crate) key: PublicKey,
    /// The key's file, where it was given.
    pub(crate) key_file: Option<ReadFile>,
    /// Certificates of other originals or keys.
    pub(crate) passed_over: usize,
    /// What looks like a certificate and is none.
    pub(crate) unreadable: Vec<PathBuf>,
}

impl Copies {
    /// Reads certificates, which lie where some paths were named, for an original; without a key by that of the first.
    pub(crate) fn read(
        original: &mesh::TriMesh,
        key: Option<PublicKey>,
        named: &[PathBuf],
        paths: &[PathBuf],
        job: &Job,
    ) -> Result<Self> {
        let reader = CertificateReader::new();
        let mut all = Collected {
            original,
            key,
            tracer: None,
            copies: Vec::new(),
            refused: None,
            passed_over: 0,
            unreadable: Vec::new(),
        };
        for chunk in paths.chunks(AT_A_TIME) {
            let read = |i: usize| -> Result<Issued> {
                let path: &Path = &chunk[i];
                let text = files::read_text(path, Text::Certificate)?;
                reader.read(&text).with_context(|| path.display().to_string())
            };
            for (path, issued) in chunk.iter().zip(job.map(chunk.len(), 8, read)?) {
                all.add(path, issued)?;
            }
        }
        all.finished(named)
    }
}

/// What was read so far.
struct Collected<'a> {
    original: &'a mesh::TriMesh,
    key: Option<PublicKey>,
    tracer: Option<Tracer>,
    copies: Vec<IssuedCopy>,
    /// Why the first was passed over.
    refused: Option<anyhow::Error>,
    passed_over: usize,
    unreadable: Vec<PathBuf>,
}

impl Collected<'_> {
    fn add(&mut self, path: &Path, issued: Result<Issued>) -> Result<()> {
        let issued = match issued {
            Ok(issued) => issued,
            Err(error) => {
                report::failure(&error);
                self.unreadable.push(path.into());
                return Ok(());
            }
        };
        let certificate = issued.unchecked();
        let key = *self.key.get_or_insert(*certificate.public_key());
        if self.tracer.is_none() {
            self.tracer = Some(Tracer::new(self.original, &key)?);
        }
        let Some(tracer) = &mut self.tracer else {
            return Ok(());
        };
        let statement = certificate.statement();
        let copy = IssuedCopy {
            recipient: statement.recipient.clone(),
            message: statement.message.clone(),
            certificate: path.into(),
        };
        match tracer.add(&issued) {
            Ok(_) => self.copies.push(copy),
            Err(
                error @ (SigmarkError::AnotherKey { .. }
                | SigmarkError::AnotherOriginal { .. }
                | SigmarkError::PaperProfile),
            ) => {
                self.passed_over += 1;
                let error = anyhow::Error::new(error).context(path.display().to_string());
                self.refused.get_or_insert(error);
            }
            Err(error @ SigmarkError::Certificate(_)) => {
                report::failure(&anyhow::Error::new(error).context(path.display().to_string()));
                self.unreadable.push(path.into());
            }
            Err(error) => return Err(anyhow::Error::new(error).context(path.display().to_string())),
        }
        Ok(())
    }

    fn finished(self, named: &[PathBuf]) -> Result<Copies> {
        let Self {
            tracer,
            copies,
            key,
            passed_over,
            unreadable,
            refused,
            ..
        } = self;
        match (tracer, key, refused) {
            (_, _, Some(refused)) if copies.is_empty() => Err(refused),
            (Some(tracer), Some(key), _) => Ok(Copies {
                tracer,
                copies,
                key,
                key_file: None,
                passed_over,
                unreadable,
            }),
            _ => {
                let named: Vec<String> = named.iter().map(|path| path.display().to_string()).collect();
                bail!(
                    "{}: no certificate there could be read (their names end in {CERTIFICATE_SUFFIX}); name the folder into which `sigmark embed` wrote the copies",
                    report::listed(&named)
                )
            }
        }
    }
}
