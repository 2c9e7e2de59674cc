"""One exception class for each enum of errors of the libraries."""

from __future__ import annotations

__all__ = [
    "AssetError",
    "CertificateError",
    "Error",
    "JobError",
    "KeysError",
    "MarkError",
    "MeshError",
    "PartitionError",
    "QualityError",
    "RegistrationError",
    "SigmarkError",
    "SignatureError",
    "SpectrumError",
]


class Error(Exception):
    """Something could not be done: the message says what, why, and what to do.

    `variant` names the case, such as "IndexOutOfRange"; it stays the same when messages are worded anew.
    """

    variant: str

    def __init__(self, message: str, variant: str = "") -> None:
        super().__init__(message)
        self.variant = variant

    def __reduce__(self) -> tuple[type[Error], tuple[str, str]]:
        return type(self), (str(self), self.variant)


class MeshError(Error, ValueError):
    """Positions and triangles make no mesh."""


class AssetError(Error, OSError):
    """A mesh file was not read, or not written."""


class SpectrumError(Error, ValueError):
    """No spectrum could be computed."""


class RegistrationError(Error, ValueError):
    """No alignment could be computed, or two meshes do not have the same triangles."""


class QualityError(Error, ValueError):
    """Two meshes can't be compared."""


class PartitionError(Error, ValueError):
    """A mesh or a graph can't be divided."""


class KeysError(Error, ValueError):
    """A key could not be read or written."""


class CertificateError(Error, ValueError):
    """A certificate could not be read."""


class SignatureError(Error, ValueError):
    """A signature does not check, or can't be made."""


class MarkError(Error, ValueError):
    """A mark could not be written or read."""


class SigmarkError(Error, ValueError):
    """A mesh could not be signed, or a suspect not be judged."""


class JobError(Error, RuntimeError):
    """The operating system did not give the threads."""
