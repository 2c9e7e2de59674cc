//! The certificates of all copies.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use job::Job;
use mesh::TriMesh;
use sigmark::{
    GeometryDigest, PublicKey, SigmarkError,
    claim::{CertificateReader, Issued, Tracer, trace::signer_of},
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
    /// Reads certificates, which lie where some paths were named, for an original; without a key by that of the first that is of this original and was signed.
    pub(crate) fn read(
        (original_path, original): (&Path, &TriMesh),
        key: Option<PublicKey>,
        named: &[PathBuf],
        paths: &[PathBuf],
        job: &Job,
    ) -> Result<Self> {
        let reader = CertificateReader::new();
        let asker = |key| -> Result<Asker, SigmarkError> {
            let tracer = Tracer::new(original, &key)?;
            Ok(Asker { key, tracer })
        };
        let mut all = Collected {
            original_path,
            original,
            digest: GeometryDigest::of(original),
            is_key_given: key.is_some(),
            asker: key.map(asker).transpose()?,
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

/// Who asks for the copies that a key signed.
struct Asker {
    key: PublicKey,
    tracer: Tracer,
}

/// What was read so far.
struct Collected<'a> {
    original_path: &'a Path,
    original: &'a TriMesh,
    digest: GeometryDigest,
    is_key_given: bool,
    /// None until there is a key.
    asker: Option<Asker>,
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
                self.add_unreadable(path, &error);
                return Ok(());
            }
        };
        match self.ask_for(&issued) {
            Ok(()) => {
                let statement = issued.unchecked().statement();
                self.copies.push(IssuedCopy {
                    recipient: statement.recipient.clone(),
                    message: statement.message.clone(),
                    certificate: path.into(),
                });
            }
            Err(SigmarkError::AnotherKey { .. }) if self.is_signed_by_another(&issued) => {
                let known = self.copies.first().map(|copy| copy.certificate.display());
                bail!(
                    "{} and {}: two keys signed copies of this original; say whose copies are asked for with --public-key",
                    known.map(|path| path.to_string()).unwrap_or_default(),
                    path.display()
                );
            }
            Err(
                error @ (SigmarkError::AnotherKey { .. }
                | SigmarkError::AnotherOriginal { .. }
                | SigmarkError::PaperProfile),
            ) => {
                self.passed_over += 1;
                let error = self.blame(error, path);
                self.refused.get_or_insert(error);
            }
            Err(error @ SigmarkError::Certificate(_)) => {
                self.add_unreadable(path, &self.blame(error, path));
            }
            Err(error) => return Err(self.blame(error, path)),
        }
        Ok(())
    }

    fn add_unreadable(&mut self, path: &Path, error: &anyhow::Error) {
        report::failure(error);
        self.unreadable.push(path.into());
    }

    /// Asks for a copy, too. The first that is of this original and was signed brings the key, where none was given: what others wrote can lie anywhere, and first.
    fn ask_for(&mut self, issued: &Issued) -> Result<(), SigmarkError> {
        match &mut self.asker {
            Some(asker) => asker.tracer.add(issued)?,
            None => {
                let key = signer_of(issued, self.digest)?;
                let mut tracer = Tracer::new(self.original, &key)?;
                let number = tracer.add(issued)?;
                self.asker = Some(Asker { key, tracer });
                number
            }
        };
        Ok(())
    }

    /// Whether a certificate with another key could have brought the key as well as the one that did.
    fn is_signed_by_another(&self, issued: &Issued) -> bool {
        !self.is_key_given && signer_of(issued, self.digest).is_ok()
    }

    /// The error with the name of the file that it is about.
    fn blame(&self, error: SigmarkError, certificate: &Path) -> anyhow::Error {
        let (original, certificate) = (self.original_path.display(), certificate.display());
        match error {
            SigmarkError::AnotherOriginal { .. } => {
                anyhow::Error::new(error).context(format!("{original}, by {certificate}"))
            }
            SigmarkError::PaperProfile => anyhow!(
                "{certificate}: {error}, and no copy be told from another; sign copies with a key on P-256"
            ),
            error => anyhow::Error::new(error).context(certificate.to_string()),
        }
    }

    fn finished(self, named: &[PathBuf]) -> Result<Copies> {
        match (self.asker, self.refused) {
            (Some(Asker { key, tracer }), _) if !self.copies.is_empty() => Ok(Copies {
                tracer,
                copies: self.copies,
                key,
                key_file: None,
                passed_over: self.passed_over,
                unreadable: self.unreadable,
            }),
            (_, Some(refused)) => Err(refused),
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
