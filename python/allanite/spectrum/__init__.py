"""Spectra of a record: cosine-transform ordinates in logarithmically spaced bins.

Input: samples and a rate (`psd`). Output: a `Spectrum` with frequencies, densities and intervals. Add another
arrangement of bins next to `bins_of`.
"""

from __future__ import annotations

from allanite.spectrum.spectrum import Bins, Spectrum, bins_of, bridge_gaps, psd

__all__ = ["Bins", "Spectrum", "bins_of", "bridge_gaps", "psd"]
