"""Entry point of the installed command. Ctrl-C during the import prints one line instead of a traceback."""

from __future__ import annotations

import os


def main() -> None:
    """Import and run the command line, with one thread for linear algebra unless the user sets another number.

    The matrices are tall and narrow: on a busy machine a product waits longer for other threads than it computes.
    """
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        from allanite import cli
    except KeyboardInterrupt:
        # Nothing has begun, and what an interrupted import leaves cannot be cleaned up.
        os.write(2, b"allanite: interrupted\n")
        os._exit(130)
    cli.main()
