"""Views of a fit: where the model differs from the measurement over τ, frequency and time.

Input: a fit (`criticize`). Output: a `Where` with the residuals and the worst interval of each view. Add a view as
functions that return residuals with their expected scatter, and include it in `criticize`.
"""

from allanite.criticism.verdict import Where, criticize

__all__ = ["Where", "criticize"]
