//! Signing meshes.

use std::{path::PathBuf, sync::Arc};

use job::Job;
use mhb_core::LaplacianKind;
use numpy::PyArray2;
use pyo3::{exceptions::PyValueError, prelude::*};
use serde_json::Value;
use sigmark::{Embedder, Strength, payload::PayloadKind};
use sigmark_cli::figures::of_mark;

use crate::{
    assets::Asset,
    certificates::Certificate,
    errors::Failure,
    input::Input,
    keys::SigningKey,
    meshes::Mesh,
    objects::plain,
    running::{Running, run},
    spectra,
};

/// A signed mesh with its certificate. What `embed` returns.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Signed {
    signed: sigmark::Signed,
    mesh: Mesh,
    asset: Option<Asset>,
    figures: Value,
}

/// A mesh ready to be signed for any number of recipients: what does not depend on them is computed once. What `prepare` returns.
#[pyclass(frozen, module = "sigmark")]
pub(crate) struct Prepared {
    prepared: Arc<sigmark::Prepared>,
    input: Input,
    laplacian: &'static str,
}

/// How a mesh is to be signed.
struct Options {
    embedder: Embedder,
    laplacian: &'static str,
    /// Whether a stronger mark may be taken where the file's precision is coarser than the standard one.
    leaves_strength_open: bool,
}

/// Signs a mesh: writes a signature into its shape.
///
/// Parameters
/// ----------
/// mesh : Mesh, Asset, path, or an object of trimesh, open3d, meshio or pymeshlab
///     What is signed, and afterwards the original: keep it as it is, nothing can be verified without it.
/// key : SigningKey
/// message : str
///     What is asserted, such as "© 2026 Studio"; it stands in the certificate.
/// recipient : str
///     Whom this copy is for.
/// payload : {"signature", "tag"}, optional
///     What the shape holds: the whole signature, or 128 bits that stand for it, which are read where less is left. By default the signature where there is room enough.
/// strength : {"subtle", "standard", "strong"} or float, optional
///     How far the surface moves: 0.02, 0.04 or 0.08 % of the bounding box's diagonal, root mean square, less where it is thin; or any fraction of it. By default standard, and of files that are too coarse
///     for it strong.
/// patches : int, optional
///     Into how many patches the mesh is cut, about.
/// chip_rate : int, optional
///     How many chips there are to a bit, where there is room.
/// laplacian : {"cotangent", "intrinsic"}
///     As `spectrum` has it.
/// threads, progress
///     As `spectrum` has them. The same mesh, key, message and recipient give the same marked mesh on any number of threads.
///
/// Returns
/// -------
/// Signed
///
/// Raises
/// ------
/// MarkError
///     There is no room for a mark.
/// SigmarkError
///     The payload does not suit the key, or the mark is lost in the precision of the file.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> key, torus = sigmark.SigningKey.generate(), sigmark.shapes.bumpy_torus()
/// >>> signed = sigmark.embed(torus, key, message="© 2026 Studio")
/// >>> sigmark.verify(signed.mesh, signed.certificate, torus).outcome
/// 'verified'
#[pyfunction]
#[pyo3(signature = (mesh, key, *, message = "", recipient = "", payload = None, strength = None, patches = None, chip_rate = None, laplacian = "cotangent", threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn embed(
    py: Python<'_>,
    mesh: Input,
    key: &Bound<'_, SigningKey>,
    message: &str,
    recipient: &str,
    payload: Option<&str>,
    strength: Option<&Bound<'_, PyAny>>,
    patches: Option<usize>,
    chip_rate: Option<usize>,
    laplacian: &str,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Signed> {
    let options = Options::new(key, message, payload, strength, patches, chip_rate, laplacian)?;
    let recipient = recipient.to_owned();
    run(py, Running::new(threads, progress), move |job| {
        options.sign(&mesh, &recipient, job)
    })
}

