"""Spectra of a record."""

from __future__ import annotations

from allanite.spectrum.spectrum import Bins, Spectrum, bins_of, bridge_gaps, psd

__all__ = ["Bins", "Spectrum", "bins_of", "bridge_gaps", "psd"]
