"""Check the motion of a plan whose team passes from cell to cell: ends, windows, stops, cells and limits.

The motion is a cubic B-spline with equal spans, h long. With s from 0 to 1 inside a span, z is a cubic of s,
so that a part of a span lies in the convex hull of the four Bezier points of that part. A part is proved to
lie in a cell by its hull, and to keep a limit by the values at its ends and a bound on what curves them
between. A part of which neither this nor the opposite is found is halved. It is all done in floating point.

While the team brakes, it moves along the motion at a pace rho from 0 to 1, and rho' is between -kappa and 0.
Its velocities are rho V and its accelerations rho^2 A + rho' V, with V and A those of the motion. These lie
in the parallelogram with the corners 0, A, -kappa V and A - kappa V. A magnitude is convex, so that it is
largest at a corner: it suffices that A, kappa V and A - kappa V are within the limit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from math import hypot, inf
from typing import NamedTuple, NoReturn

import numpy as np
import shapely
from numpy.typing import NDArray

from coop_drake.answers.motion import GRAVITY, WAITING, Motion, pull_gains
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, ScheduledGains
from coop_drake.laws.words import CLOCK_ERROR, WORD_PERIOD
from coop_drake.robustness.tracking import speed_departures
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.verification.budget import check_shapes
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.bodies import Stages, component_stages, moved

RELATIVE = 1e-9
"""Relative difference that rounding explains, of limits, rates and the duration [-]."""

SAME = 1e-9
"""Difference that rounding explains, of start and goal [m, rad]."""

INSIDE = 1e-12
"""Hulls lie in cells by more than this, and this share of the largest coordinate [m, rad]: rounding moves a
Bezier point by less."""

DEPTH, MOST = 16, 200_000
"""Largest number of halvings, and largest number of parts; what is unproved then is refused [-]."""

BEZIER = (
    np.array([[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]]) / 6
)
"""Bezier points of a span by its control points."""


def check_motion(plan: Plan, problem: PlanningProblem, gain_set: GainSet) -> list[Check]:
    """Check the motion of a plan, if it has one: at all times, not at samples.

    Args:
        plan: The plan, whose cells the exact checker finds to be free.
        problem: The problem that it should solve, with the limits of its team.
        gain_set: The plan's gain set, which knows the age of commands.

    Raises:
        RefusalError: Names the entry, what was found and what is allowed.
    """
    motion = plan.motion
    if motion is None:
        return []
    if plan.refused_by:
        raise RefusalError("motion", "is stated, but a plan that limits refuse has no motion")
    if not problem.limits.base_components:
        raise RefusalError("motion", "is stated, but the problem does not say where the bases are")
    _check_ends(plan, motion, problem)
    windows = _windows(motion, 2.0 * (CLOCK_ERROR if plan.budget is None else plan.budget.clock_error))
    if plan.budget is None:  # Otherwise gains are a free choice, from which departures follow.
        _check_pull(motion, gain_set)
    room, noisy = np.zeros(len(plan.start) - 2), NO_NOISE
    if plan.budget is not None and plan.departures is not None:
        check_shapes(plan.departures, plan.budget, problem.tree)
        room = plan.departures.room[1:]
        noisy = speed_departures(problem.tree, problem.limits, plan.departures)
    return [
        Check("the motion leads from the start to the goal, at rest at both ends", 2),
        _check_stops(motion, WAITING if plan.budget is None else 2.0 * plan.budget.words_window),
        _check_cells(plan, motion, windows, room),
        *_check_limits(motion, windows, problem, noisy),
    ]


def _check_ends(plan: Plan, motion: Motion, problem: PlanningProblem) -> None:
    """Check start, goal and rest: velocity and acceleration are zero where three control points are equal."""
    points, last = motion.points, len(motion.points) - 1
    if not np.isfinite(points).all():
        index = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise RefusalError(f"motion.points[{index}]", f"is {points[index].tolist()}, not finite")
    for index, end in ((1, 0), (2, 0), (last - 1, last), (last - 2, last)):
        if not np.array_equal(points[index], points[end]):
            finding = (
                f"is {points[index].tolist()}; at rest it is motion.points[{end}], {points[end].tolist()}"
            )
            raise RefusalError(f"motion.points[{index}]", finding)
    if not np.abs(points[0] - plan.start).max() <= SAME:
        finding = f"is {points[0].tolist()}; the start is {plan.start.tolist()}"
        raise RefusalError("motion.points[0]", finding)
    away = hypot(*(points[last, :2] - plan.goal_pose[:2]))
    if not away <= problem.position_tolerance:
        finding = f"is {away:.6g} m from the goal's position; {problem.position_tolerance:g} m are allowed"
        raise RefusalError(f"motion.points[{last}]", finding)
    lower, upper = plan.transitions[-1].goal_lower, plan.transitions[-1].goal_upper
    kept = (lower - SAME <= points[last, 2:]) & (points[last, 2:] <= upper + SAME)
    if not kept.all():
        axis = int(np.argmin(kept))
        finding = f"has {points[last, 2 + axis]:.9g} for {_axis(plan, axis)}; its goal interval is"
        raise RefusalError(f"motion.points[{last}]", f"{finding} [{lower[axis]}, {upper[axis]}]")


def _check_pull(motion: Motion, gain_set: GainSet) -> None:
    """Check the gains with which robots are pulled to the motion, by the age of commands."""
    age = gain_set.age if isinstance(gain_set, ScheduledGains) else 0.0
    for i, (found, due) in enumerate(zip(motion.gains, pull_gains(age), strict=True)):
        for k, expected in enumerate(due):
            if not abs(found[k] - expected) <= RELATIVE * expected:
                finding = f"is {found[k]}; commands {age:g} s old give {expected}"
                raise RefusalError(f"motion.gains[{i}][{k}]", finding)


def _axis(plan: Plan, axis: int) -> str:
    return ("theta", *plan.joint_names)[axis]


def _windows(motion: Motion, overlap: float) -> FloatArray:
    """Return the windows in spans; refuse windows that do not follow each other from beginning to end.

    Neighbours overlap for at least as long as phases of robots may differ by wrong clocks [s].
    """
    windows, duration, before = motion.windows, motion.duration, (0.0, inf)
    for i, (tau, x) in enumerate(windows.tolist()):
        where = f"motion.windows[{i}]"
        latest = before[1] - overlap
        if not (tau == 0.0 if i == 0 else before[0] < tau <= latest + SAME):
            allowed = "0 s" if i == 0 else f"a time after {before[0]} and not after {latest} s"
            raise RefusalError(where, f"begins at {tau} s; expected {allowed}")
        after = tau if i == 0 else max(tau, before[1])
        if not (tau < duration * (1.0 - RELATIVE) and after < x <= duration * (1.0 + RELATIVE)):
            raise RefusalError(where, f"ends at {x} s; expected a time after {after} s, up to {duration} s")
        before = tau, x
    if not before[1] >= duration * (1.0 - RELATIVE):
        finding = f"ends at {before[1]} s; the motion ends at {duration} s"
        raise RefusalError(f"motion.windows[{len(windows) - 1}]", finding)
    spans: FloatArray = np.minimum(windows / motion.period, len(motion.points) - 3.0)
    spans[-1, 1] = len(motion.points) - 3.0
    return spans


def _check_stops(motion: Motion, waiting: float) -> Check:
    """Check that a stop that begins as late as it may ends before the motion leaves the cell.

    The pace falls from 1 to 0 within 1 / kappa + r, at -kappa but for a ramp of r at either end, and the way
    in t is half of that. Where 1 / kappa is less than r, ramps as steep meet before rho' is -kappa, and the
    stop takes 2 sqrt(r / kappa), which is less.
    """
    if not motion.ramp >= WORD_PERIOD:
        raise RefusalError("motion.ramp", f"is {motion.ramp} s; commands change every {WORD_PERIOD:g} s")
    if not motion.waiting >= waiting * (1.0 - RELATIVE):
        raise RefusalError("motion.waiting", f"is {motion.waiting} s; expected {waiting:g} s or more")
    last, least = len(motion.rates) - 1, inf
    for i, (tau, x) in enumerate(motion.windows[:last].tolist()):
        left, ramps = x - tau - motion.waiting, 0.5 * motion.ramp
        if not left > ramps:
            finding = f"leaves {left:.6g} s to stop after {motion.waiting:g} s; ramps alone take {ramps:g} s"
            raise RefusalError(f"motion.windows[{i}]", finding)
        rate = 0.5 / (left - ramps)
        if not motion.rates[i] >= rate * (1.0 - RELATIVE):
            finding = (
                f"is {motion.rates[i]:.9g} /s; to stop in motion.windows[{i}] takes {rate:.9g} /s or more"
            )
            raise RefusalError(f"motion.rates[{i}]", finding)
        least = min(least, left - ramps)
    if motion.rates[last] != 0.0:
        raise RefusalError(f"motion.rates[{last}]", f"is {motion.rates[last]} /s; that of the last cell is 0")
    name = "a stop that begins as late as it may ends before the motion leaves the cell"
    return Check(name, last, least if last else None, "s for a stop, ramps aside")


# Parts of spans, and what is proved of them.


class _Parts(NamedTuple):
    """Parts of spans.

    Attributes:
        cells: For which cell each counts, shape (P,).
        spans: In which span each lies, shape (P,).
        ends: Where it begins and ends there, 0 to 1, shape (P, 2).
    """

    cells: IntArray
    spans: IntArray
    ends: FloatArray

    def of(self, which: NDArray[np.bool_] | IntArray) -> _Parts:
        """Return some of the parts."""
        return _Parts(self.cells[which], self.spans[which], self.ends[which])

    def halved(self) -> _Parts:
        """Return both halves of all parts."""
        ends = np.repeat(self.ends, 2, axis=0)
        ends[::2, 1] = ends[1::2, 0] = self.ends.mean(axis=1)
        return _Parts(np.repeat(self.cells, 2), np.repeat(self.spans, 2), ends)


def _parts(cell: int, begin: float, end: float) -> _Parts:
    """Cut a motion from one place to another, in spans, at its knots."""
    edges = np.concatenate([[begin], np.arange(np.floor(begin) + 1.0, np.ceil(end)), [end]])
    spans = np.floor(edges[:-1]).astype(np.int64)
    return _Parts(
        np.full(len(spans), cell), spans, np.stack([edges[:-1], edges[1:]], axis=1) - spans[:, None]
    )


Judgement = tuple[FloatArray, NDArray[np.bool_], NDArray[np.bool_]]
"""Of parts a value whose least is reported, whether each is proved, and whether it is refuted, shape (P,)."""


def _prove(
    parts: _Parts, judge: Callable[[_Parts], Judgement], refuse: Callable[[_Parts], NoReturn]
) -> tuple[int, float]:
    """Halve parts until each is proved; return how many were, and the least value; else refuse some."""
    count, least = 0, inf
    for depth in range(DEPTH + 1):
        values, proved, refuted = judge(parts)
        if not refuted.any() and (depth == DEPTH or len(values) > MOST):
            refuted = ~proved
        if refuted.any():
            wrong = parts.of(refuted)
            refuse(wrong.of(np.argsort(wrong.spans + wrong.ends[:, 0])))
        count, least = count + int(proved.sum()), min(least, float(values[proved].min(initial=inf)))
        if proved.all():
            break
        parts = parts.of(~proved).halved()
    return count, least


# Cells.


def _check_cells(plan: Plan, motion: Motion, windows: FloatArray, room: FloatArray) -> Check:
    """Check that the motion lies in each cell throughout its window: it then is as free as the cells."""
    found = [_prove_inside(plan, motion, i, window, room) for i, window in enumerate(windows)]
    name = "the motion lies in the cell of each window at all its times"
    return Check(name, sum(count for count, _ in found), min(gap for _, gap in found), "m or rad inside")


def _prove_inside(
    plan: Plan, motion: Motion, i: int, window: FloatArray, kept: FloatArray
) -> tuple[int, float]:
    """Prove that the motion lies in a cell; return of how many parts, and the least distance of a hull."""
    region, lower, upper = plan.governed(i), plan.cells[i].lower + kept, plan.cells[i].upper - kept
    room = INSIDE * max(1.0, float(np.abs(motion.points).max()), *map(abs, region.bounds))
    shapely.prepare(region)

    def judge(parts: _Parts) -> Judgement:
        points = _bezier_points(motion.points, parts)
        axes = np.minimum(points[..., 2:] - lower, upper - points[..., 2:]).min(axis=2)
        hulls = shapely.convex_hull(shapely.linestrings(points[..., :2]))
        gaps = np.minimum(axes.min(axis=1), shapely.distance(hulls, region.boundary))
        # A hull to which no boundary comes near lies inside if one of its points does; ends are reached.
        ends = shapely.contains_xy(region, points[:, ::3, 0], points[:, ::3, 1]) & (axes[:, ::3] > room)
        reached = ends.all(axis=1)
        return gaps, (gaps > room) & reached, ~reached

    return _prove(_parts(i, *window), judge, partial(_refuse_part, plan, motion, i, window, kept))


def _bezier_points(points: FloatArray, parts: _Parts) -> FloatArray:
    """Return the Bezier points of parts of spans, shape (P, 4, 3 + n): de Casteljau's steps to ends."""
    whole, found = BEZIER @ points[parts.spans[:, None] + np.arange(4)], []
    for point in range(4):
        rest = whole
        for step in range(3):
            s = parts.ends[:, int(step < point)][:, None, None]
            rest = (1.0 - s) * rest[:, :-1] + s * rest[:, 1:]
        found.append(rest[:, 0])
    return np.stack(found, axis=1)


