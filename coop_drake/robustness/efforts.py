"""The largest commands and efforts of all axes in a transition.

A robot commands L + q, its law and the pull towards the nominal motion. Where its masses are too large by
epsilon, its efforts are those of (1 + epsilon) (L + q) by the true masses. The pull makes up for what is too
much: with f the middle of a part of the range of 1 + epsilon and h the response of the pull to a unit of
command in one period,

    L_k + q_k = L_k + (f - 1) / f * (sum over j < k of h(k - j) L_j) + noise + answers to all else,

in which L is the same at every place. It lies in an interval that is known for every period, so that the
first two terms are added with their signs. What is left of the disturbances d of ``axis_departure.py`` is
d - |f - 1| |a^|, of any sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.robustness.alarms import axis_errors
from coop_drake.robustness.axis_departure import COMMANDED, OLD, PULL, AxisLoop, Departures
from coop_drake.robustness.couplings import Efforts
from coop_drake.robustness.nominal_axes import AxisSets
from coop_drake.tree.arrays import FloatArray


class LimitedEfforts(NamedTuple):
    """What limits efforts.

    Attributes:
        efforts: What efforts accelerations take in every cell.
        acceleration: Largest acceleration that a robot commands for the object's origin, by the true masses,
            see ``PositionTube`` [m/s^2].
    """

    efforts: Efforts
    acceleration: float


class CommandInflow(NamedTuple):
    """What was commanded, and what else entered the loops, before a cell is entered.

    Attributes:
        past: Of the periods before, the latest last: largest |L|, then for every part of the model's range
            the largest disturbance, shape (1 + parts, axes, memory) [rad/s^2 or m/s^2].
        largest: The same of all times before, shape (1 + parts, axes).
    """

    past: FloatArray
    largest: FloatArray


def nothing_commanded(loop: AxisLoop, axes: int) -> CommandInflow:
    """Return what was commanded before the start, where all axes rest."""
    parts, memory = loop.answers.shape
    past = np.zeros((1 + parts, axes, memory))
    past[1:] = axis_errors(loop.budget, loop.tracking, axes)[:, None]
    return CommandInflow(past, past[..., 0])


def single_noise(loop: AxisLoop, axes: int) -> FloatArray:
    """Return by how much the noise in one robot's command may exceed that in the mean's, (axes,) [rad/s^2].

    All robots measure the object's angle, each its own joints.
    """
    tracking, budget, noise = loop.tracking, loop.budget, np.zeros(axes)
    direct = tracking.stiffness * budget.angle_noise + tracking.damping * budget.rate_noise
    noise[0] = (budget.single_noise - 1.0) * direct
    return noise


def largest_commands(
    loop: AxisLoop,
    laws: FloatArray,
    nominal: FloatArray,
    entered: FloatArray,
    before: CommandInflow,
    leaving: int,
) -> tuple[FloatArray, CommandInflow]:
    """Return the largest (1 + epsilon) |L + q| of every period, and what the next transition needs.

    Args:
        loop: The loop of all axes.
        laws: Least and largest L of every period, the last for ever, shape (2, periods + 1, axes).
        nominal: Largest |a^| of every period, likewise, shape (periods + 1, axes).
        entered: d of every period and part of the model's range, shape (parts, axes, periods + 1).
        before: What was commanded before this transition.
        leaving: The first sample at which the cell can be left.

    Returns:
        Shape (periods + 1, axes), the last one for ever [rad/s^2 or m/s^2]; and what the next one needs.
    """
    memory = loop.answers.shape[1]
    rest = entered - np.abs(np.array(loop.factors) - 1.0)[:, None, None] * nominal.T
    sizes = np.concatenate([np.abs(laws).max(axis=0).T[None], rest])
    sizes = np.concatenate([before.past, sizes], axis=2)
    sizes[..., -1] = sizes[..., -1 - memory :].max(axis=2)
    lower, upper = (
        np.concatenate([sign * before.past[0], one.T], axis=1)
        for sign, one in zip((-1.0, 1.0), laws, strict=True)
    )
    lower[:, -1], upper[:, -1] = -sizes[0, :, -1], sizes[0, :, -1]
    largest = np.maximum(before.largest, sizes[..., memory:].max(axis=2))
    noises = loop.noises(len(lower))[:, :, PULL].T + single_noise(loop, len(lower))
    found = np.zeros(laws.shape[1:])
    for p, factor in enumerate(loop.factors):
        pull = (factor - 1.0) / factor * loop.answers[p]
        up, down = np.maximum(pull, 0.0), np.minimum(pull, 0.0)
        late = abs(factor - 1.0) / factor * (loop.sums[p, PULL, COMMANDED] - np.abs(loop.answers[p]).sum())
        high = upper[:, memory:] + _answered(upper, up) + _answered(lower, down)
        low = lower[:, memory:] + _answered(lower, up) + _answered(upper, down)
        others = _answered(sizes[1 + p], loop.kicks[p, PULL])
        old = late * largest[0] + loop.sums[p, PULL, OLD] * largest[1 + p]
        command = np.maximum(high, -low) + others + (noises[p] + old)[:, None]
        found = np.maximum(found, (factor + loop.rest) * command.T)
    highest = np.maximum.accumulate(sizes[..., ::-1], axis=2)[..., ::-1]
    first = min(leaving, laws.shape[1])
    return found, CommandInflow(highest[..., first : first + memory].copy(), largest)


def _answered(sizes: FloatArray, weights: FloatArray) -> FloatArray:
    """Return weighted sums of the periods before each one, the last one for ever, (axes, periods + 1).

    Args:
        sizes: Of the periods before the transition, of its own, and for ever, (axes, memory + periods + 1).
        weights: The oldest first, shape (memory,).
    """
    windows = np.lib.stride_tricks.sliding_window_view(sizes[:, :-1], len(weights), axis=1)
    return np.concatenate([windows[:, :-1] @ weights, sizes[:, -1:] * weights.sum()], axis=1)


def transition_efforts(
    k: int,
    limited: LimitedEfforts,
    every: Sequence[AxisSets],
    found: Departures,
    loop: AxisLoop,
    before: CommandInflow,
    leaving: int,
    spare: float = 0.0,
) -> tuple[FloatArray, FloatArray, CommandInflow]:
    """Return the largest efforts that robots are told to give in a transition.

    Robots compute them by masses that are too large by the model's error at most, from accelerations that
    they command and from nominal rates, ``ahead`` of now. They are bounds up to rates of ``QUICKEST``.

    Args:
        k: The transition.
        limited: What limits efforts.
        every: The sets of all axes.
        found: Their departures.
        loop: Their loop.
        before: What was commanded before this transition.
        leaving: The first sample at which the cell can be left.
        spare: Fraction by which commands are enlarged [-].

    Returns:
        The efforts, shape (efforts,) [N, N m]; the largest nominal rates for which they are computed, shape
        (axes,) [rad/s or m/s]; and what has been commanded when the next one begins.
    """
    budget, periods = loop.budget, len(found.pull) - 1
    moving = np.stack([one.moving(periods, budget.period) for one in every], axis=-1)
    rates = moving[1] + max(budget.ahead - budget.period, 0.0) * moving[0]
    laws = np.stack([one.commands(periods) for one in every], axis=-1)
    commands, commanded = largest_commands(loop, laws, moving[0], found.entered.T, before, leaving)
    of, believed = limited.efforts, 1.0 + budget.model_error
    turning = np.einsum("tj,ejk,tk->te", rates, of.rates[k], rates)
    turned = (1.0 + spare) * commands @ of.axes[k].T + believed * turning + rates @ of.damping.T
    effort: FloatArray = limited.acceleration * of.push[k] + turned.max(axis=0)
    return effort, rates.max(axis=0), commanded


def even_efforts(
    limited: LimitedEfforts, budget: Budget, moving: tuple[float, float], pulls: FloatArray
) -> FloatArray:
    """Return the largest efforts in every cell where axes move evenly, shape (cells, efforts) [N, N m].

    Args:
        limited: What limits them.
        budget: The budget.
        moving: Largest nominal rate and acceleration of every axis.
        pulls: Largest pull towards the nominal motion in every cell, shape (cells, axes).
    """
    of, efforts = limited.efforts, []
    rates = np.full(pulls.shape[1], moving[0] + max(budget.ahead - budget.period, 0.0) * moving[1])
    for k, pull in enumerate(pulls):
        turning = of.axes[k] @ (moving[1] + pull) + np.einsum("j,ejk,k->e", rates, of.rates[k], rates)
        moved = limited.acceleration * of.push[k] + of.damping @ rates
        efforts.append((1.0 + budget.model_error) * turning + moved)
    return np.array(efforts)
