"""Several recordings in one fit, several columns in one object."""
