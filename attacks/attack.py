"""Applies one attack to a mesh file: python attack.py IN OUT NAME [--strength S] [--seed N]."""

import argparse

import crop
import laplacian
import loop
import noise
import remesh
import similarity
import simplify
import taubin
from meshfile import load, save

ATTACKS = {
    "crop": crop,
    "laplacian": laplacian,
    "loop": loop,
    "noise": noise,
    "remesh": remesh,
    "similarity": similarity,
    "simplify": simplify,
    "taubin": taubin,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("input")
    parser.add_argument("output", help="a .ply file")
    parser.add_argument("name", choices=sorted(ATTACKS))
    parser.add_argument("--strength", type=float, help="what it means depends on the attack; see README.md")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    attack = ATTACKS[arguments.name]
    strength = attack.DEFAULT_STRENGTH if arguments.strength is None else arguments.strength
    save(attack.apply(load(arguments.input), strength, arguments.seed), arguments.output)


if __name__ == "__main__":
    main()
