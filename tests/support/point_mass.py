"""Carries out a plan without Drake: a point mass behind its governor, double integrators for the axes.

The corrected law makes every acceleration exactly the desired one: this predicts the closed loop.
"""

from dataclasses import dataclass

import numpy as np
from shapely import Point

from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.geometry import BoundaryDistance
from coop_drake.laws import (
    Funnel,
    arrival_margin,
    energy_margin,
    funnel_acceleration,
    governed_acceleration,
    governor_velocity,
    ready_margin,
    slowdown_radius,
    tracking_energy,
)


@dataclass(frozen=True)
class Transport:
    """How a plan went: duration of every transition [s], extremes over all steps, the final state.

    ``stuck`` is the index of a cell that was not left within the time limit, None where the goal was reached;
    ``hand_overs`` is the state (p, p', p_G, axes, their rates) at the end of every transition.
    """

    durations: np.ndarray
    stuck: int | None
    least_energy_margin: float
    least_cell_clearance: float
    least_funnel_gap: float
    peak_axis_acceleration: float
    peak_acceleration: float
    position: np.ndarray
    axes: np.ndarray
    hand_overs: tuple[np.ndarray, ...]


def build_fields(plan, *, tolerance=1e-4):
    """Velocity field of every transition, from its harmonic map."""
    return [
        VelocityField(
            HarmonicMap(cell.tidied, Point(transition.target), tolerance=tolerance),
            slowdown_radius=slowdown_radius(1.0, governor_gain=transition.gains.governor_gain),
        )
        for cell, transition in zip(plan.cells, plan.transitions, strict=True)
    ]


def straight_fields(plan):
    """Stand-ins for convex cells: straight to the target, slowing down within a third of the neck."""

    def field(transition):
        radius = transition.neck / 3.0

        def velocity(point):
            error = transition.target - point
            return error / max(float(np.hypot(*error)), radius)

        return velocity

    return [field(transition) for transition in plan.transitions]


def carry_out(plan, fields, *, position_tolerance=0.01, step=0.004, time_limit=60.0):
    """Integrate a plan with RK4 and advance whenever the ready margin is not negative.

    Args:
        plan: The plan.
        fields: One callable per transition, point (2,) -> velocity (2,).
        position_tolerance: Of the goal [m].
        step: Step of the integration, also the supervisor's period [s].
        time_limit: Longest time in one cell [s].
    """
    n = len(plan.joint_names) + 1
    state = np.concatenate([plan.start[:2], np.zeros(2), plan.start[:2], plan.start[2:], np.zeros(n)])
    distances = [BoundaryDistance(cell.tidied) for cell in plan.cells]
    funnels = [
        _funnel(cell, transition) for cell, transition in zip(plan.cells, plan.transitions, strict=True)
    ]
    seen = {"energy": np.inf, "cell": np.inf, "gap": np.inf, "axis": 0.0, "force": 0.0}
    durations, hand_overs, stuck = [], [], None
    for index in range(len(plan.cells)):
        state, elapsed, left = _play(
            plan,
            index,
            state,
            fields[index],
            distances,
            funnels,
            seen,
            (position_tolerance, step, time_limit),
        )
        durations.append(elapsed)
        hand_overs.append(state)
        if not left:
            stuck = index
            break
    return Transport(
        np.array(durations), stuck, seen["energy"], seen["cell"], seen["gap"], seen["axis"], seen["force"],
        state[:2], state[6 : 6 + n], tuple(hand_overs),
    )  # fmt: skip


def _funnel(cell, transition):
    gains = transition.gains
    return Funnel(
        cell.lower, cell.upper, transition.goal_lower, transition.goal_upper, gains.decay_rate, gains.funnel
    )


def _play(plan, index, state, field, distances, funnels, seen, limits):
    position_tolerance, step, time_limit = limits
    transition, cell, distance, funnel = (
        plan.transitions[index],
        plan.cells[index],
        distances[index],
        funnels[index],
    )
    gains, n = transition.gains, len(cell.lower)

    def margin_of(z):
        energy = tracking_energy(z[:2], z[2:4], z[4:6], stiffness=gains.stiffness)
        return energy_margin(energy, distance(z[4:6]), stiffness=gains.stiffness)

    def rates(z, t):
        force = governed_acceleration(z[:2], z[2:4], z[4:6], stiffness=gains.stiffness, damping=gains.damping)
        governor = governor_velocity(
            field(z[4:6]), margin_of(z), stiffness=gains.stiffness, governor_gain=gains.governor_gain,
            smoothing=gains.smoothing,
        )  # fmt: skip
        axes = funnel_acceleration(
            z[6 : 6 + n], z[6 + n :], funnel, t, log_gain=gains.log_gain, position_gain=gains.position_gain,
            rate_gain=gains.rate_gain,
        )  # fmt: skip
        return np.concatenate([z[2:4], force, governor, z[6 + n :], axes])

    def leaves(z):
        common = {
            "position": z[:2], "velocity": z[2:4], "axis_position": z[6 : 6 + n], "axis_rate": z[6 + n :],
            "goal_lower": transition.goal_lower, "goal_upper": transition.goal_upper,
        }  # fmt: skip
        if index + 1 == len(plan.cells):
            return (
                arrival_margin(**common, target=transition.target, position_tolerance=position_tolerance)
                >= 0.0
            )
        return (
            ready_margin(
                **common, governor_position=z[4:6], next_clearance=distances[index + 1](z[4:6]),
                inradius=transition.inradius, next_funnel=funnels[index + 1],
                next_gains=plan.transitions[index + 1].gains,
            ) >= 0.0
        )  # fmt: skip

    for k in range(round(time_limit / step)):
        if leaves(state):
            return state, k * step, True
        t = k * step
        k1 = rates(state, t)
        seen["energy"] = min(seen["energy"], margin_of(state))
        seen["cell"] = min(seen["cell"], distance(state[:2]))
        seen["gap"] = min(seen["gap"], *(state[6 : 6 + n] - cell.lower), *(cell.upper - state[6 : 6 + n]))
        seen["axis"] = max(seen["axis"], float(np.abs(k1[6 + n :]).max()))
        seen["force"] = max(seen["force"], float(np.hypot(*k1[2:4])))
        k2 = rates(state + 0.5 * step * k1, t + 0.5 * step)
        k3 = rates(state + 0.5 * step * k2, t + 0.5 * step)
        k4 = rates(state + step * k3, t + step)
        state = state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state, time_limit, False
