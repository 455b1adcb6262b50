"""Carries out a plan without Drake: a point mass behind its governor, double integrators for the axes.

The corrected law makes every acceleration exactly the desired one: this predicts the closed loop.
"""

from dataclasses import dataclass

import numpy as np
from shapely import Point

from coop_drake import laws
from coop_drake.geometry import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap, VelocityField
from coop_drake.laws.axis_table import axis_table, first_jumps
from coop_drake.laws.ppc import fading, governed_gains
from coop_drake.systems.kernels import ready_conditions
from tests.support.readiness import margin_of as margin_of_robot


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
            slowdown_radius=laws.slowdown_radius(1.0, transition.gains.governor_gain),
        )
        for cell, transition in zip(plan.cells, plan.transitions, strict=True)
    ]


def straight_fields(plan):
    """Fields for convex cells: straight to the target, slower within a third of the path's clearance."""

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
    conditions = ready_conditions(
        [axis_table(plan.funnel(k), transition.gains) for k, transition in enumerate(plan.transitions)],
        [distance.edges for distance in distances],
        [plan.governor_row(k) for k in range(len(plan.cells))],
        [transition.inradius for transition in plan.transitions],
        plan.transitions[-1].target,
        position_tolerance,
    )
    seen = {"energy": np.inf, "cell": np.inf, "gap": np.inf, "axis": 0.0, "force": 0.0}
    durations, hand_overs, stuck = [], [], None
    jumps = first_jumps(axis_table(plan.funnel(0), plan.transitions[0].gains), plan.start[2:])
    for index in range(len(plan.cells)):
        state, elapsed, left = _play(
            plan,
            index,
            state,
            jumps,
            fields[index],
            distances,
            conditions[index],
            seen,
            (step, time_limit),
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


def _play(plan, index, state, jumps, field, distances, conditions, seen, limits):
    step, time_limit = limits
    transition, cell, distance, funnel = (
        plan.transitions[index],
        plan.cells[index],
        distances[index],
        plan.funnel(index),
    )
    gains, n, row = transition.gains, len(cell.lower), plan.governor_row(index)

    def margin_of(z, t):
        stiffness = governed_gains(row, t)[0]
        energy = laws.tracking_energy(*(z[:2] - z[4:6]), *z[2:4], stiffness)
        return laws.energy_margin(energy, distance(z[4:6]), stiffness)

    def rates(z, t):
        stiffness, damping, gain = governed_gains(row, t)
        force = laws.governed_acceleration(z[:2], z[2:4], z[4:6], stiffness, damping)
        governor = laws.governor_velocity(*field(z[4:6]), margin_of(z, t), stiffness, gain, gains.smoothing)
        axes = laws.funnel_acceleration(z[6 : 6 + n], z[6 + n :], funnel, t, gains)
        axes += fading(t, gains.hand_over_time) * jumps
        return np.concatenate([z[2:4], force, governor, z[6 + n :], axes])

    def leaves(z, t):
        return margin_of_robot(conditions, z[:2], z[2:4], z[4:6], z[6 : 6 + n], z[6 + n :], t) >= 0.0

    for k in range(round(time_limit / step)):
        t = k * step
        if leaves(state, t):
            if index + 1 < len(plan.cells):
                own, following = funnel, plan.funnel(index + 1)
                axes = state[6 : 6 + n], state[6 + n :]
                jumps[:] = laws.funnel_acceleration(*axes, own, t, gains)
                jumps -= laws.funnel_acceleration(*axes, following, 0.0, plan.transitions[index + 1].gains)
            return state, t, True
        k1 = rates(state, t)
        seen["energy"] = min(seen["energy"], margin_of(state, t))
        seen["cell"] = min(seen["cell"], distance(state[:2]))
        seen["gap"] = min(seen["gap"], *(state[6 : 6 + n] - cell.lower), *(cell.upper - state[6 : 6 + n]))
        seen["axis"] = max(seen["axis"], float(np.abs(k1[6 + n :]).max()))
        seen["force"] = max(seen["force"], float(np.hypot(*k1[2:4])))
        k2 = rates(state + 0.5 * step * k1, t + 0.5 * step)
        k3 = rates(state + 0.5 * step * k2, t + 0.5 * step)
        k4 = rates(state + step * k3, t + step)
        state = state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state, time_limit, False
