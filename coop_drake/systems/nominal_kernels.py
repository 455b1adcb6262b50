"""The nominal governor in one cell: one step of the nominal motion and of p_G, in one call."""

from __future__ import annotations

import numpy as np

from coop_drake.geometry.polygons import signed_distance
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.jit import compiled
from coop_drake.laws.governor import energy_margin, governor_velocity, tracking_energy
from coop_drake.laws.hand_over import GOVERNOR_GAIN, SMOOTHING, STIFFNESS
from coop_drake.laws.nominal import excursion, limited_step, reach_of, tracked_acceleration
from coop_drake.tree.pose import FloatArray

NOMINAL_SIZE = 6
"""What the nominal governor shows to other blocks: p^ (2) [m], p^' (2) [m/s], Delta E [m^2/s^2], and how far
p_G can go while a report of now is still used [m]."""

NOTHING = np.empty(0)
"""What stands for it where p_G follows the measured position."""

STATE_SIZE = 6
"""Numbers of its state that change with every step: p^ (2) [m], p^' (2) [m/s], p_G (2) [m]."""


@compiled(borrows=True)
def nominal_room(edges: FloatArray, stiffness: float, nominal: FloatArray, governor: FloatArray) -> float:
    """Return d - a of a region, the distance that p_G has left for its next steps [m].

    Args:
        edges: Edges of the region, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        nominal: p^ and p^', shape (4,) or longer.
        governor: p_G, shape (2,) [m].
    """
    return _room_at(signed_distance(edges, governor[0], governor[1]), stiffness, nominal, governor)


@compiled(borrows=True)
def _room_at(distance: float, stiffness: float, nominal: FloatArray, governor: FloatArray) -> float:
    """Return ``nominal_room`` where the distance of p_G to the region's boundary is known."""
    x, y = nominal[0] - governor[0], nominal[1] - governor[1]
    return distance - excursion(x, y, nominal[2], nominal[3], stiffness)


@compiled(borrows=True)
def nominal_margin(edges: FloatArray, stiffness: float, state: FloatArray) -> float:
    """Return Delta E of (15) with p^ in place of p [m^2/s^2].

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        state: p^, p^' and p_G, shape (6,).
    """
    return _margin_at(signed_distance(edges, state[4], state[5]), stiffness, state)


@compiled(borrows=True)
def _margin_at(distance: float, stiffness: float, state: FloatArray) -> float:
    """Return ``nominal_margin`` where the distance of p_G to the region's boundary is known."""
    energy = tracking_energy(state[0] - state[4], state[1] - state[5], state[2], state[3], stiffness)
    return energy_margin(energy, distance, stiffness)


@compiled(borrows=True)
def step_nominal(
    row: FloatArray, edges: FloatArray, flat: FloatArray, field: FloatArray, flow: FloatArray,
    period: float, speed: float, pace: float, state: FloatArray, following: FloatArray,
) -> None:  # fmt: skip
    """Write p^, p^' and p_G a period later.

    Args:
        row: The governor's row, see ``governed_gains``, shape (9,); K does not change at a hand-over.
        edges: Edges of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        flow: What ``nominal_flow`` gives.
        period: T [s].
        speed: Largest speed of p_G [m/s].
        pace: Pace of the funnels' clock [-].
        state: p^, p^' and p_G now, shape (6,).
        following: Receives those of the next sample, shape (6,).
    """
    for i in range(2):
        off, rate, governor = state[i] - state[4 + i], state[2 + i], state[4 + i]
        following[i] = governor + flow[0, 0] * off + flow[0, 1] * rate
        following[2 + i] = flow[1, 0] * off + flow[1, 1] * rate
        following[4 + i] = governor
    stiffness, distance = row[STIFFNESS], signed_distance(edges, state[4], state[5])
    room = _room_at(distance, stiffness, state, state[4:])
    if room > 0.0:
        vx, vy = velocity_in_field(flat, field, state[4], state[5])
        margin = _margin_at(distance, stiffness, state)
        vx, vy = governor_velocity(vx, vy, margin, stiffness, row[GOVERNOR_GAIN], row[SMOOTHING])
        dx, dy = limited_step(pace * vx, pace * vy, period, speed, room)
        following[4] += dx
        following[5] += dy


@compiled(borrows=True)
def accelerate_along(
    gains: FloatArray, object_state: FloatArray, governor: FloatArray, nominal: FloatArray,
    expected: FloatArray, acceleration: FloatArray,
) -> None:  # fmt: skip
    """Write ``tracked_acceleration`` of both coordinates, shape (2,) [m/s^2].

    Args:
        gains: K, zeta, K_t and zeta_t, shape (4,).
        object_state: Pose and twist of the object as measured, shape (6,).
        governor: p_G, shape (2,) [m].
        nominal: p^ and p^' now, shape (4,) or longer.
        expected: p^ and p^' when the object was measured, shape (4,) or longer.
        acceleration: Receives them.
    """
    for i in range(2):
        acceleration[i] = tracked_acceleration(
            object_state[i],
            object_state[3 + i],
            governor[i],
            (nominal[i], nominal[2 + i]),
            (expected[i], expected[2 + i]),
            (gains[0], gains[1], gains[2], gains[3]),
        )


@compiled(borrows=True)
def show_nominal(
    edges: FloatArray, stiffness: float, target: FloatArray, period: float, periods: float, speed: float,
    state: FloatArray, shown: FloatArray,
) -> None:  # fmt: skip
    """Write what ``NOMINAL_SIZE`` lists.

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        target: Where p_G goes in this cell, shape (2,) [m].
        period: T [s].
        periods: For how many periods a report is used [-].
        speed: Largest speed of p_G [m/s].
        state: p^, p^' and p_G, shape (6,).
        shown: Receives the numbers, shape (6,).
    """
    for i in range(4):
        shown[i] = state[i]
    shown[4] = nominal_margin(edges, stiffness, state)
    distance = np.hypot(state[4] - target[0], state[5] - target[1])
    shown[5] = reach_of(distance, period, periods, speed)


@compiled(borrows=True)
def nominal_ready(
    next_edges: FloatArray, next_stiffness: float, nominal: FloatArray, governor: FloatArray
) -> float:
    """Return the margin with which the nominal motion stays in the next region until the switch, at most 1.

    The room d - a there may shrink by twice the way of p_G, until a report of now is no longer used.

    Args:
        next_edges: Edges of the next governed set, shape (edges, 4) [m].
        next_stiffness: K in the next cell [1/s^2].
        nominal: What ``show_nominal`` writes.
        governor: p_G, shape (2,) [m].
    """
    room = nominal_room(next_edges, next_stiffness, nominal, governor)
    needed = 2.0 * nominal[5]
    return (room - needed) / max(abs(room), needed, 1e-9)
