"""Whether nominal motions stay within stated departures near the middle of their closed funnels for ever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.tubes import Nominal

LENGTH = 5.0
"""Length of a response in its slowest time constant [-]."""


@dataclass(frozen=True)
class Closed:
    """Axes from the time at which their funnels count as closed until their tubes' end, arrays of shape (b,).

    Attributes:
        time: That time [s].
        samples: Number of samples from then on.
        box: Departures of x, v and acceleration then, shape (3, b).
        x: Stated departure of x for ever [rad or m].
        v: Stated departure of v for ever [rad/s or m/s].
    """

    time: FloatArray
    samples: FloatArray
    box: FloatArray
    x: FloatArray
    v: FloatArray


def tails(motions: Nominal) -> FloatArray:
    """Return for how many samples tubes go on after their funnels are closed, shape (b,)."""
    axes, T = motions.axes, motions.period
    damping, width = axes.k1 + axes.k2, axes.goal[1] - axes.goal[0]
    slowest = np.minimum((axes.k1 * axes.k2 + 16.0 * axes.kappa / width**2) / damping, 0.5 * damping)
    samples: FloatArray = np.ceil(LENGTH / (slowest * T)).astype(int) + 2
    return samples


def staying(motions: Nominal, closed: Closed) -> tuple[FloatArray, FloatArray]:
    """Return bounds of |x| and |v| at the next sample, (2, b), and the largest |acceleration|, (b,).

    The bounds follow if the stated ones held at all samples before. Where they are not larger than the stated
    ones, these hold for ever, by induction.
    """
    axes, (reach, fast) = motions.axes, (closed.x, closed.v)
    middle = 0.5 * (axes.goal[0] + axes.goal[1])
    _, slope, by_rate, rest, _ = motions.command(closed.time, middle, reach, np.zeros_like(reach), fast)
    k1, k1_rate = axes.ramp(closed.time)
    missing = axes.k1 - k1
    growing = (axes.k2 * missing + k1_rate) * reach + missing * (1.0 - np.log(axes.share)) * fast
    size = rest + growing
    largest = np.abs(slope) * reach + np.abs(by_rate) * fast + size
    responses = np.abs(_responses(motions, slope, by_rate, int(closed.samples.max())))
    left, sums = _sums(closed, responses)
    return left + sums * size, np.maximum(largest, closed.box[2])


def _responses(motions: Nominal, slope: FloatArray, by_rate: FloatArray, steps: int) -> FloatArray:
    """Return x, v and a at every sample, of axes that begin with 1 in one of them, or with one command of 1.

    The shape is (steps, 3, 4, b); the first sample is the one after the beginning.
    """
    matrix, enters = motions.carry
    state, result = np.zeros((3, 4, slope.size)), np.empty((steps, 3, 4, slope.size))
    state[:, :3] = np.eye(3)[:, :, None]
    for k in range(steps):
        command = slope * state[0] + by_rate * state[1]
        if k == 0:
            command[3] += 1.0
        result[k] = state = np.tensordot(matrix, state, 1) + enters[:, None, None] * command
    return result


def _sums(closed: Closed, responses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what is left of x and v after the samples, and the sums of all responses to commands, (2, b)."""
    steps = np.arange(1, len(responses) + 1)[:, None]
    followed = np.where((steps <= closed.samples)[:, None, None], responses, 0.0)
    sums = followed[:, :2].sum(axis=0)
    ends = np.where((steps == closed.samples)[:, None, None], responses, 0.0).max(axis=0)
    again = np.einsum("ijb,jb->ib", ends[:, :3], closed.box)
    with np.errstate(divide="ignore", invalid="ignore"):
        kept = np.nan_to_num(again / closed.box, nan=0.0).max(axis=0)
        back = np.einsum("mjb,imb->ijb", ends, sums[:, :3])
        shares = np.nan_to_num(back / sums, nan=0.0).max(axis=(0, 1))
    now = np.einsum("kijb,jb->kib", followed[:, :2, :3], closed.box)
    most = np.maximum(now.max(axis=0), closed.box[:2])
    good = (kept < 0.5) & (shares < 0.5)
    return np.where(good, kept * most, np.inf), np.where(good, sums[:, 3] / (1.0 - shares), np.inf)
