"""An attack as it is written, crop:50+simplify:10+loop, and as it is run: one step after the other."""

import importlib
import pathlib
import sys
import tomllib
from types import ModuleType
from typing import Any, NamedTuple

import numpy

from mesh import Mesh, Refused
from repair import repaired

LIST = tomllib.loads(pathlib.Path(__file__).with_name("attacks.toml").read_text(encoding="utf-8"))

ATTACKS: dict[str, ModuleType] = {
    script["name"]: importlib.import_module(script["name"].replace("-", "_")) for script in LIST["script"]
}

# The columns of the paper's Table 5.
CHAINS: dict[str, str] = {attack["short"]: attack["spec"] for attack in LIST["tables"]["table5"]}


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
