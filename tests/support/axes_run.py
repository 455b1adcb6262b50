"""Plays a chain of funnels on double integrators: the angles and joints, with the position frozen."""

from dataclasses import dataclass

import numpy as np

from coop_drake.laws import Funnel, funnel_acceleration, funnel_bounds, transition_gains
from coop_drake.laws.axis_table import axis_table
from coop_drake.laws.readiness import axis_ready, interval_margin, rest_margin


@dataclass(frozen=True)
class AxesRun:
    """What was seen: per transition its duration [s], per axis its peak, over all steps the narrowest gap."""

    durations: np.ndarray
    peak_acceleration: np.ndarray
    bound_margin: float
    position: np.ndarray
    rate: np.ndarray


def play(transitions, gain_set, *, start, step=1e-3, time_limit=30.0, gated=True, neck=0.2):
    """Integrate with RK4 and advance once the ready margin is not negative; raise if a cell is never left.

    Args:
        transitions: Dictionaries as ``table_1.table_transitions`` makes them.
        gain_set: FixedGains or ScheduledGains.
        start: Initial axes, at rest.
        step: Step of the integration [s].
        time_limit: Longest time in one cell [s].
        gated: Whether the energy gate of the next funnel must open too.
        neck: Passed to the schedule, of no influence on the axes.
    """
    gains = [transition_gains(gain_set, clearance=neck, **t) for t in transitions]
    funnels = [
        Funnel(t["slice_lower"], t["slice_upper"], t["goal_lower"], t["goal_upper"], g.decay_rate, g.funnel)
        for t, g in zip(transitions, gains, strict=True)
    ]
    tables = [axis_table(funnel, gain) for funnel, gain in zip(funnels, gains, strict=True)]
    x, v = np.array(start, dtype=float), np.zeros(len(start))
    durations, peak, bound_margin = [], np.zeros(len(x)), np.inf
    for i, (transition, gain, funnel) in enumerate(zip(transitions, gains, funnels, strict=True)):

        def law(x, v, t, funnel=funnel, gain=gain):
            return funnel_acceleration(x, v, funnel, t, gain)

        last = i + 1 == len(transitions)
        for k in range(round(time_limit / step)):
            t = k * step
            a1 = law(x, v, t)
            peak = np.maximum(peak, np.abs(a1))
            a2 = law(x + 0.5 * step * v, v + 0.5 * step * a1, t + 0.5 * step)
            a3 = law(x + 0.5 * step * v + 0.25 * step**2 * a1, v + 0.5 * step * a2, t + 0.5 * step)
            a4 = law(x + step * v + 0.5 * step**2 * a2, v + step * a3, t + step)
            x, v = (
                x + step * v + step**2 / 6 * (a1 + a2 + a3),
                v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4),
            )
            bounds = funnel_bounds(funnel, t + step)
            bound_margin = min(bound_margin, (x - bounds.lower).min(), (bounds.upper - x).min())
            margin = min(map(interval_margin, x, transition["goal_lower"], transition["goal_upper"]))
            if last:
                margin = min(margin, *map(rest_margin, v))
            elif gated and margin >= 0.0:
                margin = min(map(axis_ready, tables[i], tables[i + 1], x, v))
            if margin >= 0.0:
                durations.append(t + step)
                break
        else:
            raise AssertionError(f"transition {i} was not left within {time_limit} s, margin {margin}")
    return AxesRun(np.array(durations), peak, float(bound_margin), x, v)
