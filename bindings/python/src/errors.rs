//! One exception class an error enum; which variant it was, its attribute `variant` says.

use std::fmt::{Debug, Display};

use job::JobError;
use mesh::MeshError;
use mesh_io::AssetError;
use mhb_core::SpectrumError;
use partition::PartitionError;
use pyo3::prelude::*;
use quality::QualityError;
use registration::{Difference, RegistrationError};
use sigmark::{CertificateError, KeyError, SigmarkError, SignatureError, mark::MarkError};

/// Why something could not be done, by any of the libraries.
#[derive(Debug)]
pub(crate) enum Failure {
    Mesh(MeshError),
    Asset(AssetError),
    Spectrum(SpectrumError),
    Registration(RegistrationError),
    /// Two meshes that need the same triangles have others.
    Difference(Difference),
    Quality(QualityError),
    Partition(PartitionError),
    Key(KeyError),
    Certificate(CertificateError),
    Signature(SignatureError),
    Mark(MarkError),
    Sigmark(SigmarkError),
    Job(JobError),
    /// A mark is lost in the precision of its file; of the bits, this share is left.
    Precision(f64),
    /// Work ended without a result.
    Lost,
}

impl Failure {
    /// The class in `sigmark._errors`, what it says, and the variant.
    fn described(&self) -> (&'static str, String, String) {
        match self {
            Self::Mesh(error) => described("MeshError", error, error),
            Self::Asset(error) => described("AssetError", error, &error.problem),
            Self::Spectrum(error) => described("SpectrumError", error, error),
            Self::Registration(error) => described("RegistrationError", error, error),
            Self::Difference(error) => described("RegistrationError", error, error),
            Self::Quality(error) => described("QualityError", error, error),
            Self::Partition(error) => described("PartitionError", error, error),
            Self::Key(error) => described("KeysError", error, error),
            Self::Certificate(error) => described("CertificateError", error, error),
            Self::Signature(error) => described("SignatureError", error, error),
            Self::Mark(error) => described("MarkError", error, error),
            Self::Sigmark(error) => described("SigmarkError", error, error),
            Self::Job(error) => described("JobError", error, error),
            Self::Precision(left) => {
                let left = 100.0 * left;
                let message = format!(
                    "only {left:.1} % of the bits survive the precision of this file; mark more strongly with `strength`, or use a file with more digits"
                );
                ("SigmarkError", message, "Precision".into())
            }
            Self::Lost => (
                "JobError",
                "the work ended without a result".into(),
                "Lost".into(),
            ),
        }
    }
}

/// The variant is what a derived `Debug` begins with.
fn described(
    class: &'static str,
    error: &impl Display,
    variant: &impl Debug,
) -> (&'static str, String, String) {
    let variant = format!("{variant:?}");
    let end = variant.find(|c: char| !c.is_alphanumeric());
    (
        class,
        error.to_string(),
        variant[..end.unwrap_or(variant.len())].into(),
    )
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let (class, message, variant) = failure.described();
        Python::attach(|py| {
            let exception = py.import("sigmark._errors").and_then(|errors| {
                let class = errors.getattr(class)?;
                class.call1((message, variant))
            });
            exception.map_or_else(|error| error, Self::from_value)
        })
    }
}

/// Enums without variants of other enums.
macro_rules! plain {
    ($($error:ident => $variant:ident),*) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

plain!(MeshError => Mesh, AssetError => Asset, KeyError => Key, CertificateError => Certificate, SignatureError => Signature, JobError => Job);

/// Enums of which one variant is that the job could not be done.
macro_rules! with_job {
    ($($error:ident => $variant:ident),*) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                match error {
                    $error::Job(error) => error.into(),
                    error => Self::$variant(error),
                }
            }
        })*
    };
}

with_job!(SpectrumError => Spectrum, RegistrationError => Registration, Difference => Difference, PartitionError => Partition, QualityError => Quality);

impl From<MarkError> for Failure {
    fn from(error: MarkError) -> Self {
        match error {
            MarkError::Job(error) => error.into(),
            MarkError::Mesh(error) => error.into(),
            MarkError::Registration(error) => error.into(),
            error => Self::Mark(error),
        }
    }
}

impl From<SigmarkError> for Failure {
    fn from(error: SigmarkError) -> Self {
        match error {
            SigmarkError::Job(error) => error.into(),
            SigmarkError::Mark(error) => error.into(),
            SigmarkError::Certificate(error) => error.into(),
            SigmarkError::Signature(error) => error.into(),
            error => Self::Sigmark(error),
        }
    }
}
