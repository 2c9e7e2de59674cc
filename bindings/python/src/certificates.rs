//! Certificates.

use std::{path::PathBuf, sync::Arc};

use pyo3::{Borrowed, prelude::*};

use crate::{
    errors::Failure,
    keys::{PublicKey, read_text},
};

/// What a verifier needs besides the original and the public key: what was signed, by whom, and where the mark lies.
///
/// It is private: whoever has it and the original can remove the mark.
#[pyclass(frozen, module = "sigmark")]
#[derive(Clone)]
pub(crate) struct Certificate(Arc<sigmark::Certificate>);

impl Certificate {
    pub(crate) fn new(certificate: sigmark::Certificate) -> Self {
        Self(Arc::new(certificate))
    }

    pub(crate) fn inner(&self) -> &Arc<sigmark::Certificate> {
        &self.0
    }
}

#[pymethods]
impl Certificate {
    /// The certificate in a text, as `to_json` wrote it; signature and seal are checked.
    ///
    /// Raises
    /// ------
    /// CertificateError
    ///     The text is none, is of another version, or was changed.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str) -> PyResult<Self> {
        let certificate = py.detach(|| sigmark::Certificate::from_json(text));
        Ok(Self::new(certificate.map_err(Failure::from)?))
    }

    /// The certificate in a file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::from_json(py, &read_text(&path)?)
    }

    /// The certificate as JSON, which the command `sigmark` reads, too.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        Ok(py.detach(|| self.0.to_json()).map_err(Failure::from)?)
    }

    /// Writes the certificate to a file that its owner alone can read.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<()> {
        let text = self.to_json(py)?;
        let written = mesh_io::write_private_file(path, text.as_bytes(), overwrite);
        Ok(written.map_err(Failure::from)?)
    }

    /// What the signer asserts.
    #[getter]
    fn message(&self) -> &str {
        self.0.message()
    }

    /// Whom the copy is for; empty for nobody.
    #[getter]
    fn recipient(&self) -> &str {
        &self.0.statement().recipient
    }

    /// The original's file name, which helps to find it again.
    #[getter]
    fn original_name(&self) -> &str {
        self.0.original_name()
    }

    /// The key that issued it. It says nothing of whose it is.
    #[getter]
    fn public_key(&self) -> PublicKey {
        PublicKey::new(*self.0.public_key())
    }

    /// "signature" or "tag": what the shape holds.
    #[getter]
    fn payload(&self) -> &'static str {
        self.0.statement().payload.name()
    }

    /// What a time stamp covers, SHA-256 in hexadecimal.
    #[getter]
    fn digest(&self) -> String {
        self.0.digest().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other
            .cast::<Self>()
            .is_ok_and(|other| other.get().0.digest() == self.0.digest())
    }

    fn __hash__(&self) -> u64 {
        let [a, b, c, d, e, f, g, h, ..] = self.0.digest();
        u64::from_le_bytes([a, b, c, d, e, f, g, h])
    }

    fn __repr__(&self) -> String {
        let recipient = match self.recipient() {
            "" => String::new(),
            recipient => format!(", for {recipient:?}"),
        };
        format!(
            "Certificate({:?}{recipient}, by {})",
            self.message(),
            self.0.public_key().fingerprint()
        )
    }
}

/// A certificate, or the path of its file.
pub(crate) struct CertificateInput(pub(crate) Arc<sigmark::Certificate>);

impl<'py> FromPyObject<'_, 'py> for CertificateInput {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(certificate) = object.cast::<Certificate>() {
            return Ok(Self(Arc::clone(certificate.get().inner())));
        }
        let read = Certificate::read(object.py(), object.extract()?)?;
        Ok(Self(Arc::clone(read.inner())))
    }
}

/// A public key, or the path of its file.
pub(crate) struct KeyInput(pub(crate) sigmark::PublicKey);

impl<'py> FromPyObject<'_, 'py> for KeyInput {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(key) = object.cast::<PublicKey>() {
            return Ok(Self(*key.get().inner()));
        }
        Ok(Self(*PublicKey::read(object.extract()?)?.inner()))
    }
}