def _refuse_part(
    plan: Plan, motion: Motion, i: int, window: FloatArray, kept: FloatArray, parts: _Parts
) -> NoReturn:
    """Refuse a cell's window where the motion is outside as it begins or ends, else a control point."""
    z, cell = _bezier_points(motion.points, parts)[0], plan.cells[i]
    outside = np.maximum(cell.lower + kept - z[:, 2:], z[:, 2:] - cell.upper + kept)
    point, axis = (int(k) for k in np.unravel_index(np.argmax(outside), outside.shape))
    if outside[point, axis] > -INSIDE:
        what = f"{_axis(plan, axis)} may be {z[point, 2 + axis]:.9g}; cells[{i}] has"
        what += f" [{cell.lower[axis]}, {cell.upper[axis]}]"
        what += f", of which {kept[axis]:.6g} at either end are for departures" if kept[axis] else ""
    else:
        region = (
            f"cells[{i}].tidied" if plan.transitions[i].governed is None else f"transitions[{i}].governed"
        )
        what = f"the position, {z[0, :2].tolist()} to {z[3, :2].tolist()}, may be outside {region}"
    ends = parts.spans[:, None] + parts.ends
    edge = window[0] in ends[:, 0] or window[1] in ends[:, 1]
    where = f"motion.windows[{i}]" if edge else f"motion.points[{1 + round(float(ends[0].mean()))}]"
    begin, end = (motion.period * ends[0]).tolist()
    raise RefusalError(where, f"from {begin:.6g} to {end:.6g} s, in motion.windows[{i}], {what}")


