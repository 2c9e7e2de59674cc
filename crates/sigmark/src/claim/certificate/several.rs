//! Reading many certificates of one original quickly: those of all who bought a copy.

use std::sync::{Arc, Mutex, PoisonError};

use super::{Certificate, CertificateError, LabelsSummary, PackedLabels};
use crate::claim::statement::Statement;

/// Reads many certificates. What they have in common is unpacked once.
#[derive(Debug, Default)]
pub struct CertificateReader {
    /// The labels that were met, the latest last.
    known: Mutex<Vec<Arc<KnownLabels>>>,
}

/// So many labels are remembered: those of copies of as many originals, or of one in as many layouts.
const REMEMBERED: usize = 8;

#[derive(Debug)]
struct KnownLabels {
    labels: PackedLabels,
    vertices: usize,
    patches: usize,
    summary: LabelsSummary,
}

/// A certificate that was read, but whose signature and seal were not [checked](Self::check): good enough to ask whether a suspect carries its mark.
#[derive(Clone, Debug)]
pub struct Issued(Certificate);

impl CertificateReader {
    /// One that has read nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Reads a certificate as [`Certificate::from_json`] does, and leaves its signature and seal unchecked.
    ///
    /// # Errors
    /// When the text is no certificate, of another version, or damaged.
    pub fn read(&self, text: &str) -> Result<Issued, CertificateError> {
        let checked = |statement: &Statement| {
            statement.checked_with(|labels, vertices, patches| self.summary(labels, vertices, patches))
        };
        Certificate::unchecked(text, checked).map(Issued)
    }

    fn summary(
        &self,
        labels: &PackedLabels,
        vertices: usize,
        patches: usize,
    ) -> Result<LabelsSummary, CertificateError> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |known: &&Arc<KnownLabels>| {
            (known.vertices, known.patches) == (vertices, patches) && known.labels == *labels
        };
        let met: Vec<Arc<KnownLabels>> = known().clone();
        if let Some(known) = met.iter().rev().find(is_same) {
            return Ok(known.summary.clone());
        }
        let summary = labels.summary(vertices, patches)?;
        let mut known = known();
        if known.len() == REMEMBERED {
            known.remove(0);
        }
        known.push(Arc::new(KnownLabels {
            labels: labels.clone(),
            vertices,
            patches,
            summary: summary.clone(),
        }));
        Ok(summary)
    }
}

impl Issued {
    /// What stands in it, unproven: it has not been checked who signed it.
    pub fn unchecked(&self) -> &Certificate {
        &self.0
    }

    /// The certificate, if signature and seal are those of the key that it names.
    ///
    /// # Errors
    /// [`CertificateError::Statement`], [`CertificateError::Seal`].
    pub fn check(self) -> Result<Certificate, CertificateError> {
        self.0.check()?;
        Ok(self.0)
    }
}

impl From<Certificate> for Issued {
    fn from(certificate: Certificate) -> Self {
        Self(certificate)
    }
}
