"""Prints where the bunny lies that comes with pymeshlab."""

import pathlib

import pymeshlab

print(pathlib.Path(pymeshlab.__file__).parent / "tests" / "sample_meshes" / "bunny.obj")