/// All that signing a mesh for any recipient takes: `prepare(mesh, key).embed(recipient)` is `embed(mesh, key, recipient=recipient)`, and a copy for one more costs
/// little. Where `strength` is left open, all copies of a file have that which nobody's copy needs.
///
/// Parameters, but for `recipient`, and exceptions are those of `embed`.
///
/// Examples
/// --------
/// >>> import sigmark, sigmark.shapes
/// >>> prepared = sigmark.prepare(sigmark.shapes.bumpy_torus(), sigmark.SigningKey.generate())
/// >>> [prepared.embed(buyer).certificate.recipient for buyer in ("Anna", "Bert")]
/// ['Anna', 'Bert']
#[pyfunction]
#[pyo3(signature = (mesh, key, *, message = "", payload = None, strength = None, patches = None, chip_rate = None, laplacian = "cotangent", threads = None, progress = None))]
#[allow(clippy::too_many_arguments)] // as Python's functions have
pub(crate) fn prepare(
    py: Python<'_>,
    mesh: Input,
    key: &Bound<'_, SigningKey>,
    message: &str,
    payload: Option<&str>,
    strength: Option<&Bound<'_, PyAny>>,
    patches: Option<usize>,
    chip_rate: Option<usize>,
    laplacian: &str,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Prepared> {
    let options = Options::new(key, message, payload, strength, patches, chip_rate, laplacian)?;
    run(py, Running::new(threads, progress), move |job| {
        Ok(Prepared {
            prepared: Arc::new(options.prepare(&mesh, job)?),
            input: mesh,
            laplacian: options.laplacian,
        })
    })
}

impl Options {
    fn new(
        key: &Bound<'_, SigningKey>,
        message: &str,
        payload: Option<&str>,
        strength: Option<&Bound<'_, PyAny>>,
        patches: Option<usize>,
        chip_rate: Option<usize>,
        laplacian: &str,
    ) -> PyResult<Self> {
        let kind = spectra::kind(laplacian)?;
        let mut embedder = Embedder::new(key.get().inner())
            .message(message)
            .payload(payload.map(payload_kind).transpose()?)
            .laplacian(kind);
        if let Some(strength) = strength {
            embedder = embedder.strength(strength_of(strength)?);
        }
        if let Some(patches) = patches {
            embedder = embedder.patches(patches);
        }
        if let Some(rate) = chip_rate {
            embedder = embedder.chip_rate(rate);
        }
        Ok(Self {
            embedder,
            laplacian: match kind {
                LaplacianKind::Intrinsic => "intrinsic",
                _ => "cotangent",
            },
            leaves_strength_open: strength.is_none(),
        })
    }

    fn embedder_of(&self, input: &Input) -> Embedder {
        match input {
            Input::Asset(asset) => {
                let named = self.embedder.clone().original_name(asset.name());
                named.rig(input.rig().as_ref())
            }
            Input::Mesh(_) => self.embedder.clone(),
        }
    }

    fn sign(&self, input: &Input, recipient: &str, job: &Job) -> Result<Signed, Failure> {
        let embedder = self.embedder_of(input);
        let original = Arc::new(embedder.cut(&input.surface(), job)?);
        let signed = |embedder: &Embedder| {
            let prepared = embedder.prepare_in(&original)?;
            Signed::of(&prepared, input, recipient, self.laplacian, job)
        };
        match signed(&embedder) {
            Err(Failure::Precision(_)) if self.leaves_strength_open => {
                signed(&embedder.strength(Strength::STRONG))
            }
            other => other,
        }
    }

    /// What all copies have in common may not depend on whom they are for: nobody's copy says whether the file's precision takes a stronger mark.
    fn prepare(&self, input: &Input, job: &Job) -> Result<sigmark::Prepared, Failure> {
        let embedder = self.embedder_of(input);
        let original = Arc::new(embedder.cut(&input.surface(), job)?);
        let prepared = embedder.prepare_in(&original)?;
        prepared.keep_bases(job)?;
        if !self.leaves_strength_open || matches!(input, Input::Mesh(_)) {
            return Ok(prepared);
        }
        match Signed::of(&prepared, input, "", self.laplacian, &job.quiet()) {
            Ok(_) => Ok(prepared),
            Err(Failure::Precision(_)) => {
                let stronger = embedder.strength(Strength::STRONG).prepare_in(&original)?;
                stronger.keep_bases(job)?;
                Ok(stronger)
            }
            Err(error) => Err(error),
        }
    }
}

impl Signed {
    fn of(
        prepared: &sigmark::Prepared,
        input: &Input,
        recipient: &str,
        laplacian: &str,
        job: &Job,
    ) -> Result<Self, Failure> {
        let mut signed = prepared.embed_for(recipient, job)?;
        let (mesh, asset) = match input {
            Input::Mesh(mesh) => (mesh.moved(Arc::new(signed.mesh().clone())), None),
            Input::Asset(asset) => {
                let write = |positions: &[[f64; 3]]| -> Result<_, Failure> {
                    Ok(asset.inner().with_positions(positions)?)
                };
                let marked = signed.hold(write, |marked| marked.mesh().positions())?;
                let read = signed.read_back(marked.mesh().positions(), job)?;
                if !read.is_sound() {
                    return Err(Failure::Precision(read.extraction_rate));
                }
                (Mesh::plain(marked.mesh().clone()), Some(Asset::new(marked)))
            }
        };
        Ok(Self {
            figures: figures(prepared, signed.prediction(), laplacian),
            signed,
            mesh,
            asset,
        })
    }
}

/// What `sigmark embed --json` prints of a mark.
fn figures(prepared: &sigmark::Prepared, prediction: &sigmark::Prediction, laplacian: &str) -> Value {
    Value::Object(of_mark(prepared, prediction, laplacian))
}

#[pymethods]
impl Signed {
    /// The signed mesh, with the faces of the one that was given.
    #[getter]
    fn mesh(&self) -> Mesh {
        self.mesh.clone()
    }

    /// The signed positions, one a vertex that was given, (n, 3), float64: a read-only view.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(Bound::new(py, self.mesh.clone())?
            .getattr("vertices")?
            .cast_into()?)
    }

    /// The signed file, where a file was given: of it only positions changed.
    #[getter]
    fn asset(&self) -> Option<Asset> {
        self.asset.clone()
    }

    /// What a verifier needs besides the original and the public key.
    #[getter]
    fn certificate(&self) -> Certificate {
        Certificate::new(self.signed.certificate().clone())
    }

    /// T₀ that is predicted under noise of 0.1 % of the bounding box's edges; `margin_read` of `to_dict` is what reading takes.
    #[getter]
    fn margin_predicted(&self) -> f64 {
        self.figures["margin_predicted"].as_f64().unwrap_or(f64::NAN)
    }

    /// Writes the signed file, and the certificate beside it, which its owner alone can read.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    /// certificate : str or os.PathLike, optional
    ///     Where the certificate goes; by default `path` with ".cert.json" behind it.
    /// overwrite : bool, default False
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Arrays were signed, and no file: `vertices` and `certificate` are what is to be kept.
    #[pyo3(signature = (path, *, certificate = None, overwrite = false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        certificate: Option<PathBuf>,
        overwrite: bool,
    ) -> PyResult<()> {
        let Some(asset) = &self.asset else {
            return Err(PyValueError::new_err(
                "arrays were signed, not a file: write `vertices` with the library that you read them with, and the certificate with `certificate.save`",
            ));
        };
        let certificate = certificate.unwrap_or_else(|| {
            let mut name = path.clone().into_os_string();
            name.push(".cert.json");
            name.into()
        });
        let saved = py.detach(|| {
            let text = self.signed.certificate().to_json()?;
            asset.inner().check_name(&path)?;
            mesh_io::write_private_file(&certificate, text.as_bytes(), overwrite)?;
            asset.inner().save(&path, overwrite)?;
            Ok::<(), Failure>(())
        });
        Ok(saved?)
    }

    /// What `sigmark embed --json` prints of the mark, but for the names of files and the time.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(py, &self.figures)
    }

    fn __repr__(&self) -> String {
        let figures = &self.figures;
        format!(
            "Signed({} of {} bits in {} chips of {} patches, margin {:.1}, read from {:.1} on)",
            figures["payload"].as_str().unwrap_or_default(),
            figures["bits"],
            figures["chips"],
            figures["patches"],
            self.margin_predicted(),
            figures["margin_read"].as_f64().unwrap_or(f64::NAN)
        )
    }
}

