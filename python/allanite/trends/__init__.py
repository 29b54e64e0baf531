"""Rates of slowly changing quantities under colored noise.

Input: a series with its times (`trend`). Output: a `Trend` with rate, steps, periodic terms and noise. Add a known
function of time in `design.py`.
"""

from __future__ import annotations

from allanite.trends.trend import Step, Trend, Trends, Wave, trend, trend_columns

__all__ = ["Step", "Trend", "Trends", "Wave", "trend", "trend_columns"]
