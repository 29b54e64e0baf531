"""The commands, one module each with a function `command`; its line of help is in `cli/__init__.py`."""
