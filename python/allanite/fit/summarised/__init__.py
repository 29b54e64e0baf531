"""A summary in the place of a record: what a fit needs of it, and what it cannot be asked for."""

from allanite.fit.summarised.data import of_summary, refused

__all__ = ["of_summary", "refused"]