# Limits.


class _Mover(NamedTuple):
    """What moves, and its limits.

    Attributes:
        name: In words.
        unit: m or rad.
        speed: Its largest velocity.
        acceleration: Its largest acceleration.
        axes: Its velocity is this times z', shape (1 or 2, 3 + n); None for a sum of points.
        jerk: Largest mean jerk over a span.
        points: Points of components, each with its share in the sum [-], what moves its component, its own
            joint first, and its place in that component [m]. One of share 1 is the origin of a base.
    """

    name: str
    unit: str
    speed: float
    acceleration: float
    axes: FloatArray | None
    jerk: float = inf
    points: tuple[tuple[float, Stages, tuple[float, float]], ...] = ()

    def rates(self, z: FloatArray, v: FloatArray, a: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return V and A by z, z' and z'' of shape (P, 3 + n); shape (P, 1 or 2)."""
        if self.axes is not None:
            return v @ self.axes.T, a @ self.axes.T
        found = [(share, moved(np.array(point), stages, z, v, a)) for share, stages, point in self.points]
        velocity: FloatArray = np.sum([share * each.velocity for share, each in found], axis=0)
        return velocity, np.sum([share * each.acceleration for share, each in found], axis=0)

    def curving(
        self, z: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bound |V''| and |A''|, shape (P,), by bounds on |z|, |z'|, |z''|, |z'''|; z'''' is 0 in a span.

        Write vectors of the plane as complex numbers. A stage that turns at the rate w changes the derivative
        d/dt of a vector that it carries into (d/dt + i w), and the k-th derivative into the k-th power of it.
        The bound is the sum of the magnitudes of all terms of that power.
        """
        if self.axes is not None:
            return np.linalg.norm(j @ np.abs(self.axes).T, axis=1), np.zeros(len(j))
        third, fourth = np.zeros(len(z)), np.zeros(len(z))
        for share, stages, point in self.points:
            x0 = np.full(len(z), hypot(*point))
            x1 = x2 = x3 = x4 = np.zeros(len(z))
            for stage in stages:
                q, w, w1, w2 = (values[:, 3 + stage.index] for values in (z, v, a, j))
                if stage.kind == "prismatic":
                    along = hypot(*stage.axis)
                    x0, x1, x2, x3 = x0 + along * q, x1 + along * w, x2 + along * w1, x3 + along * w2
                else:
                    second, cubic = w1 + w**2, w2 + 3.0 * w * w1 + w**3
                    quartic = 3.0 * w1**2 + 4.0 * w * w2 + 6.0 * w**2 * w1 + w**4
                    x4 = x4 + 4.0 * w * x3 + 6.0 * second * x2 + 4.0 * cubic * x1 + quartic * x0
                    x3 = x3 + 3.0 * w * x2 + 3.0 * second * x1 + cubic * x0
                    x2, x1 = x2 + 2.0 * w * x1 + second * x0, x1 + w * x0
                x0 = x0 + hypot(stage.X_PJ.x, stage.X_PJ.y)
            third, fourth = third + share * (x3 + np.hypot(j[:, 0], j[:, 1])), fourth + share * x4
        return third, fourth


NO_NOISE = np.zeros(0)
"""Where no budget has noise."""


def _movers(problem: PlanningProblem, noisy: FloatArray = NO_NOISE) -> Iterator[_Mover]:
    """List the object, the bases, their angles and the joints, with their limits, or defaults for these.

    Limits of speed are less by what noise adds, of which that of all bases, then of their angles, and of the
    joints is given, if any.
    """
    bases = len(problem.limits.base_components)
    noisy = noisy if noisy.size else np.zeros(2 * bases + len(problem.tree.joints))
    joints = problem.tree.joints
    of = problem.limits.with_defaults(len(joints))
    unit = np.eye(3 + len(joints))
    yield _Mover("the object", "m", inf, float(of.object_acceleration[0]), unit[:2])
    for k, (component, point) in enumerate(zip(of.base_components, of.base_points, strict=True)):
        stages = component_stages(problem.tree, component)
        most, jerk, turning = (
            float(each[k]) for each in (of.base_accelerations, of.base_jerks, of.turn_accelerations)
        )
        speed, rate = float(of.base_speeds[k] - noisy[k]), float(of.turn_rates[k] - noisy[bases + k])
        yield _Mover(f"base {k}", "m", speed, most, None, jerk, ((1.0, stages, point),))
        yield from _centre(problem, k, float(of.frictions[k]), float(of.base_forces[k]))
        signs = [stage.sign * unit[3 + stage.index] for stage in stages if stage.kind == "revolute"]
        yield _Mover(f"the angle of base {k}", "rad", rate, turning, np.sum(signs, axis=0, keepdims=True))
    for joint, speed, most in zip(
        joints, (of.joint_rates - noisy[2 * bases :]).tolist(), of.joint_accelerations.tolist(), strict=True
    ):
        yield _Mover(joint.name, joint.unit, speed, most, unit[[3 + joint.index]])


def _centre(problem: PlanningProblem, k: int, friction: float, force: float) -> Iterator[_Mover]:
    """Yield the common centre of all masses that a base moves: the force over their sum accelerates it."""
    held = [body for body in problem.limits.bodies if body[5] == k]
    if mass := sum(one for _, one, *_ in held):
        points = tuple(
            (one / mass, component_stages(problem.tree, int(on)), (x, y)) for on, one, x, y, *_ in held
        )
        most = min(friction * GRAVITY, force / mass)
        yield _Mover(f"the centre of all that base {k} moves", "m", inf, most, None, points=points)


def _check_limits(
    motion: Motion, windows: FloatArray, problem: PlanningProblem, noisy: FloatArray
) -> list[Check]:
    """Check speeds and accelerations, in stops and starts, too, and mean jerks.

    In a start from any phase, rho' is at most alpha (1 - rho^2), so that rho^2 A + rho' V lies between A and
    alpha V.
    The team may brake for cell i from tau_(i-1) + 2 W on; before, it does so for the cell before.
    """
    begins = [0.0, *((motion.windows[:-1, 0] + motion.waiting) / motion.period).tolist()]
    ways = [_parts(i, begin, end) for i, (begin, end) in enumerate(zip(begins, windows[:, 1], strict=True))]
    every = _Parts(*(np.concatenate([getattr(way, name) for way in ways]) for name in _Parts._fields))
    movers = list(_movers(problem, noisy))
    for mover in movers:
        if not mover.speed > 0.0:
            raise RefusalError(
                "departures.usual_rate", f"is as large as the limit of {mover.name}, or larger"
            )
    found = [_prove_limits(motion, mover, every) for mover in movers]
    name = "limits of speed and acceleration are kept at all times, in stops and starts, too"
    kept = Check(
        name,
        sum(count for count, _ in found),
        min(left for _, left in found),
        "least share of a limit that is left",
    )
    jerks = [1.0 - _largest_jerk(motion, mover) for mover in movers if mover.jerk < inf]
    name = "limits of the bases' jerk are kept in the mean over each span, at full pace"
    return [
        kept,
        Check(name, len(jerks) * (len(motion.points) - 3), min(jerks), "least share of a limit that is left"),
    ]


def _prove_limits(motion: Motion, mover: _Mover, parts: _Parts) -> tuple[int, float]:
    """Prove that limits are kept; return of how many parts, and the least share that surely is left [-]."""

    def judge(parts: _Parts) -> Judgement:
        shares, bound = _shares(motion, mover, parts)
        kept = np.all(shares <= 1.0 + RELATIVE, axis=(0, 2))
        return 1.0 - bound, bound <= 1.0 + RELATIVE, np.logical_not(kept)

    return _prove(parts.halved().halved(), judge, partial(_refuse_limit, motion, mover))


def _shares(motion: Motion, mover: _Mover, parts: _Parts) -> tuple[FloatArray, FloatArray]:
    """Return shares of limits that are used, and bounds for all of each part.

    Returns:
        Shares of the limits of speed and of acceleration, at full pace, in a stop and in a start, at both
        ends of parts, shape (4, P, 2) [-]; bounds on all of them between the ends, shape (P,) [-].
    """
    z, v, a, j = _derivatives(motion, parts)
    found = [mover.rates(z[:, end], v[:, end], a[:, end]) for end in (0, 1)]
    V, A = (np.stack(each, axis=1) for each in zip(*found, strict=True))  # (P, 2, 1 or 2)
    kappa = motion.rates[parts.cells][:, None]
    speeds, most = np.linalg.norm(V, axis=2), mover.acceleration
    starts = most / motion.start_rate
    braking = np.maximum(np.linalg.norm(A - kappa[..., None] * V, axis=2), kappa * speeds)
    shares = np.stack(
        [speeds / mover.speed, np.linalg.norm(A, axis=2) / most, braking / most, speeds / starts]
    )
    # A function whose second derivative is at most M departs from its chord by M step^2 / 8 at most, and the
    # chord is nowhere longer than at an end. z'' is linear, and z' and z are half a step from one at most.
    step = motion.period * np.diff(parts.ends, axis=1)
    most_a = np.abs(a).max(axis=1)
    most_v = np.abs(v).max(axis=1) + 0.5 * step * most_a
    most_z = np.abs(z).max(axis=1) + 0.5 * step * most_v
    of_v, of_a = mover.curving(most_z, most_v, most_a, np.abs(j))
    between = np.stack([of_v / mover.speed, of_a / most, (of_a + kappa[:, 0] * of_v) / most, of_v / starts])
    bound: FloatArray = (shares.max(axis=2) + between * step[:, 0] ** 2 / 8.0).max(axis=0)
    return shares, bound


def _derivatives(motion: Motion, parts: _Parts) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return z, z' and z'' at both ends of parts, shape (P, 2, 3 + n), and z''' in them, shape (P, 3 + n)."""
    h, p, s, w = (
        motion.period,
        motion.points[parts.spans[:, None] + np.arange(4)],
        parts.ends,
        1.0 - parts.ends,
    )
    z, v, a = (
        np.stack(one, axis=2) @ p / scale
        for one, scale in (
            ([w**3, 4.0 - 6.0 * s**2 + 3.0 * s**3, 4.0 - 6.0 * w**2 + 3.0 * w**3, s**3], 6.0),
            ([-(w**2), 3.0 * s**2 - 4.0 * s, 4.0 * w - 3.0 * w**2, s**2], 2.0 * h),
            ([w, 1.0 - 3.0 * w, 1.0 - 3.0 * s, s], h**2),
        )
    )
    return z, v, a, np.array([-1.0, 3.0, -3.0, 1.0]) @ p / h**3


def _refuse_limit(motion: Motion, mover: _Mover, parts: _Parts) -> NoReturn:
    """Refuse a part that breaks a limit, or is not proved to keep it: a control point, or else the rate."""
    shares = _shares(motion, mover, parts)[0][:, 0]
    kind, end = (int(k) for k in np.unravel_index(np.argmax(shares), shares.shape))
    cell, place = int(parts.cells[0]), float(parts.spans[0] + parts.ends[0, end])
    limit, unit = (mover.speed, "s") if kind == 0 else (mover.acceleration, "s^2")
    what = "moves at" if kind == 0 else "is accelerated by"
    what += "" if shares[kind, end] > 1.0 + RELATIVE else " perhaps more than"
    value = f"{shares[kind, end] * limit:.9g} {mover.unit}/{unit}"
    braking = f" while the team brakes at {motion.rates[cell]:.6g} /s" if kind == 2 else ""
    braking = f" while the team starts at {motion.start_rate:.6g} /s" if kind == 3 else braking
    where = f"motion.rates[{cell}]" if kind == 2 else f"motion.points[{1 + round(place)}]"
    where = "motion.start_rate" if kind == 3 else where
    finding = f"at {motion.period * place:.6g} s {mover.name} {what} {value}{braking}"
    raise RefusalError(where, f"{finding}; the limit is {limit:g} {mover.unit}/{unit}")


def _largest_jerk(motion: Motion, mover: _Mover) -> float:
    """Return the largest share of the limit of jerk that a base uses in the mean over a span [-]."""
    spans = np.arange(len(motion.points) - 3)
    z, v, a, _ = _derivatives(motion, _Parts(spans, spans, np.tile([0.0, 1.0], (len(spans), 1))))
    begin, end = (mover.rates(z[:, k], v[:, k], a[:, k])[1] for k in (0, 1))
    jerks = np.linalg.norm(end - begin, axis=1) / motion.period
    kept = jerks <= mover.jerk * (1.0 + RELATIVE)
    if not kept.all():
        span = int(np.argmin(kept))
        finding = f"from {motion.period * span:.6g} s to the next knot {mover.name} has a mean jerk of"
        finding += f" {jerks[span]:.9g} m/s^3; the limit is {mover.jerk:g} m/s^3"
        raise RefusalError(f"motion.points[{span + 1}]", finding)
    return float(jerks.max()) / mover.jerk
