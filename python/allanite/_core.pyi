"""The compiled core. Never imported by users: `_kernels.py` is the one door."""

# -- doorway
def version() -> str: ...
