"""The command `sigmark`: the very program, in this process."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Carries out the command line of this process, and gives its exit code."""
    # Python takes these signals over; the program expects what every program begins with. What a shell told to pass Ctrl-C over goes on doing so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "SIGXFSZ"):
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    from ._sigmark import command

    return command(["sigmark", *sys.argv[1:]])
