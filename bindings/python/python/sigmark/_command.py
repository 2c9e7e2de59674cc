"""The command `sigmark`: the very program, in this process."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Carries out the command line of this process, and gives its exit code."""
    # Python takes these signals over; the program expects what every program begins with.
    for name in ("SIGINT", "SIGXFSZ"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    from ._sigmark import command

    return command(["sigmark", *sys.argv[1:]])
