//! Judging suspects.

use std::sync::Arc;

use numpy::PyArray2;
use pyo3::prelude::*;
use serde_json::{Value, json};
use sigmark::{Mismatch, SigmarkError};
use sigmark_cli::figures;

use crate::{
    arrays,
    certificates::{CertificateInput, KeyInput},
    errors::Failure,
    input::Input,
    objects::{plain, shown},
    running::{Running, run},
};

/// The answer to "is this our model?". What `verify` returns. True where the mark was found.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Verdict {
    verdict: sigmark::Verdict,
    certificate: Arc<sigmark::Certificate>,
    own_key: bool,
}

/// Judges suspects against one original and its certificate; what it computes of the original is kept for the next suspect.
///
/// Parameters
/// ----------
/// certificate : Certificate, or the path of its file
/// original : Mesh, Asset, path, or an object of another library
///     The very mesh that was signed. Another file of the same geometry, in another order or unit, is recognised: then the verdict informs the owner, and is no evidence.
/// public_key : PublicKey, or the path of its file; optional
///     The signer's. By default it is taken from the certificate, and then the verdict does not say whose the model is.
/// p_bound : float, default 1e-6
///     The largest p-value that counts as detected.
/// enough : float, optional
///     The p-value at which nothing more of a suspect is looked at, though its signature is not read: the answer is then "detected". By default reading goes on until the signature is read, or all was looked at.
/// paper_profile : bool, default False
///     Whether marks of the paper's profile are judged, too, which do not bind the original.
///
/// Raises
/// ------
/// SigmarkError
///     Certificate, original and key do not belong together.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Verifier {
    verifier: Arc<sigmark::Verifier>,
    certificate: Arc<sigmark::Certificate>,
    own_key: bool,
}

/// Asks whether a suspect carries the mark of a certificate. For several suspects make a `Verifier`.
///
/// Parameters
/// ----------
/// suspect : Mesh, Asset, path, or an object of trimesh, open3d, meshio or pymeshlab
///     In any pose, unit and order of vertices; cropped, smoothed, decimated, re-meshed.
/// certificate, original, public_key, p_bound, enough, paper_profile
///     As `Verifier` has them.
/// threads, progress
///     As `spectrum` has them.
///
/// Returns
/// -------
/// Verdict
///
/// Raises
/// ------
/// SigmarkError
///     Certificate, original and key do not belong together.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> key, torus = sigmark.SigningKey.generate(), sigmark.shapes.bumpy_torus()
/// >>> signed = sigmark.embed(torus, key)
/// >>> moved = sigmark.Mesh(3 * signed.vertices + [1, 2, 3], torus.faces)
/// >>> verdict = sigmark.verify(moved, signed.certificate, torus, key.public_key)
/// >>> bool(verdict), verdict.outcome, verdict.bit_errors
/// (True, 'verified', 0)
/// >>> bool(sigmark.verify(torus, signed.certificate, torus))
/// False
#[pyfunction]
#[pyo3(signature = (suspect, certificate, original, public_key = None, *, p_bound = 1e-6, enough = None, paper_profile = false, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn verify(
    py: Python<'_>,
    suspect: Input,
    certificate: CertificateInput,
    original: Input,
    public_key: Option<KeyInput>,
    p_bound: f64,
    enough: Option<f64>,
    paper_profile: bool,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Verdict> {
    run(py, Running::new(threads, progress), move |job| {
        let verifier = Verifier::of(certificate, &original, public_key, p_bound, enough, paper_profile)?;
        verifier.judge(&suspect, job)
    })
}

impl Verifier {
    fn of(
        CertificateInput(certificate): CertificateInput,
        original: &Input,
        public_key: Option<KeyInput>,
        p_bound: f64,
        enough: Option<f64>,
        paper_profile: bool,
    ) -> Result<Self, Failure> {
        let own_key = public_key.is_none();
        let key = public_key.map_or(*certificate.public_key(), |KeyInput(key)| key);
        let surface = original.surface();
        let verifier = match sigmark::Verifier::new(&surface, &certificate, &key) {
            Err(refused @ SigmarkError::AnotherOriginal { .. }) => {
                // What is said of a mesh of another geometry is about the file that was asked for.
                match sigmark::Verifier::for_owner(&surface, &certificate, &key) {
                    Err(SigmarkError::AnotherOriginal { .. }) => Err(refused),
                    other => other,
                }
            }
            other => other,
        }?;
        Ok(Self {
            verifier: Arc::new(
                verifier
                    .with_rig(original.rig())
                    .p_bound(p_bound)
                    .enough(enough)
                    .paper_profile(paper_profile),
            ),
            certificate,
            own_key,
        })
    }

    fn judge(&self, suspect: &Input, job: &job::Job) -> Result<Verdict, Failure> {
        Ok(Verdict {
            verdict: self.verifier.verify(suspect.shown()?, job)?,
            certificate: Arc::clone(&self.certificate),
            own_key: self.own_key,
        })
    }
}

