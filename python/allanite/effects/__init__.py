"""The catalogue: one physical effect a file."""
