//! Whose copy was it.

use std::sync::Arc;

use pyo3::{exceptions::PyValueError, prelude::*};
use serde_json::{Value, json};
use sigmark_cli::figures;

use crate::{
    certificates::{CertificateInput, KeyInput},
    errors::Failure,
    input::Input,
    objects::{counted, plain, shown},
    running::{Running, run},
    verifying::mismatch,
};

/// Names whose copies suspects were made of, among those for whom certificates were issued; what it computes of the original is kept for the next suspect.
///
/// Parameters
/// ----------
/// original : Mesh, Asset, path, or an object of another library
///     The very mesh that was signed.
/// certificates : sequence of Certificate, or of paths of their files
///     One of each copy; those of another original or key are refused.
/// public_key : PublicKey, or the path of its file; optional
///     The signer's, by default the first certificate's.
/// p_bound : float, default 1e-5
///     The largest probability that anybody at all is named wrongly by which somebody is named.
///
/// Raises
/// ------
/// SigmarkError
///     A certificate is of another original or key.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Tracer {
    tracer: Arc<sigmark::claim::Tracer>,
    copies: Arc<[Copy]>,
}

/// For whom a copy was made.
struct Copy {
    recipient: String,
    message: String,
}

/// Whose copy a suspect is, or that nobody was found. What `trace` returns. True where somebody is named.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Trace {
    trace: sigmark::claim::Trace,
    copies: Arc<[Copy]>,
}

/// One whose copy is in a suspect.
#[pyclass(frozen, get_all, module = "sigmark")]
pub(crate) struct Accused {
    /// Which of the certificates, from 0.
    candidate: usize,
    /// Whom the copy was for.
    recipient: String,
    /// What its certificate asserts.
    message: String,
    /// The probability that anybody at all who is innocent would be named before or with him, an upper bound.
    p_value: f64,
    /// T₀ of his mark, beside those that were found before.
    margin: f64,
}

/// Asks of whose copies a suspect was made. For several suspects make a `Tracer`.
///
/// Parameters
/// ----------
/// suspect : Mesh, Asset, path, or an object of trimesh, open3d, meshio or pymeshlab
///     Cropped, decimated, or mixed of several copies.
/// original, certificates, public_key, p_bound
///     As `Tracer` has them.
/// threads, progress
///     As `spectrum` has them.
///
/// Returns
/// -------
/// Trace
///
/// Raises
/// ------
/// SigmarkError
///     A certificate is of another original or key.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> torus = sigmark.shapes.bumpy_torus()
/// >>> prepared = sigmark.prepare(torus, sigmark.SigningKey.generate())
/// >>> copies = [prepared.embed(buyer) for buyer in ("Anna", "Bert", "Carl")]
/// >>> trace = sigmark.trace(copies[1].mesh, torus, [copy.certificate for copy in copies])
/// >>> [accused.recipient for accused in trace.accused]
/// ['Bert']
#[pyfunction]
#[pyo3(signature = (suspect, original, certificates, public_key = None, *, p_bound = 1e-5, threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn trace(
    py: Python<'_>,
    suspect: Input,
    original: Input,
    certificates: Vec<CertificateInput>,
    public_key: Option<KeyInput>,
    p_bound: f64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Trace> {
    Tracer::new(py, original, certificates, public_key, p_bound)?.trace(py, suspect, threads, progress)
}

impl Tracer {
    fn of(
        original: &Input,
        certificates: &[CertificateInput],
        key: &sigmark::PublicKey,
        p_bound: f64,
    ) -> Result<Self, Failure> {
        let mut tracer = sigmark::claim::Tracer::new(&original.surface(), key)?
            .with_rig(original.rig())
            .p_bound(p_bound);
        let mut copies = Vec::with_capacity(certificates.len());
        for CertificateInput(certificate) in certificates {
            tracer.add(&sigmark::Certificate::clone(certificate).into())?;
            copies.push(Copy {
                recipient: certificate.statement().recipient.clone(),
                message: certificate.message().into(),
            });
        }
        Ok(Self {
            tracer: Arc::new(tracer),
            copies: copies.into(),
        })
    }
}

