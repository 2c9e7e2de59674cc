"""An attack as it is written, crop:50+simplify:10+loop, and as it is run: one step after the other."""

import sys
from types import ModuleType
from typing import Any, NamedTuple

import numpy

import crop
import laplacian
import laplacian_liris
import loop
import midpoint
import noise
import noise_liris
import quantise
import remesh
import similarity
import simplify
import simplify_meshlab
import sqrt3
import taubin
from mesh import Mesh, Refused
from repair import repaired

ATTACKS: dict[str, ModuleType] = {
    "crop": crop,
    "laplacian": laplacian,
    "laplacian-liris": laplacian_liris,
    "loop": loop,
    "midpoint": midpoint,
    "noise": noise,
    "noise-liris": noise_liris,
    "quantise": quantise,
    "remesh": remesh,
    "similarity": similarity,
    "simplify": simplify,
    "simplify-meshlab": simplify_meshlab,
    "sqrt3": sqrt3,
    "taubin": taubin,
}

# The columns of the paper's Table 5.
CHAINS = {
    "crop-simplify": "crop:50+simplify:10",
    "simplify-loop": "simplify:30+loop",
    "crop-simplify-loop": "crop:50+simplify:10+loop",
    "simplify-loop-laplacian": "simplify:30+loop+laplacian:3",
}


class Step(NamedTuple):
    """One attack with its strength."""

    name: str
    strength: float


def parsed(text: str, strength: float | None) -> list[Step]:
    """The steps of an attack as it is written. `strength` is what the command line says beside it, for a single step without its own."""
    words = CHAINS.get(text, text).split("+")
    if strength is not None and (len(words) > 1 or ":" in text):
        raise Refused(f"{text}: the strengths of its steps stand in its name, as in {CHAINS['crop-simplify']}")
    return [step(word, strength) for word in words]


def step(word: str, strength: float | None) -> Step:
    """One step: a name, and perhaps a colon and a strength."""
    name, colon, number = word.partition(":")
    if name not in ATTACKS:
        raise Refused(f"{name or 'nothing'}: no such attack; there are {', '.join([*ATTACKS, *CHAINS])}")
    try:
        given = float(number) if colon else strength
        return Step(name, ATTACKS[name].STRENGTH.checked(given))
    except ValueError:
        raise Refused(f"{word}: the strength is not a number") from None
    except Refused as reason:
        raise Refused(f"{word}: {reason}") from None


def run(mesh: Mesh, steps: list[Step], seed: int) -> tuple[Mesh, list[dict[str, Any]]]:
    """The attacked mesh, and what each step did.

    The first step draws as it would alone, each further one from a stream of its own.
    """
    reports = []
    for number, (name, strength) in enumerate(steps):
        attack = ATTACKS[name]
        before, removed = mesh, {}
        if getattr(attack, "NEEDS_MANIFOLD_EDGES", False):
            mesh, removed = repaired(mesh)
        for reason, count in removed.items():
            print(f"before {name}: removed {count} {reason}", file=sys.stderr)
        stream = numpy.random.SeedSequence(seed, spawn_key=(number,) if number else ())
        try:
            mesh = attack.apply(mesh, strength, numpy.random.default_rng(stream)).checked()
        except Refused as reason:
            raise Refused(f"{name}: {reason}") from reason
        reports.append({
            "name": name,
            "strength": strength,
            "vertices": [len(before.positions), len(mesh.positions)],
            "faces": [len(before.faces), len(mesh.faces)],
            "removed": removed,
        })
    return mesh, reports
