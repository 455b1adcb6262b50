"""One coordinate of the object's position behind its nominal motion, sampled, delayed and disturbed."""

from __future__ import annotations

from math import exp

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.governor import governed_acceleration
from coop_drake.laws.nominal import nominal_flow
from coop_drake.robustness.position import PositionGains
from coop_drake.tree.arrays import FloatArray


@compiled
def run_position(
    flow: FloatArray, gains: tuple[float, float, float, float], period: float, delay: int, lag: float,
    factor: float, disturbances: FloatArray, motion: FloatArray,
) -> None:  # fmt: skip
    """Simulate the position from rest; a command is held over a period, and p'' follows it with a lag.

    Args:
        flow: What ``nominal_flow`` gives.
        gains: K, zeta, K_t and zeta_t.
        period: T [s].
        delay: Age of a measurement in periods.
        lag: Time constant of p'' [s].
        factor: Factor by which accelerations are larger than commanded [-].
        disturbances: Step of p_G [m], errors of the measured position [m] and velocity [m/s], and of the
            acceleration [m/s^2] in every period, shape (samples, 4).
        motion: Receives p, p', p^ and p^' at every sample, shape (samples, 4).
    """
    x, v, s, governor = 0.0, 0.0, 0.0, 0.0
    nominal, rate = 0.0, 0.0
    for k in range(disturbances.shape[0]):
        motion[k, 0], motion[k, 1], motion[k, 2], motion[k, 3] = x, v, nominal, rate
        old = max(k - delay, 0)  # it was at rest before
        seen = motion[old, 0] + disturbances[k, 1], motion[old, 1] + disturbances[k, 2]
        expected = motion[old, 2], motion[old, 3]
        u = governed_acceleration(nominal, rate, governor, gains[0], gains[1])
        u += governed_acceleration(seen[0] - expected[0], seen[1] - expected[1], 0.0, gains[2], gains[3])
        left = exp(-period / lag) if lag > 0.0 else 0.0
        gap, w, t = s - u, disturbances[k, 3], period
        x += t * v + factor * (0.5 * t * t * u + lag * (t - lag * (1.0 - left)) * gap) + 0.5 * t * t * w
        v += factor * (t * u + lag * (1.0 - left) * gap) + t * w
        s = u + left * gap
        off = nominal - governor
        nominal = governor + flow[0, 0] * off + flow[0, 1] * rate
        rate = flow[1, 0] * off + flow[1, 1] * rate
        governor += disturbances[k, 0]


def worst_departures(
    gains: PositionGains, period: float, delay: int, lag: float, factor: float, sizes: FloatArray,
    samples: int = 800,
) -> FloatArray:  # fmt: skip
    """Return p - p^ under the disturbances that push it most at the last sample, shape (samples,) [m].

    The loop is linear: a disturbance acts at the last sample by its response, and is given its sign.

    Args:
        gains: The gains.
        period: T [s].
        delay: Age of a measurement in periods.
        lag: Time constant of p'' [s].
        factor: Factor by which accelerations are larger than commanded [-].
        sizes: Largest disturbances, in the order of ``run_position``, shape (4,).
        samples: Number of samples.
    """
    flow = nominal_flow(gains.stiffness, gains.damping, period)
    row = gains.stiffness, gains.damping, gains.tracking_stiffness, gains.tracking_damping
    motion, disturbances = np.zeros((samples, 4)), np.zeros((samples, 4))
    for kind, size in enumerate(sizes):
        alone = np.zeros((samples, 4))
        alone[0, kind] = 1.0
        run_position(flow, row, period, delay, lag, factor, alone, motion)
        disturbances[:, kind] = size * np.sign(motion[::-1, 0] - motion[::-1, 2])
    disturbances[:-1] = disturbances[1:]  # the response at sample n is to a disturbance n samples before
    run_position(flow, row, period, delay, lag, factor, disturbances, motion)
    return motion[:, 0] - motion[:, 2]
