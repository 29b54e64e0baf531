"""What the installed command calls: the command line, and one line where Ctrl-C comes before it is imported."""

from __future__ import annotations

import os

__all__ = ["main"]


def main() -> None:
    """Import and run the command line."""
    try:
        from allanite import cli
    except KeyboardInterrupt:
        # Nothing has begun, and what an interrupted import leaves cannot be cleaned up.
        os.write(2, b"allanite: interrupted\n")
        os._exit(130)
    cli.main()
