"""Detection power and length of a record, before anything is recorded.

Input: a model with expected values and a question (find, know, or tell apart). Output: a `Plan` or a `Power`. Add a
question as a module that compares fits of expected spectra, as `_log_odds` in `duration.py` does.
"""

from allanite.planning.detection import Power, detection_power
from allanite.planning.duration import Plan, plan

__all__ = ["Plan", "Power", "detection_power", "plan"]