#[pymethods]
impl Tracer {
    #[new]
    #[pyo3(signature = (original, certificates, public_key = None, *, p_bound = 1e-5))]
    fn new(
        py: Python<'_>,
        original: Input,
        certificates: Vec<CertificateInput>,
        public_key: Option<KeyInput>,
        p_bound: f64,
    ) -> PyResult<Self> {
        let Some(CertificateInput(first)) = certificates.first() else {
            return Err(PyValueError::new_err(
                "there are no certificates: nobody could be named",
            ));
        };
        let key = public_key.map_or(*first.public_key(), |KeyInput(key)| key);
        run(py, Running::new(Some(1), None), move |_| {
            Self::of(&original, &certificates, &key, p_bound)
        })
    }

    /// Asks of whose copies a suspect was made; may be called from several threads at once.
    #[pyo3(signature = (suspect, *, threads = None, progress = None))]
    fn trace(
        &self,
        py: Python<'_>,
        suspect: Input,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Trace> {
        let (tracer, copies) = (Arc::clone(&self.tracer), Arc::clone(&self.copies));
        run(py, Running::new(threads, progress), move |job| {
            let trace = tracer.trace(suspect.shown()?, job)?;
            Ok(Trace { trace, copies })
        })
    }

    fn __len__(&self) -> usize {
        self.copies.len()
    }

    fn __repr__(&self) -> String {
        format!("Tracer({})", counted(self.copies.len(), "copy", "copies"))
    }
}

impl Trace {
    fn named(&self) -> Vec<Accused> {
        let named = self.trace.accused.iter().filter_map(|accused| {
            let copy = self.copies.get(accused.candidate)?;
            Some(Accused {
                candidate: accused.candidate,
                recipient: copy.recipient.clone(),
                message: copy.message.clone(),
                p_value: accused.p_value,
                margin: accused.margin,
            })
        });
        named.collect()
    }

    fn described(&self) -> Value {
        let trace = &self.trace;
        let accused = self.named().into_iter().map(|accused| {
            json!({
                "recipient": accused.recipient,
                "message": accused.message,
                "p_value": accused.p_value,
                "margin": accused.margin,
            })
        });
        let mut object = figures::of_trace(trace);
        object.insert("accused".into(), accused.collect());
        object.insert("unsigned".into(), json!(trace.unsigned));
        object.insert("altered".into(), json!(trace.altered));
        object.insert("mismatch".into(), trace.mismatch.map(mismatch).into());
        Value::Object(object)
    }
}

#[pymethods]
impl Trace {
    /// Those whose copies are in the suspect, the surest first.
    #[getter]
    fn accused(&self) -> Vec<Accused> {
        self.named()
    }

    /// How many copies were asked for.
    #[getter]
    fn candidates(&self) -> usize {
        self.trace.candidates
    }

    /// Share of the suspect's surface that lies on the original, from 0 to 1.
    #[getter]
    fn overlap(&self) -> f64 {
        self.trace.overlap
    }

    /// Share of the original's surface that lies on the suspect, from 0 to 1.
    #[getter]
    fn coverage(&self) -> f64 {
        self.trace.coverage
    }

    /// What `sigmark trace --json` prints, but for the names of files, the remark and the time; and `mismatch`, why the suspect is another shape.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.described())
    }

    fn __bool__(&self) -> bool {
        !self.trace.accused.is_empty()
    }

    fn __repr__(&self) -> String {
        let named: Vec<String> = self.named().iter().map(Accused::__repr__).collect();
        let candidates = counted(self.trace.candidates, "copy", "copies");
        match named.is_empty() {
            true => format!("Trace(nobody of {candidates})"),
            false => format!("Trace({} of {candidates})", named.join(", ")),
        }
    }
}

#[pymethods]
impl Accused {
    fn __repr__(&self) -> String {
        let Self {
            recipient,
            p_value,
            margin,
            ..
        } = self;
        let p_value = shown(*p_value);
        format!("Accused({recipient:?}, p <= {p_value:.1e}, margin {margin:.1})")
    }
}
