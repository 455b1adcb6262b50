"""What moves with a configuration: object, bases, joints, and centres of mass; and their limits.

A base gives the force that accelerates itself, its arm and its share of the load. Divided by their mass it is
the acceleration of their common centre of mass, a sum of turned arms as the position of a base is.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, inf, sin
from typing import NamedTuple

import numpy as np

from coop_drake.answers.motion import GRAVITY
from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.jit import compiled
from coop_drake.laws.motion import motion_at
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import Bodies, ComponentTree


class Chains(NamedTuple):
    """Where points are: p_B = p + sum over links of R(phi_k) (c_k + q_k d_k), phi_k linear in the axes.

    They are the bases, then the centres of mass of what each base moves, where masses are known.

    Attributes:
        bases: Number of bases.
        turns: What a unit of every axis (theta, q...) adds to phi_k, shape (points, links, 1 + n) [-].
        offsets: phi_k where all axes are zero, shape (points, links) [rad].
        arms: c_k, shape (points, links, 2) [m].
        slides: Which axis slides the arm, -1 for none, shape (points, links).
        directions: d_k, shape (points, links, 2) [-].
        links: Number of links of every point, shape (points,).
    """

    bases: int
    turns: FloatArray
    offsets: FloatArray
    arms: FloatArray
    slides: IntArray
    directions: FloatArray
    links: IntArray


def motion_limits(limits: TeamLimits) -> FloatArray:
    """Return the largest velocity, acceleration and jerk of what ``follow`` knows, shape (P, 3).

    Args:
        limits: What models and scenario state; where they state nothing, usual ones count.
    """
    kept = limits.with_defaults()
    forces, none = largest_forces(limits), np.full(len(limits.base_components), inf)
    rows: list[tuple[FloatArray, ...]] = [
        (np.array([inf]), kept.object_acceleration, np.array([inf])),
        (kept.base_speeds, kept.base_accelerations, kept.base_jerks),
        (kept.turn_rates, kept.turn_accelerations, none),
        (kept.joint_rates, kept.joint_accelerations, np.full(len(kept.joint_rates), inf)),
        (none[: len(forces)], forces / _masses(limits), none[: len(forces)]),
    ]
    return np.concatenate([np.column_stack(columns) for columns in rows])


def largest_forces(limits: TeamLimits) -> FloatArray:
    """Return the largest force of every base: by friction, or by its drives if that is less, (N,) [N].

    Empty where masses are not known.
    """
    masses, kept = _masses(limits), limits.with_defaults()
    bases = slice(len(masses))
    return np.minimum(GRAVITY * masses * kept.frictions[bases], kept.base_forces[bases])


def _masses(limits: TeamLimits) -> FloatArray:
    """Return the mass that every base moves, empty where it is not known, shape (N,) [kg]."""
    moved = _moved(limits.bodies, len(limits.base_components))
    return np.array([sum(mass for _, mass, *_ in bodies) for bodies in moved])


def _moved(bodies: Bodies, robots: int) -> list[list[tuple[float, ...]]]:
    """Return what each robot's base moves, none where nothing is known."""
    found = [[body for body in bodies if body[5] == robot] for robot in range(robots)]
    return found if all(found) else []


_Link = tuple[FloatArray, float, FloatArray, int, FloatArray]


def base_chains(
    tree: ComponentTree, bases: list[tuple[int, tuple[float, float]]], bodies: Bodies = ()
) -> Chains:
    """Return where points of components are: the bases' origins, and the centres of mass of what bases move.

    Args:
        tree: The team.
        bases: A component, and a point in its frame [m], for each base.
        bodies: What the bases move.
    """
    axes, found = 1 + len(tree.joints), [_links(tree, *base) for base in bases]
    for moved in _moved(bodies, len(bases)):
        whole, summed = sum(mass for _, mass, *_ in moved), dict[tuple[float, ...], _Link]()
        for component, mass, x, y, *_ in moved:
            for turn, offset, arm, slide, direction in _links(tree, int(component), (x, y)):
                key, share = (*turn.tolist(), offset, slide), mass / whole
                old = summed.get(key, (turn, offset, np.zeros(2), slide, np.zeros(2)))
                summed[key] = (turn, offset, old[2] + share * arm, slide, old[4] + share * direction)
        found.append(list(summed.values()))
    count = max((len(links) for links in found), default=1)
    chains = Chains(
        len(bases), np.zeros((len(found), count, axes)), np.zeros((len(found), count)),
        np.zeros((len(found), count, 2)), np.full((len(found), count), -1), np.zeros((len(found), count, 2)),
        np.array([len(links) for links in found]),
    )  # fmt: skip
    for point, links in enumerate(found):
        for k, (turn, offset, arm, slide, direction) in enumerate(links):
            chains.turns[point, k], chains.offsets[point, k], chains.arms[point, k] = turn, offset, arm
            chains.slides[point, k], chains.directions[point, k] = slide, direction
    return chains


