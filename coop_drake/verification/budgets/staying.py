"""The boxes in which axes stay for ever near the middle of their closed funnels."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.tubes import Disturbed

ATTEMPTS, GROWTH, LENGTH = 60, 1.03, 12.0
"""Number of boxes tried, factor between them, and length of a response in its slowest time constant [-]."""


def staying(disturbed: Disturbed, time: FloatArray, box: FloatArray) -> FloatArray:
    """Return distance, largest |acceleration|, largest |x| and |v|, and |x| at the end, shape (5, b).

    Departures are from the middle of the goal interval. A box is shown to be reached again from itself, so
    that it holds the axis for ever; the distance is negative where none is found.

    Args:
        disturbed: The axes.
        time: From when on, shape (b,) [s].
        box: Departures of x, v and the acceleration then, shape (3, b).
    """
    count = box.shape[1]
    found = np.full((5, count), np.inf)
    found[0] = -1.0
    left, box, most = np.arange(count), box.copy(), GROWTH * box[:2]
    for _ in range(ATTEMPTS):
        if not left.size:
            break
        some = Disturbed(
            disturbed.axes[left], disturbed.budget, disturbed.factor[left], disturbed.error[left]
        )
        reached, fastest = _once(some, time[left], box[:, left], most[:, left])
        kept = (reached[:2] <= most[:, left]).all(axis=0) & (reached[2:] <= box[:, left]).all(axis=0)
        fastest = np.maximum(fastest, box[2, left])
        T, half = disturbed.budget.period, 0.5 * (some.axes.goal[1] - some.axes.goal[0])
        distance = half - most[0, left] - 0.125 * T * T * fastest
        result = np.array([distance, fastest, *most[:, left], reached[2]])
        found[:, left[kept]] = result[:, kept]
        alive = ~kept & (reached[0] < 10.0 * half)
        box[:, left] = np.maximum(
            box[:, left], np.where(reached[2:] > box[:, left], GROWTH * reached[2:], 0.0)
        )
        most[:, left] = np.maximum(most[:, left], GROWTH * reached[:2])
        left = left[alive & (most[0, left] < half)]
    return found


def _once(
    some: Disturbed, time: FloatArray, box: FloatArray, most: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return largest x and v at all samples, x, v and a at the last ones, shape (5, b); largest |command|."""
    budget, axes, delay = some.budget, some.axes, some.delay
    reach, fast = most[0] + budget.angle_noise, most[1] + budget.rate_noise
    middle = 0.5 * (axes.goal[0] + axes.goal[1])
    _, slope, by_rate, rest, _ = some.command(time, middle, reach, np.zeros_like(reach), fast)
    k1, k1_rate = axes.ramp(time)
    missing = axes.k1 - k1
    growing = (axes.k2 * missing + k1_rate) * reach + missing * (1.0 - np.log(axes.share)) * fast
    rest = rest + some.factor * growing
    largest = np.abs(slope) * reach + np.abs(by_rate) * fast + rest
    errors = some.errors(largest)
    size = np.abs(slope) * budget.angle_noise + np.abs(by_rate) * budget.rate_noise + rest + errors
    slowest = np.minimum(np.abs(slope / by_rate), 0.5 * np.abs(by_rate))
    steps = int(np.ceil(LENGTH / (slowest.min() * budget.period))) + 2 * delay + 2
    reached = _respond(some, (slope, by_rate), box, (size, largest + errors), steps)
    return reached, largest + errors


def _respond(
    some: Disturbed,
    slopes: tuple[FloatArray, FloatArray],
    box: FloatArray,
    sizes: tuple[FloatArray, FloatArray],
    steps: int,
) -> FloatArray:
    matrix, enters = some.carry
    delay, count = some.delay, box.shape[1]
    state = np.zeros((3, 4, count))
    state[0, 0], state[1, 1], state[2, 2] = 1.0, 1.0, 1.0
    states, sums = [state], [np.zeros((3, count))]
    everywhere, ends = box[:2].copy(), np.zeros((3, count))
    for k in range(steps):
        command = np.zeros((4, count))
        if k >= delay:
            command = slopes[0] * states[k - delay][0] + slopes[1] * states[k - delay][1]
        if k == 0:
            command[3] += 1.0
        states.append(np.tensordot(matrix, states[-1], 1) + enters[:, None, None] * command)
        sums.append(sums[-1] + np.abs(states[-1][:, 3]))
        now = sizes[0] * sums[-1] + (sizes[1] - sizes[0]) * (sums[-1] - sums[max(k + 1 - delay, 0)])
        now = now + np.einsum("ijk,jk->ik", np.abs(states[-1][:, :3]), box)
        everywhere = np.maximum(everywhere, now[:2])
        if k + 1 >= steps - delay:
            ends = np.maximum(ends, now)
    return np.concatenate([everywhere, ends])