#[pymethods]
impl Verifier {
    #[new]
    #[pyo3(signature = (certificate, original, public_key = None, *, p_bound = 1e-6, enough = None, paper_profile = false))]
    fn new(
        py: Python<'_>,
        certificate: CertificateInput,
        original: Input,
        public_key: Option<KeyInput>,
        p_bound: f64,
        enough: Option<f64>,
        paper_profile: bool,
    ) -> PyResult<Self> {
        run(py, Running::new(Some(1), None), move |_| {
            Self::of(certificate, &original, public_key, p_bound, enough, paper_profile)
        })
    }

    /// Judges a suspect; may be called from several threads at once.
    #[pyo3(signature = (suspect, *, threads = None, progress = None))]
    fn verify(
        &self,
        py: Python<'_>,
        suspect: Input,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Verdict> {
        let own = Self {
            verifier: Arc::clone(&self.verifier),
            certificate: Arc::clone(&self.certificate),
            own_key: self.own_key,
        };
        run(py, Running::new(threads, progress), move |job| {
            own.judge(&suspect, job)
        })
    }

    fn __repr__(&self) -> String {
        format!("Verifier({:?})", self.certificate.message())
    }
}

#[pymethods]
impl Verdict {
    /// "verified": the payload was read back, every bit of it, and checks; "detected": too little is left to read it, but chance would do this with probability `p_value` at
    /// most; or "not_found".
    #[getter]
    fn outcome(&self) -> &'static str {
        self.verdict.outcome.name()
    }

    /// Whether it is evidence even if the claim is a stranger's, who may have chosen it after he saw the suspect: p ≤ 2⁻¹²⁰.
    #[getter]
    fn is_evidence(&self) -> bool {
        self.verdict.is_evidence()
    }

    /// The probability of such agreement without the mark, an upper bound.
    #[getter]
    fn p_value(&self) -> f64 {
        self.verdict.p_value
    }

    /// The probability that one of 2⁸⁰ claims that a stranger tried would have come as far, an upper bound.
    #[getter]
    fn p_dispute(&self) -> f64 {
        self.verdict.p_dispute()
    }

    /// Of the bits of which something was read, the share that is right, from 0 to 1; None if the suspect does not fit the original.
    #[getter]
    fn extraction_rate(&self) -> Option<f64> {
        self.verdict.extraction_rate
    }

    /// T₀, the signal-to-noise ratio of the whole mark; None if the suspect does not fit the original.
    #[getter]
    fn margin(&self) -> Option<f64> {
        self.verdict.margin
    }

    /// Of how many bits of the mark something was read.
    #[getter]
    fn bits(&self) -> usize {
        self.verdict.bits
    }

    /// How many of those are wrong, before the code mends any.
    #[getter]
    fn bit_errors(&self) -> Option<usize> {
        self.verdict.bit_errors
    }

    /// Share of the suspect's surface that lies on the original, from 0 to 1.
    #[getter]
    fn overlap(&self) -> f64 {
        self.verdict.overlap
    }

    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    #[getter]
    fn coverage(&self) -> f64 {
        self.verdict.coverage
    }

    /// Takes the suspect to the original, (4, 4), float64; None if it does not fit, or was bent or posed: then no one transform does.
    #[getter]
    fn transform<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let matrix = self
            .verdict
            .transform
            .map(|transform| transform.to_matrix().to_vec());
        matrix.map(|rows| arrays::owned_rows(py, rows)).transpose()
    }

    /// What the certificate asserts.
    #[getter]
    fn message(&self) -> &str {
        self.certificate.message()
    }

    /// Whether the key was taken from the certificate, and does not say whose it is.
    #[getter]
    fn own_key(&self) -> bool {
        self.own_key
    }

    /// What `sigmark verify --json` prints, but for the names of files and parts, time stamps, the remark and the time; and `mismatch`, why the suspect is another shape.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.described())
    }

    fn __bool__(&self) -> bool {
        self.verdict.outcome.is_found()
    }

    fn __repr__(&self) -> String {
        let errors = match (self.verdict.bit_errors, self.verdict.margin) {
            (Some(errors), Some(margin)) => {
                format!(
                    ", {errors} of {} bits wrong, margin {margin:.1}",
                    self.verdict.bits
                )
            }
            _ => String::new(),
        };
        format!(
            "Verdict({}, p <= {:.1e}{errors})",
            self.outcome(),
            shown(self.verdict.p_value)
        )
    }
}

impl Verdict {
    fn described(&self) -> Value {
        let mut object = figures::of_verdict(&self.verdict, self.certificate.statement(), self.own_key);
        object.insert("mismatch".into(), self.verdict.mismatch.map(mismatch).into());
        Value::Object(object)
    }
}

/// Why a suspect is another shape.
pub(crate) fn mismatch(mismatch: Mismatch) -> Value {
    match mismatch {
        Mismatch::Surface { overlap, least } => json!({ "overlap": overlap, "least": least }),
        Mismatch::Shape { in_place, least } => json!({ "in_place": in_place, "least": least }),
        _ => json!({}),
    }
}