#[pymethods]
impl Prepared {
    /// The copy for a recipient; "" is nobody. May be called from several threads at once.
    #[pyo3(signature = (recipient = "", *, threads = None, progress = None))]
    fn embed(
        &self,
        py: Python<'_>,
        recipient: &str,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Signed> {
        let (prepared, input) = (Arc::clone(&self.prepared), self.input.clone());
        let (recipient, laplacian) = (recipient.to_owned(), self.laplacian);
        run(py, Running::new(threads, progress), move |job| {
            Signed::of(&prepared, &input, &recipient, laplacian, job)
        })
    }

    /// Bytes of the harmonics, the mesh and its file that are kept, about; more than a gigabyte of harmonics is not.
    #[getter]
    fn nbytes(&self) -> usize {
        let original = self.prepared.original();
        let mesh = original.mesh();
        let mesh = 24 * mesh.vertex_count() + 12 * mesh.triangle_count();
        original.basis_bytes().min(1 << 30) + mesh + self.input.file_bytes()
    }

    /// What `sigmark embed --json` prints of the marks.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        plain(
            py,
            &figures(&self.prepared, &self.prepared.prediction(), self.laplacian),
        )
    }

    fn __repr__(&self) -> String {
        let prediction = self.prepared.prediction();
        format!(
            "Prepared({} of {} bits in {} chips)",
            prediction.payload.name(),
            prediction.payload_bits,
            prediction.chips
        )
    }
}

fn payload_kind(name: &str) -> PyResult<PayloadKind> {
    match name {
        "signature" => Ok(PayloadKind::Signature),
        "tag" => Ok(PayloadKind::Tag),
        _ => Err(PyValueError::new_err(format!(
            "payload is {name:?}; it is \"signature\" or \"tag\""
        ))),
    }
}

fn strength_of(object: &Bound<'_, PyAny>) -> PyResult<Strength> {
    if let Ok(fraction) = object.extract::<f64>() {
        return Ok(Strength::Distortion(fraction));
    }
    match object.extract::<&str>() {
        Ok("subtle") => Ok(Strength::SUBTLE),
        Ok("standard") => Ok(Strength::default()),
        Ok("strong") => Ok(Strength::STRONG),
        _ => Err(PyValueError::new_err(format!(
            "strength is {object}; it is \"subtle\", \"standard\", \"strong\" or a fraction of the diagonal, such as 4e-4"
        ))),
    }
}
