"""The command as ``python -m allanite``."""

from allanite._command import main

if __name__ == "__main__":
    main()
