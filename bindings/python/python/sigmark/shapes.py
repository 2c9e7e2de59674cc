"""Shapes for examples and tests."""

from ._sigmark import bumpy_torus, sphere

__all__ = ["bumpy_torus", "sphere"]
