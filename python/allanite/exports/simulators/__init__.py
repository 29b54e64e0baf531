"""Formats of simulators, one module each. Add a simulator as a module with `render` and `TARGETS`."""
