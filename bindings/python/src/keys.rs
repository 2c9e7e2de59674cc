//! Key pairs.

use std::{
    fs,
    path::{Path, PathBuf},
};

use pyo3::{exceptions::PyValueError, prelude::*};
use rand_core::UnwrapErr;
use sigmark::{Curve, KeyError};
use zeroize::Zeroizing;

use crate::errors::Failure;

/// A private key, which signs. ECDSA on P-256; as a file PKCS#8 PEM, which OpenSSL reads and writes.
///
/// Keep it secret and keep a copy: whoever has it can sign in your name, and without it nothing more can be signed. Its `repr` shows no secret.
///
/// Examples
/// --------
/// >>> import sigmark
/// >>> key = sigmark.SigningKey.generate()
/// >>> sigmark.SigningKey.from_pem(key.to_pem()).public_key == key.public_key
/// True
#[pyclass(frozen, module = "sigmark")]
#[derive(Clone)]
pub(crate) struct SigningKey(sigmark::SigningKey);

/// A public key, which verifies. Give it to whoever is to verify.
#[pyclass(frozen, module = "sigmark", eq, hash)]
#[derive(Clone, PartialEq)]
pub(crate) struct PublicKey(sigmark::PublicKey);

impl std::hash::Hash for PublicKey {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.0.fingerprint().hash(state);
    }
}

impl SigningKey {
    pub(crate) fn inner(&self) -> &sigmark::SigningKey {
        &self.0
    }
}

impl PublicKey {
    pub(crate) fn new(key: sigmark::PublicKey) -> Self {
        Self(key)
    }

    pub(crate) fn inner(&self) -> &sigmark::PublicKey {
        &self.0
    }
}

#[pymethods]
impl SigningKey {
    /// A new key, from the operating system's random numbers.
    ///
    /// Parameters
    /// ----------
    /// curve : {"P-256", "B-163"}
    ///     B-163 is the paper's, for reproduction only.
    #[staticmethod]
    #[pyo3(signature = (curve = "P-256"))]
    fn generate(curve: &str) -> PyResult<Self> {
        let curve = [Curve::P256, Curve::B163]
            .into_iter()
            .find(|known| known.name() == curve);
        let curve = curve.ok_or_else(|| PyValueError::new_err("curve is \"P-256\" or \"B-163\""))?;
        let mut rng = UnwrapErr(getrandom::SysRng);
        Ok(Self(sigmark::SigningKey::generate(curve, &mut rng)))
    }

    /// The key in a text.
    ///
    /// Parameters
    /// ----------
    /// text : str
    ///     PKCS#8 PEM.
    /// passphrase : str, optional
    ///     What the key is locked by, if it is.
    ///
    /// Raises
    /// ------
    /// KeysError
    ///     The text holds no key that is read here, or the passphrase is wrong.
    #[staticmethod]
    #[pyo3(signature = (text, passphrase = None))]
    fn from_pem(py: Python<'_>, text: &str, passphrase: Option<&str>) -> PyResult<Self> {
        let key = py.detach(|| match passphrase {
            Some(passphrase) => sigmark::SigningKey::from_encrypted_pem(text, passphrase),
            None => sigmark::SigningKey::from_pem(text),
        });
        Ok(Self(key.map_err(Failure::from)?))
    }

    /// The key in a file; as `from_pem`.
    #[staticmethod]
    #[pyo3(signature = (path, passphrase = None))]
    fn read(py: Python<'_>, path: PathBuf, passphrase: Option<&str>) -> PyResult<Self> {
        Self::from_pem(py, &Zeroizing::new(read_text(&path)?), passphrase)
    }

    /// The key as PKCS#8 PEM, locked by a passphrase if one is given. Python keeps the text in memory as long as it likes; `save` leaves none there.
    #[pyo3(signature = (passphrase = None))]
    fn to_pem(&self, py: Python<'_>, passphrase: Option<&str>) -> PyResult<String> {
        let text = py.detach(|| self.text(passphrase)).map_err(Failure::from)?;
        Ok((*text).clone())
    }

    /// Writes the key to a file that its owner alone can read.
    #[pyo3(signature = (path, passphrase = None, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, passphrase: Option<&str>, overwrite: bool) -> PyResult<()> {
        let text = py.detach(|| self.text(passphrase)).map_err(Failure::from)?;
        let written = mesh_io::write_private_file(path, text.as_bytes(), overwrite);
        Ok(written.map_err(Failure::from)?)
    }

    /// The public key that belongs to it.
    #[getter]
    fn public_key(&self) -> PublicKey {
        PublicKey(self.0.public_key())
    }

    /// "P-256" or "B-163".
    #[getter]
    fn curve(&self) -> &'static str {
        self.0.curve().name()
    }

    fn __repr__(&self) -> String {
        format!(
            "SigningKey({}, public key {})",
            self.curve(),
            self.0.public_key().fingerprint()
        )
    }
}

impl SigningKey {
    fn text(&self, passphrase: Option<&str>) -> Result<Zeroizing<String>, KeyError> {
        match passphrase {
            Some(passphrase) => {
                let mut rng = UnwrapErr(getrandom::SysRng);
                self.0.to_encrypted_pem(passphrase, &mut rng)
            }
            None => Ok(self.0.to_pem()),
        }
    }
}

#[pymethods]
impl PublicKey {
    /// The key in a text, SubjectPublicKeyInfo as PEM.
    #[staticmethod]
    fn from_pem(text: &str) -> PyResult<Self> {
        Ok(Self(sigmark::PublicKey::from_pem(text).map_err(Failure::from)?))
    }

    /// The key in a file; as `from_pem`.
    #[staticmethod]
    pub(crate) fn read(path: PathBuf) -> PyResult<Self> {
        Self::from_pem(&read_text(&path)?)
    }

    /// The key as PEM.
    fn to_pem(&self) -> String {
        self.0.to_pem()
    }

    /// Writes the key to a file.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, path: PathBuf, overwrite: bool) -> PyResult<()> {
        let written = mesh_io::write_file(path, self.0.to_pem().as_bytes(), overwrite);
        Ok(written.map_err(Failure::from)?)
    }

    /// What people compare: a digest in hexadecimal.
    #[getter]
    fn fingerprint(&self) -> String {
        self.0.fingerprint()
    }

    /// "P-256" or "B-163".
    #[getter]
    fn curve(&self) -> &'static str {
        self.0.curve().name()
    }

    fn __repr__(&self) -> String {
        format!("PublicKey({}, {})", self.curve(), self.fingerprint())
    }
}

/// Keys and certificates have far fewer bytes.
const LARGEST: u64 = 64 << 20;

/// A text file; an exception names it.
pub(crate) fn read_text(path: &Path) -> PyResult<String> {
    let named =
        |error: std::io::Error| std::io::Error::new(error.kind(), format!("{}: {error}", path.display()));
    let size = fs::metadata(path).map_err(named)?.len();
    if size > LARGEST {
        let megabytes = size >> 20;
        return Err(PyValueError::new_err(format!(
            "{}: has {megabytes} MiB, far more than a key or a certificate",
            path.display()
        )));
    }
    Ok(fs::read_to_string(path).map_err(named)?)
}