def _links(tree: ComponentTree, component: int, point: tuple[float, float]) -> list[_Link]:
    """Return phi (by the axes, and where they are zero), c, the sliding axis and d of a point's links."""
    turn, offset, links = np.zeros(1 + len(tree.joints)), 0.0, []
    turn[0] = 1.0
    for index in reversed(tree.ancestors[component][:-1]):
        joint = tree.components[index].joint
        assert joint is not None  # as in every component but the object's
        arm = np.array([joint.X_PJ.x, joint.X_PJ.y])
        links.append((turn.copy(), offset, arm, -1, np.zeros(2)))
        offset += joint.X_PJ.angle
        if joint.kind == "revolute":
            turn[1 + joint.index] += joint.sign
        else:
            links.append((turn.copy(), offset, np.zeros(2), 1 + joint.index, np.array(joint.axis)))
    return [*links, (turn.copy(), offset, np.array(point), -1, np.zeros(2))]


def team_chains(problem: PlanningProblem) -> Chains:
    """Return where the bases' origins and the centres of mass of what bases move are."""
    of = problem.limits
    return base_chains(problem.tree, list(zip(of.base_components, of.base_points, strict=True)), of.bodies)


def base_places(chains: Chains, motion: FloatArray) -> FloatArray:
    """Return the positions and angles of all bases, shape (bases, samples, 3) [m, rad].

    Args:
        chains: The bases.
        motion: Configurations, shape (samples, 3 + n).
    """
    found, axes = np.zeros((chains.bases, len(motion), 3)), motion[:, 2:]
    for base, links in enumerate(chains.links[: chains.bases]):
        found[base, :, :2] = motion[:, :2]
        for k in range(links):
            angle = chains.offsets[base, k] + axes @ chains.turns[base, k]
            slide = chains.slides[base, k]
            length = axes[:, slide] if slide >= 0 else np.zeros(len(motion))
            x, y = (chains.arms[base, k, :, None] + chains.directions[base, k, :, None] * length).tolist()
            c, s = np.cos(angle), np.sin(angle)
            found[base, :, 0] += c * x - s * y
            found[base, :, 1] += s * x + c * y
            found[base, :, 2] = angle
    return found


def times_at_limits(chains: Chains, limits: FloatArray, points: FloatArray) -> FloatArray:
    """Return the shortest times between configurations at the limits of speed, shape (samples - 1,) [s].

    Args:
        chains: The bases.
        limits: See ``motion_limits``.
        points: Configurations, shape (samples, 3 + n).
    """
    bases, steps = np.diff(base_places(chains, points), axis=1), np.diff(points, axis=0)
    moved = [np.hypot(bases[..., 0], bases[..., 1]), np.abs(bases[..., 2]), np.abs(steps[:, 3:].T)]
    shares = np.concatenate(moved)
    seconds: FloatArray = (shares / limits[1 : 1 + len(shares), :1]).max(axis=0)
    return seconds


FAR_ABOVE = 2.0
"""Largest limit of a slow team in its unit of time, over the usual one, or over its own [-]."""


