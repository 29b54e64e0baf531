"""Rates of slowly changing quantities under colored noise."""

from __future__ import annotations

from allanite.trends.trend import Step, Trend, Trends, Wave, trend

__all__ = ["Step", "Trend", "Trends", "Wave", "trend"]
