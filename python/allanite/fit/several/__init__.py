"""Fits of one model to several recordings or several columns, and tests whether they agree."""
