"""GTSAM: Python code with the continuous-time covariances of PreintegrationCombinedParams."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._head import head_comments
from allanite.exports._initial import largest_initial_bias, unknown_bias_text
from allanite.exports._lines import choose_all, largest_number, with_shared_numbers
from allanite.exports._target import Target
from allanite.exports._text import as_comments


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a Python script with the squares of N and K in SI: power spectral densities, not variances of samples.

    It also sets the covariance of the integration to a negligible value. GTSAM's default would give an error of 1 m
    after 1 s. A prior on the first bias follows if both sensors have several logs. `rate` is not used.
    """
    gyro, accel = (choose_all(own, overbound=overbound) for own in gyro_and_accel_axes(axes))
    convention = (
        "GTSAM: continuous-time, two-sided covariances N^2 and K^2. They do not depend on the sampling rate.",
    )
    lines = [
        as_comments(head_comments(with_shared_numbers(gyro, accel), convention)),
        "import gtsam\nimport numpy as np\n\n",
        "# For a frame whose z axis points up. Use MakeSharedD if the z axis points down.\n",
        "parameters = gtsam.PreintegrationCombinedParams.MakeSharedU(9.80665)\n",
    ]
    for own, setter, name, unit in (
        (accel, "setAccelerometerCovariance", "N", "(m/s^2)^2/Hz"),
        (gyro, "setGyroscopeCovariance", "N", "(rad/s)^2/Hz"),
        (accel, "setBiasAccCovariance", "K", "(m/s^3)^2/Hz"),
        (gyro, "setBiasOmegaCovariance", "K", "(rad/s^2)^2/Hz"),
    ):
        if own:
            value, remark = largest_number(own, name)
            note = f"{unit}, two-sided" + (f"; {remark}" if remark else "")
            lines.append(f"parameters.{setter}({value:.6e}**2 * np.eye(3))  # {note}\n")
        else:
            lines.append(
                f"# parameters.{setter}: no model was given. GTSAM keeps its default until you set a value.\n"
            )
    walks = [f"{largest_number(own, 'K')[0] if own else 0.0:.6e}" for own in (accel, gyro)]
    lines.append(
        "# GTSAM 4.2 adds this covariance to every preintegration; its default is the identity. The uncertainty of the\n"
        "# bias belongs into the prior on the first bias of your graph. This file uses the random walk within 1 ms.\n"
        'if hasattr(parameters, "setBiasAccOmegaInit"):\n'
        f"    walk = np.array([{walks[0]}] * 3 + [{walks[1]}] * 3)\n"
        "    parameters.setBiasAccOmegaInit(np.diag(1e-3 * walk**2))\n"
        "# Error of the integration itself: negligible. GTSAM's default would be 1 m^2/s.\n"
        "parameters.setIntegrationCovariance(1e-8**2 * np.eye(3))\n"
    )
    largest = [
        largest_initial_bias((axis for axis, _ in own), overbound=overbound)
        for own in (accel, gyro)
    ]
    if all(largest):
        bias_a, bias_g = (one[0] for one in largest if one is not None)
        lines.append(
            "# Prior on the first bias, accelerometer first: standard deviations at switch-on from several logs.\n"
            f"bias_prior = gtsam.noiseModel.Diagonal.Sigmas(np.array([{bias_a:.6e}] * 3 + [{bias_g:.6e}] * 3))\n"
        )
    else:
        sentences = [
            f"{own[0][0].kind}, largest axis: standard deviation at switch-on from several logs {one[0]:.3g}"
            f" {own[0][0].unit}"
            if one is not None
            else unknown_bias_text(own[0][0])
            for own, one in zip((accel, gyro), largest, strict=True)
            if own
        ]
        lines.append(as_comments([f"Prior on the first bias: {one}" for one in sentences]))
    return "".join(lines)


TARGETS = (Target("gtsam", "GTSAM", "gtsam_parameters.py", render),)
