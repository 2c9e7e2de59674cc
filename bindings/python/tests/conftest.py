"""What several tests need."""

from __future__ import annotations

import pytest

import sigmark
import sigmark.shapes


@pytest.fixture(scope="session")
def key() -> sigmark.SigningKey:
    return sigmark.SigningKey.generate()


@pytest.fixture(scope="session")
def torus() -> sigmark.Mesh:
    return sigmark.shapes.bumpy_torus()


@pytest.fixture(scope="session")
def signed(torus: sigmark.Mesh, key: sigmark.SigningKey) -> sigmark.Signed:
    return sigmark.embed(torus, key, message="© 2026 Studio", recipient="order 4711")
