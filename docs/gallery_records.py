"""The recordings of the gallery, and what was expected of each before the program saw it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import number

if TYPE_CHECKING:
    import allanite as al

__all__ = ["RECORDS", "Expected", "Record"]

ADIS = "SMAC-Group/imudata, CC BY-NC-SA 4.0 (University of Calgary)"
CATS = "scikit-diveMove, AGPL-3.0"


@dataclass(frozen=True)
class Expected:
    """One expectation: what was expected, what was found, whether they agree."""

    claim: str
    found: str
    holds: bool


@dataclass(frozen=True)
class Record:
    """One section of the gallery."""

    name: str
    title: str
    file: str
    column: str | int | None
    model: str
    source: str
    what: str
    expect: Callable[[al.Recording, al.Check, al.Study], list[Expected]]
    remark: Callable[[al.Check], str] | None = None


def first_is(check: al.Check, *kinds: str) -> Expected:
    """Expectation that the suggestion with the best evidence is of one of these kinds."""
    found = check.significant[0].kind if check.significant else "nothing"
    return Expected(f"first suggestion: {' or '.join(kinds)}", found, found in kinds)


def added(study: al.Study) -> list[al.Effect]:
    """Effects that stepwise model building added, in order."""
    return [effect for rung in study.ladder for effect in rung.new]


def long_error(fit: al.Fit, beyond: float) -> float:
    """Root mean square error of the Allan deviation beyond a τ, %."""
    curve = fit.curve
    keep = curve.tau > beyond
    return float(100 * np.sqrt(np.mean((curve.ratio[keep] - 1) ** 2)))


def temperature(low: float, high: float, unit: str) -> Callable[..., list[Expected]]:
    """Function that expects temperature first, with a coefficient in a range, and half of the slow error."""

    def expect(_: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
        out = [first_is(check, "covariate")]
        found = [s for s in check.suggestions if s.kind == "covariate" and s.effect.column == "temperature"]  # fmt: skip
        if found:
            value = found[0].effect.coefficient
            text = f"{number(value)} {unit}, lag {number(found[0].effect.lag or 0.0)} s"
            out.append(
                Expected(
                    f"coefficient {number(low)} … {number(high)} {unit}", text, low <= value <= high
                )
            )
        before, after = long_error(study.ladder[0].fit, 1e3), long_error(study.fit, 1e3)
        claim = "Allan error beyond 1000 s falls to less than half"
        out.append(Expected(claim, f"{before:.0f} % → {after:.0f} %", after < 0.5 * before))
        return out

    return expect


def no_temperature(_: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
    """Expectations that temperature does not explain this axis."""
    first = check.significant[0].kind if check.significant else "nothing"
    kinds = [e.kind for e in added(study)]
    return [
        Expected("temperature is not the first suggestion", first, first != "covariate"),
        Expected(
            "the ladder does not add temperature",
            ", ".join(kinds) or "nothing added",
            "covariate" not in kinds,
        ),
    ]


def roll_off(_: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
    """Expectations that a low-pass or a resonance is suggested first, and that the largest misfit is above 9 Hz."""
    rows = check.where.frequency
    worst = max(rows, key=lambda row: abs(row["z"]))
    return [
        first_is(check, "bandwidth", "resonance"),
        Expected(
            "largest misfit above 9 Hz",
            f"at {worst['low_hz']:.3g}–{worst['high_hz']:.3g} Hz, z {worst['z']:+.0f}",
            worst["high_hz"] > 9,
        ),
    ]


def band(low: float, high: float, kinds: tuple[str, ...]) -> Callable[..., list[Expected]]:
    """Function that expects an added effect of one of the `kinds` whose middle frequency, Hz, is in a range."""

    def expect(_: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
        inside = [
            f"{e.title} at {middle:.4g} Hz"
            for e in added(study)
            if e.kind in kinds and low <= (middle := 0.5 * sum(e.occupies or (0.0, 0.0))) <= high
        ]
        claim = f"the ladder adds a {' or '.join(kinds)} at {low:g}–{high:g} Hz"
        return [Expected(claim, ", ".join(inside) or "none", bool(inside))]

    return expect


def comb(recording: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
    """Expectations that a line at 0.564 Hz and harmonics of it are added."""
    out = band(0.55, 0.58, ("sinusoid", "resonance"))(recording, check, study)
    near = [e for e in added(study) if getattr(e, "frequency", None)]
    over = [e.frequency / 0.5645 for e in near]
    whole = [f"{r:.3f}" for r in over if 1.5 < r < 10.5 and abs(r - round(r)) < 0.05]
    found = f"at {', '.join(whole)} times" if whole else "none added"
    out.append(Expected("harmonics of it", found, bool(whole)))
    return out


def contaminated(_: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
    """Expectations that outliers and a Gauss-Markov process are added, and that N decreases."""
    kinds = [e.kind for e in added(study)]
    before, after = study.ladder[0].fit["N"], study.fit["N"]
    out = [
        Expected(f"the ladder adds {kind}", ", ".join(kinds), kind in kinds)
        for kind in ("outliers", "gauss_markov")
    ]
    claim = "N is freed of the outliers"
    out.append(Expected(claim, f"{before!r} → {after!r}", after.value < before.value))
    if "gauss_markov" in kinds:
        value = study.fit["GM.correlation_time"]
        out.append(Expected("its time constant is 1.5…4 s", repr(value), 1.5 < value.value < 4))
    return out


def says(kind: str, claim: str, pattern: str) -> Callable[..., list[Expected]]:
    """Function that expects a finding of this kind in the audit whose message contains `pattern`."""

    def expect(recording: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
        messages = [f.message for f in recording.audit if f.kind.startswith(kind)]
        found = next((m for m in messages if pattern in m), "")
        return [Expected(f"the audit says {claim}", found or "nothing of it", bool(found))]

    return expect


def white(recording: al.Recording, check: al.Check, study: al.Study) -> list[Expected]:
    """Expectations that the audit states the wrong rate, and that no effect is added."""
    out = says("rate", "9.862 Hz, not 10 Hz", "9.862")(recording, check, study)
    limits = f"{study.fit.model.name}, B {study.fit['B']!r}, K {study.fit['K']!r}"
    out.append(Expected("white noise and nothing else", limits, not added(study)))
    return out


def slow(which: str, column: str) -> Record:
    """Section on a column of recording ``a`` or ``b`` of the whale tag."""
    hours = {"a": "25.5 h", "b": "12.6 h"}[which]
    expect, remark = {
        "acc_y": (temperature(-0.026, -0.017, "m/s²/°C"), None),
        "gyro_y": (temperature(0.25, 0.50, "mrad/s/°C"), lambda _: HYSTERESIS),
        "gyro_x": (no_temperature, lambda _: SPURIOUS),
    }[column]
    what = f"Inertial sensor of a whale tag, 1 Hz, {hours} at 5 to 24 °C, with its temperature."
    title = f"Whale tag {which}, {column.replace('_', ' ')}"
    file = f"cats_thermal_{which}.npz"
    return Record(f"cats_{which}_{column}", title, file, column, "N+K", CATS, what, expect, remark)


def line_or_resonance(check: al.Check) -> str:
    """Remark on which suggestions describe the line at 0.56 Hz, and why."""
    found = {}
    for s in check.suggestions:
        frequency = getattr(s.effect, "frequency", None) or 0.0
        if abs(frequency - 0.565) < 0.01:
            found[s.kind] = s
    words = ", ".join(f"{kind} ΔlogL {number(s.delta_log_likelihood)}" for kind, s in found.items())
    return (
        "The frequency of the line varies by half a millihertz. A pure sinusoid leaves part of its power, which a narrow "
        f"resonance can explain. Among the first suggestions: {words or 'neither'}."
    )


HYSTERESIS = (
    "Least squares on the levels gives 0.46 mrad/s/°C, on differences over 15 minutes 0.30: the sensor lags behind its "
    "thermometer and does not come back on the same path. One coefficient with one lag is the least that can be said."
)
SPURIOUS = (
    "The sign of this axis' slope against temperature changes with the time scale, so a regression on the levels would be "
    "spurious, however small its residual."
)
RATE = "A rate that is wrong by 1.4 % makes N wrong by 0.7 % and every time constant by 1.4 %."

RECORDS = (
    *(slow(which, column) for which in "ab" for column in ("acc_y", "gyro_y", "gyro_x")),
    Record(
        "adis_gyro_x", "ADIS16405, gyro x", "adis16405_imu1.npz", "gyro_x", "N+B+K", ADIS,
        "A MEMS inertial sensor, 100 Hz, 2.8 h; its density falls by 30 % towards 47 Hz.", roll_off,
    ),
    Record(
        "adis_acc_x", "ADIS16405, accelerometer x", "adis16405_imu1.npz", "acc_x", "N+B+K", ADIS,
        "The accelerometer of the same sensor, in coarse steps, hears something that turns 0.56 times a second.",
        comb, line_or_resonance,
    ),
    Record(
        "adis_gyro_z", "ADIS16405, gyro z", "adis16405_imu1.npz", "gyro_z", "N+B+K", ADIS,
        "The z axis has a band at 20 Hz, eight times the floor and 3 Hz wide.",
        band(18.0, 22.0, ("resonance", "sinusoid")),
    ),
    Record(
        "mtig_gyro_x", "Xsens MTi-G, gyro x, contaminated", "mtig_gyrox_contaminated.npz", "gyro_x", "N+B+K",
        "SMAC-Group/imudata, CC BY-NC-SA 4.0",
        "A MEMS gyroscope, 100 Hz, 1.4 h, with outliers up to 0.3 rad/s.", contaminated,
    ),
    Record(
        "hfi_gyro_x", "HandsFree, gyro x", "hfi_10hz.npz", "gyro_x", "N+B+K",
        "dockermyself/allan_variance, no licence stated", "A serial sensor labelled 10 Hz.", white, lambda _: RATE,
    ),
    Record(
        "phone_gyro", "A telephone's gyroscope", "phone_gyro_b.npz", 0, "N+B+K",
        "milkytipo/Allan-variance, no licence stated", "Android, 5 Hz, 2.1 h, printed to 0.001 rad/s.",
        says("quantis", "the print step of 0.001 rad/s", "0.001"),
    ),
)  # fmt: skip