def slow_limits(
    chains: Chains, limits: FloatArray, usual: FloatArray, ways: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """Return how many times as long ways take within limits as within usual ones, and limits in this unit.

    The factor is at least 1. Alone and from rest to rest, a way of length s takes at least s / v,
    2 sqrt(s / a) and (32 s / j)^(1/3). Limits in a longer unit of time are larger numbers. Those that would
    be far above the usual ones are ``FAR_ABOVE`` times these, which hardly matters where another is as slow.

    Args:
        chains: The bases.
        limits: Largest velocities, accelerations and jerks, see ``motion_limits``, shape (P, 3).
        usual: The usual ones, of the same shape.
        ways: Configurations along them, shape (samples, 3 + n) each.

    Returns:
        The factor [-], and limits in that many seconds, shape (P, 3).
    """
    lengths = []
    for way in ways:
        bases, steps = np.diff(base_places(chains, way), axis=1), np.abs(np.diff(way, axis=0))
        moved = np.hypot(bases[..., 0], bases[..., 1]).sum(axis=1)
        turned, others = np.abs(bases[..., 2]).sum(axis=1), steps[:, 3:].sum(axis=0)
        lengths.append([np.hypot(*steps[:, :2].T).sum(), *moved, *turned, *others, *moved])
    found = np.array(lengths)[:, : len(limits)]
    slow, quick = (
        np.maximum.reduce([found / v, 2.0 * np.sqrt(found / a), np.cbrt(32.0 * found / j)]).max(axis=1).sum()
        for v, a, j in (limits.T, usual.T)
    )
    if not slow > quick:
        return 1.0, limits
    unit = float(slow / quick)
    largest = FAR_ABOVE * np.maximum(usual, limits)
    return unit, np.minimum(limits * np.power(unit, [1.0, 2.0, 3.0]), largest)


# What moves, with derivatives.


@compiled(borrows=True)
def follow(
    chains: Chains, point: int, x: FloatArray, v: FloatArray, a: FloatArray, moved: FloatArray,
    by: FloatArray, derive: bool,
) -> int:  # fmt: skip
    """Write velocity and acceleration of a point, and their derivatives by z, z' and z''.

    Args:
        chains: The bases.
        point: 0 for the object, then the bases, their angles, the joints, and the centres of mass of what
            bases move.
        x: z, shape (3 + n,).
        v: z'.
        a: z''.
        moved: Receives V and A, shape (2, 2); of one that is a number its first entry counts.
        by: Receives dV/dz, dV/dz' (which is dA/dz''), dA/dz and dA/dz', shape (4, 2, 3 + n).
        derive: Whether these are wanted.

    Returns:
        Of how many numbers V and A consist.
    """
    bases, d, chain = chains.bases, x.size, point - 1
    for i in range(4 if derive else 0):
        for j in range(2):
            for k in range(d):
                by[i, j, k] = 0.0
    if point > 2 * bases + d - 3:
        chain -= bases + d - 3
    elif point > 2 * bases:
        axis = point - 2 * bases + 2
        moved[0, 0], moved[1, 0], by[1, 0, axis] = v[axis], a[axis], 1.0
        return 1
    elif point > bases:
        base = point - bases - 1
        last = chains.links[base] - 1
        moved[0, 0] = moved[1, 0] = 0.0
        for k in range(2, d):
            turn = chains.turns[base, last, k - 2]
            moved[0, 0] += turn * v[k]
            moved[1, 0] += turn * a[k]
            by[1, 0, k] = turn
        return 1
    for i in range(2):
        moved[0, i], moved[1, i], by[1, i, i] = v[i], a[i], 1.0
    if point == 0:
        return 2
    for link in range(chains.links[chain]):
        phi, w, turning = chains.offsets[chain, link], 0.0, 0.0
        for k in range(2, d):
            turn = chains.turns[chain, link, k - 2]
            phi += turn * x[k]
            w += turn * v[k]
            turning += turn * a[k]
        c, s, slide = cos(phi), sin(phi), chains.slides[chain, link] + 2
        dx, dy = chains.directions[chain, link, 0], chains.directions[chain, link, 1]
        dx, dy = c * dx - s * dy, s * dx + c * dy
        length, rate, push = (x[slide], v[slide], a[slide]) if slide >= 2 else (0.0, 0.0, 0.0)
        ax, ay = chains.arms[chain, link, 0], chains.arms[chain, link, 1]
        ux, uy = c * ax - s * ay + length * dx, s * ax + c * ay + length * dy
        # The arm u, its direction d of sliding, and both turned by a right angle: (-uy, ux), (-dy, dx).
        moved[0, 0] += -w * uy + rate * dx
        moved[0, 1] += w * ux + rate * dy
        moved[1, 0] += -turning * uy - w * w * ux - 2.0 * w * rate * dy + push * dx
        moved[1, 1] += turning * ux - w * w * uy + 2.0 * w * rate * dx + push * dy
        for k in range(2, d if derive else 0):
            turn = chains.turns[chain, link, k - 2]
            if turn != 0.0:
                by[0, 0, k] += turn * (-w * ux - rate * dy)
                by[0, 1, k] += turn * (-w * uy + rate * dx)
                by[1, 0, k] -= turn * uy
                by[1, 1, k] += turn * ux
                by[2, 0, k] += turn * (-turning * ux + w * w * uy - 2.0 * w * rate * dx - push * dy)
                by[2, 1, k] += turn * (-turning * uy - w * w * ux - 2.0 * w * rate * dy + push * dx)
                by[3, 0, k] += turn * (-2.0 * w * ux - 2.0 * rate * dy)
                by[3, 1, k] += turn * (-2.0 * w * uy + 2.0 * rate * dx)
        if slide >= 2 and derive:
            by[0, 0, slide] -= w * dy
            by[0, 1, slide] += w * dx
            by[1, 0, slide] += dx
            by[1, 1, slide] += dy
            by[2, 0, slide] += -turning * dy - w * w * dx
            by[2, 1, slide] += turning * dx - w * w * dy
            by[3, 0, slide] -= 2.0 * w * dy
            by[3, 1, slide] += 2.0 * w * dx
    return 2


CHECKS = 8
"""Parts of a span at whose ends limits are checked when a motion is made [-]."""


@compiled
def largest_shares(
    points: FloatArray, period: float, chains: Chains, limits: FloatArray, kappa: FloatArray,
    ranges: FloatArray,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the largest shares of limits of speed, acceleration and jerk [-], and speed over acceleration.

    Accelerations include those in stops; the last number is the largest speed over the limit of acceleration
    [s]. All are those at ``CHECKS`` places of every span; jerk is the difference of accelerations at knots.

    Args:
        points: Control points of a spline of the time with equal spans, shape (m, 3 + n).
        period: Time of a span [s].
        chains: The bases.
        limits: See ``motion_limits``.
        kappa: Largest -rho' for every cell, shape (cells,) [1/s].
        ranges: When a stop with it may begin, and when it has ended, shape (cells, 2) [s].
    """
    m, d = points.shape
    fastest, hardest, roughest, longest = 0.0, 0.0, 0.0, 0.0
    nominal = np.empty((3, d))
    moved, by, before = np.empty((2, 2)), np.empty((4, 2, d)), np.zeros((len(limits), 2))
    for span in range(m - 3):
        for check in range(CHECKS + 1):
            time = (span + check / CHECKS) * period
            motion_at(points, period, time, 1.0, 0.0, nominal)
            x, v, a = nominal[0], nominal[1], nominal[2]
            for point in range(len(limits)):
                size = follow(chains, point, x, v, a, moved, by, False)
                speed = np.sqrt((moved[0, :size] ** 2).sum())
                fastest, longest = (
                    max(fastest, speed / limits[point, 0]),
                    max(longest, speed / limits[point, 1]),
                )
                hardest = max(hardest, np.sqrt((moved[1, :size] ** 2).sum()) / limits[point, 1])
                for cell in range(len(ranges)):
                    if ranges[cell, 0] <= time <= ranges[cell, 1]:
                        both = np.sqrt(((moved[1, :size] - kappa[cell] * moved[0, :size]) ** 2).sum())
                        hardest = max(hardest, max(both, kappa[cell] * speed) / limits[point, 1])
                if check == CHECKS or span + check == 0:
                    change = np.sqrt(((moved[1, :size] - before[point, :size]) ** 2).sum())
                    if check == CHECKS:
                        roughest = max(roughest, change / period / limits[point, 2])
                    before[point, :size] = moved[1, :size]
    return fastest, hardest, roughest, longest
