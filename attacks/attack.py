"""Applies an attack to a mesh file: python attack.py IN OUT NAME [--strength S] [--seed N]."""

import argparse
import json
import os
import platform
import sys
from importlib.metadata import version

PACKAGES = ["fast-simplification", "numpy", "pymeshlab"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("input")
    parser.add_argument("output", help="a .ply file")
    parser.add_argument("name", help="see README.md; steps joined by + run one after the other: crop:50+simplify:10+loop")
    parser.add_argument("--strength", type=float, help="what it means depends on the attack; see README.md")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    # Libraries in C++ print where they like: standard output is kept for the report.
    report = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    try:
        print(json.dumps(attacked(arguments)), file=report)
        return 0
    except KeyboardInterrupt:
        return 130
    except Exception as error:  # whatever a package raises, one line says so
        words = " ".join(str(error).split()) or type(error).__name__
        print(f"attack.py: {words}", file=sys.stderr)
        return 1


def attacked(arguments: argparse.Namespace) -> dict:
    """Does it, and reports what was done."""
    # Here, so that a package that is missing or broken is said in one line too.
    from chain import parsed, run
    from mesh import Refused
    from meshfile import load, save

    if not arguments.output.endswith(".ply"):
        raise Refused(f"{arguments.output}: attacked meshes are written as PLY; name a .ply file")
    if arguments.seed < 0:
        raise Refused(f"seed {arguments.seed} is negative")
    steps = parsed(arguments.name, arguments.strength)
    mesh = load(arguments.input)
    result, reports = run(mesh, steps, arguments.seed)
    save(result, arguments.output)
    return {
        "attack": "+".join(f"{name}:{strength:g}" for name, strength in steps),
        "seed": arguments.seed,
        "vertices": [len(mesh.positions), len(result.positions)],
        "faces": [len(mesh.faces), len(result.faces)],
        "steps": reports,
        "versions": {"python": platform.python_version()} | {name: version(name) for name in PACKAGES},
    }


if __name__ == "__main__":
    sys.exit(main())
