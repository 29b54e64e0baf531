"""Quiet segments, findings and errors about motion. Noise models describe a sensor at rest, not its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import percent_text
from allanite.recording.findings import Finding
from allanite.recording.motion import MAX_MOVING_SHARE, MAX_TILT, MIN_TURNS, Motion

if TYPE_CHECKING:
    from allanite.recording.recording import Recording


def quiet_span(recording: Recording) -> tuple[float, float]:
    """Start and end of the longest quiet segment, s since the first sample.

    Raises `InputError` without a gyroscope or accelerometer with a unit, and `TooShortError` if no segment is quiet.
    """
    motion = recording.motion
    if motion is None:
        raise InputError(
            "a quiet segment needs a gyroscope or accelerometer with a known unit",
            missing="unit",
            remedy=": give {unit}, or {trim}",
        )
    if motion.quiet is None:
        raise TooShortError("no segment of the log is quiet: it moves all the time")
    return motion.quiet


def quiet_segment(recording: Recording) -> Recording:
    """`Recording` of the longest quiet segment, with a finding; raises errors as `quiet_span` does."""
    start, end = quiet_span(recording)
    found = f"kept the longest quiet segment, {start:.6g}–{end:.6g} s of {recording.duration:.6g} s"
    finding = Finding("quiet_stretch", "info", found, values={"start_s": start, "end_s": end})
    return recording.trim(start, end).with_findings([finding])


def motion_findings(recording: Recording, least: float = MAX_MOVING_SHARE) -> list[Finding]:
    """At most one `Finding` of kind ``motion``, if the recording moves or more than `least` of its windows show motion."""
    motion = recording.motion
    if motion is None or not (motion.moves or motion.share > least):
        return []
    values = {"share": motion.share, "tilt_deg": motion.tilt, "turns": motion.turns}
    if motion.quiet is not None:
        values |= {"quiet_start_s": motion.quiet[0], "quiet_end_s": motion.quiet[1]}
    return [
        Finding(
            "motion",
            "warning",
            f"not at rest: {_motion_text(motion, least)}; a noise model describes a sensor at rest, not its motion;"
            f" {_quiet_text(motion)}",
            values=values,
            remedy="" if motion.quiet is None else f" ({_quiet_remedy(motion.quiet)})",
        )
    ]


def motion_error(recording: Recording) -> InputError | None:
    """`InputError` (not raised) if the recording moves and its longest quiet segment is below half of it, else None.

    None also if the motion cannot be judged.
    """
    motion = recording.motion
    if motion is None or not motion.mostly_moves:
        return None
    use = "" if motion.quiet is None else f": use {_quiet_remedy(motion.quiet)};"
    return InputError(
        f"not at rest: {_motion_text(motion, 0.0)}; {_quiet_text(motion)}",
        remedy=f"{use or ';'} {{anyway}} fits the motion as noise",
    )


def _motion_text(motion: Motion, least: float) -> str:
    """Signs of motion as text; changes and sway only if they occur in more than the fraction `least` of the record.

    If there is no sign to state, the text is the moving fraction of the record.
    """
    why = []
    if motion.turns >= MIN_TURNS:
        why.append(f"{motion.turns} turns of up to {motion.largest_turn:.0f}°")
    if motion.share > least and motion.activity > motion.limit:
        why.append(
            f"{motion.column} changes by {motion.activity:.2g} {motion.unit} within a second, more than a sensor"
            f" at rest ({motion.limit:.2g}), in {percent_text(motion.share)} of the record"
        )
    if motion.sway and motion.share > least:
        why.append(f"it sways by {motion.sway:.2g}° rms, in gyroscopes and accelerometers alike")
    if motion.tilt > MAX_TILT:
        why.append(f"the direction of gravity turns by {motion.tilt:.0f}°")
    return ", and ".join(why) or f"motion in {percent_text(motion.share)} of the record"


def _quiet_text(motion: Motion) -> str:
    """Text ``"longest quiet segment 10–60 s"``, or ``"no segment is quiet"``."""
    if motion.quiet is None:
        return "no segment is quiet"
    start, end = motion.quiet
    return f"longest quiet segment {start:.6g}–{end:.6g} s"


def _quiet_remedy(quiet: tuple[float, float]) -> str:
    """Text of a remedy with placeholders: use the segment (start, end), s, or the method for the quiet segment."""
    return f"{{this_span:{quiet[0]:.6g}:{quiet[1]:.6g}}}, or {{quiet}}"
