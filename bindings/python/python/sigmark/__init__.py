"""Sign 3D models in their shape, find the signature again, and compute Laplace-Beltrami spectra.

>>> import sigmark, sigmark.shapes
>>> torus = sigmark.shapes.bumpy_torus()
>>> sigmark.spectrum(torus.vertices, torus.faces, k=20).eigenvalues.shape
(20,)
>>> key = sigmark.SigningKey.generate()
>>> signed = sigmark.embed(torus, key, message="© 2026 Studio, order 4711")
>>> sigmark.verify(signed.mesh, signed.certificate, torus, key.public_key).outcome
'verified'

Meshes are given as a `Mesh` of arrays, an `Asset` (a file that keeps its bytes), the path of a file, or an object of trimesh, open3d, meshio or pymeshlab.
Long calls leave the interpreter to other threads, tell their `progress`, and end at Ctrl-C. Exceptions are subclasses of `Error`.
"""

from ._errors import (
    AssetError,
    CertificateError,
    Error,
    JobError,
    KeysError,
    MarkError,
    MeshError,
    PartitionError,
    QualityError,
    RegistrationError,
    SigmarkError,
    SignatureError,
    SpectrumError,
)
from ._sigmark import (
    Accused,
    Alignment,
    Asset,
    Certificate,
    Comparison,
    Mesh,
    Partition,
    Prepared,
    PublicKey,
    Signed,
    SigningKey,
    Spectrum,
    Trace,
    Tracer,
    Verdict,
    Verifier,
    __version__,
    align,
    compare,
    embed,
    laplacian,
    partition,
    prepare,
    read,
    spectrum,
    spectrum_of_matrices,
    trace,
    verify,
)

__all__ = [
    "Accused",
    "Alignment",
    "Asset",
    "AssetError",
    "Certificate",
    "CertificateError",
    "Comparison",
    "Error",
    "JobError",
    "KeysError",
    "MarkError",
    "Mesh",
    "MeshError",
    "Partition",
    "PartitionError",
    "Prepared",
    "PublicKey",
    "QualityError",
    "RegistrationError",
    "SigmarkError",
    "SignatureError",
    "Signed",
    "SigningKey",
    "Spectrum",
    "SpectrumError",
    "Trace",
    "Tracer",
    "Verdict",
    "Verifier",
    "__version__",
    "align",
    "compare",
    "embed",
    "laplacian",
    "partition",
    "prepare",
    "read",
    "spectrum",
    "spectrum_of_matrices",
    "trace",
    "verify",
]
