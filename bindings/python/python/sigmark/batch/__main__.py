"""`python -m sigmark.batch`: many models at once."""

from __future__ import annotations

import argparse
import logging
import sys

from . import Summary, embed, verify


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sigmark.batch", description="Verify or sign many models, on all cores or on a cluster.")
    commands = parser.add_subparsers(dest="command", required=True)
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument("jobs", help="a table: Parquet, or .csv; a path or a URI")
    common.add_argument("-o", "--output", required=True, help="a folder for the results (Parquet); a path or a URI")
    common.add_argument("--engine", choices=["native", "ray", "serial"], default="native", help="Daft on this machine [default], Daft on a cluster of Ray, or one row after the other")
    common.add_argument("--workers", type=int, help="how many rows are worked on at once [default: the processors of this machine]")
    common.add_argument("--threads", type=int, default=1, help="threads a worker [default: 1]")
    common.add_argument("--overwrite", action="store_true", help="replace results that are complete")

    asked = commands.add_parser("verify", parents=[common], help="columns suspect, original, certificate; public_key, if wanted")
    asked.add_argument("--public-key", help="the signer's key, for rows without one")
    asked.add_argument("--p-bound", type=float, default=1e-6)

    signed = commands.add_parser("embed", parents=[common], help="columns model, output; recipient and message, if wanted")
    signed.add_argument("--key", required=True, help="the signing key, which every worker reads")
    signed.add_argument("--message", default="", help="what is asserted, of rows without a message")
    signed.add_argument("--payload", choices=["signature", "tag"])
    signed.add_argument("--strength", choices=["subtle", "standard", "strong"])
    return parser.parse_args()


def _run(arguments: argparse.Namespace) -> Summary:
    options = {name: value for name, value in vars(arguments).items() if name != "command"}
    return embed(**options) if arguments.command == "embed" else verify(**options)


def main() -> int:
    """Exit codes: 0 all rows have a result, 1 some have an error instead, 2 nothing could be done."""
    logging.basicConfig(format="%(message)s")
    try:
        summary = _run(_arguments())
    except (OSError, ValueError, ImportError, RuntimeError) as error:
        print(f"sigmark.batch: {error}", file=sys.stderr)
        return 2
    print(f"{summary.rows} rows in {summary.output}, {summary.errors} of them with an error")
    return 1 if summary.errors else 0


if __name__ == "__main__":
    sys.exit(main())
