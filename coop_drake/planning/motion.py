"""The quickest motion of a team through the cells of a plan from which it can stop before it leaves them.

The motion is a curve z(u) of configurations z = (x, y, theta, q...) with a time t(u), both uniform cubic
B-splines of the same parameter u. Between two knots, in one span, a spline stays in the convex hull of its
four Bezier points. So it suffices that these lie in the span's cells: in the boxes of (theta, q...), and in
half-planes that cut off all edges of the position regions. With dots for derivatives by t,

z' = z_u / t_u,  z'' = (z_uu - z' t_uu) / t_u^2.

Along it the team runs at the pace rho, which is 1 but where it brakes or starts: its velocities are rho
times those of the motion, its accelerations rho^2 A + rho' V, for the object, the bases and the joints
alike, with V and A those at pace 1.

The rule. When a robot enters cell i, at the time tau_i, it reports this to the others. They receive the
report at most W later. A robot that misses a report tells the others, which takes at most W more. So the
team begins to brake at beta_i = tau_i + 2 W at the latest. It must be at rest before x_i, the time at which
the motion leaves cell i. In a stop, rho' falls from 0 to -kappa_i within the time r, stays there, and rises
to 0 within r. A stop from rho = 1 takes 1 / kappa_i + r, in which t advances by half as much. Therefore
kappa_i = 1 / (2 (x_i - beta_i) - r). Between beta_(i-1) and x_i, the accelerations A, -kappa_i V and
A - kappa_i V are within their limits. So is every rho^2 A + rho' V with rho from 0 to 1 and rho' from
-kappa_i to 0: the team can brake at any time.

The optimisation problem. The end time is minimised by an interior-point method: every limit has a
logarithmic barrier, and Newton's method uses the Gauss-Newton part of the Hessian. Every term without kappa
depends on at most four neighbouring control points, so the Hessian is banded. kappa_i couples the control
points near tau_i to those near x_i; one extra unknown per cell keeps the Hessian sparse. In the first phase
the times of the control points are free, and every cell keeps its spans. In the second phase spans last
nearly equally long, but some cells may still take longer and others shorter. In the third phase all spans
last equally long, and their length is the only unknown time. Accelerations are then linear between knots,
where limits are kept; a last slowing keeps them between the knots, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
import scipy.linalg
import shapely
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from coop_drake.answers.motion import WAITING, Motion, TeamGains
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import PlanError
from coop_drake.geometry.polygons import edges_of
from coop_drake.planning.motion_barrier import (
    BEZIER,
    BRAKES,
    HALF_PLANES,
    Course,
    Slopes,
    add_times,
    barrier,
    brake,
    lay_planes,
    time_shares,
)
from coop_drake.planning.motion_limits import (
    Chains,
    largest_shares,
    motion_limits,
    slow_limits,
    team_chains,
    times_at_limits,
)
from coop_drake.planning.motion_step import newton_step
from coop_drake.tree.arrays import FloatArray, IntArray

SPAN_TIME = 0.3
"""Time of a span at the speed limits, before the program [s]; longer if ``2 MOST_SPANS`` do not suffice."""

PERIOD = 0.08
"""Time of a span of the motion that is made, about [s]."""

MOST_SPANS = 600
"""Largest number of spans of that length [-]; motions of slow teams have longer ones."""

PARTS = 4
"""Parts of a span of the motion that is made, at whose ends cells may be entered and left [-]."""

OVERLAP_SPANS = 2.0
"""Fewest spans in the overlap of two cells, initially [-]; doubled where no initial path is found."""

CLEARANCE_SPANS = 0.5
"""Fewest spans in a piece of path that is as long as the clearance there, initially [-]."""

SAMPLES = 24
"""Samples of the first way in a cell [-]."""

EVENNESS, NEARLY_EVEN = 2.0, 1.2
"""Largest ratio of times between neighbouring control points, in the first and in the second phase [-]."""

SHORTEST_SPAN = 0.01
"""Shortest time between two control points, while the time is free [s]."""

SHORTEST_OVERLAP = 0.03
"""Shortest time between the control points of one span in every overlap, in the first phase [s]."""

BRAKE_RAMP = 0.1
"""r, the time in which the team begins and ends to brake [s]."""

WEIGHTS = (0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4), (2e-4,), (1e-4, 3e-5)
"""Weights of the barrier in the three phases [s]."""

FEW = 200
"""With more points than this, weights are as many times smaller: limits of all points add to the barrier."""

DONE = 50.0
"""The next weight is taken when a step promises a decrease of less than this many weights [-]."""

MARGIN, MARGIN_SHARE = 1e-3, 0.02
"""Distance that a motion keeps from the ends of its cells' intervals [rad or m] and from the boundaries of
their regions [m], besides the room for departures; and the largest share of an interval that this distance
may take [-]. Where a piece is nearer to a boundary, the motion keeps nine tenths of its distance. So a log
can show that the states between its rows are in the cells, too."""

ROOM, ROOM_SHARE = 8e-3, 0.2
"""Distance from the ends of intervals [rad or m], and its largest share of an interval [-], where no budget
says how much room the team needs: usual noise moves it by some milliradians."""

LARGEST_START = 10.0
"""Largest rate alpha of a start [1/s], for motions that need hardly any acceleration."""

LIMIT_SHARE = 0.995
"""Share of every limit that a motion uses [-]: the team departs from it by rounding and integration."""

MUCH_SLOWER = 1.02
"""Where limits between knots ask for times that are longer by more than this factor, spans are halved [-]."""

FINER = 2
"""How often spans are halved where the initial path does not enter every cell, or limits between knots ask
for much slower motions [-]."""

STEPS, ROUNDS = 2, 120
"""Newton steps with the same half-planes, and how often new half-planes are made at most [-]."""

SLOWER = 1.01
"""Factor by which all times grow until every limit is kept [-]."""

SHORTER = 0.4
"""Factor by which steps are shortened [-]; a step begins with what the last one took, over its square."""

ACCEPTED = 0.01
"""Share of the decrease that the slope promises with which a step is accepted [-]."""


# The cells as a motion sees them.


class CellSets(NamedTuple):
    """The cells of a plan, less a margin that a motion keeps to the ends of the axes' intervals.

    Attributes:
        lower: Lower ends of (theta, q...), shape (cells, 1 + n) [rad, m].
        upper: Upper ends.
        regions: The position regions, prepared.
        edges: Edges of all regions, shape (E, 4) [m].
        ends: First edge of every cell and the edge after the last one, shape (cells + 1,).
    """

    lower: FloatArray
    upper: FloatArray
    regions: list[shapely.Polygon]
    edges: FloatArray
    ends: IntArray


def cell_sets(plan: Plan, room: FloatArray | None) -> CellSets:
    """Return the cells of a plan as a motion sees them; room is kept from the ends of axes' intervals."""
    lower, upper = (np.array([getattr(cell, end) for cell in plan.cells]) for end in ("lower", "upper"))
    if room is None:
        kept = np.minimum(ROOM, ROOM_SHARE * (upper - lower))
    else:
        kept = room + np.minimum(MARGIN, MARGIN_SHARE * (upper - lower))
    if not (lower + kept < upper - kept).all():
        cell, axis = np.argwhere(lower + kept >= upper - kept)[0]
        raise PlanError(f"cell {cell} leaves no room on axis {axis}")
    regions = [plan.governed(index) for index in range(len(plan.cells))]
    shapely.prepare(regions)
    rings = [edges_of(region) for region in regions]
    ends = np.cumsum([0, *(len(ring) for ring in rings)])
    return CellSets(lower + kept, upper - kept, regions, np.concatenate(rings), ends)


# The initial path: along the plan's paths, every span in a cell.


def first_ways(plan: Plan) -> list[FloatArray]:
    """Return samples along the path of every transition, shape (SAMPLES, 3 + n) each.

    Angles and joints move evenly from the middle of one goal interval to that of the next.
    """
    ways, resting = [], plan.start[2:]
    for index, transition in enumerate(plan.transitions):
        goal = 0.5 * (transition.goal_lower + transition.goal_upper)
        if index + 1 == len(plan.transitions):
            wanted = (plan.goal_pose[2], *plan.goal_joints)
            kept = np.clip(resting, transition.goal_lower, transition.goal_upper)
            goal = np.array([k if w is None else w for k, w in zip(kept, wanted, strict=True)])
        line, shares = shapely.LineString(transition.path), np.linspace(0.0, 1.0, SAMPLES)
        places = shapely.get_coordinates(shapely.line_interpolate_point(line, shares, normalized=True))
        ways.append(np.hstack([places, resting + shares[:, None] * (goal - resting)]))
        resting = goal
    return ways


def first_points(
    ways: Sequence[FloatArray], cells: CellSets, chains: Chains, limits: FloatArray, overlap: float
) -> FloatArray:
    """Return control points (z, t) along ways, three at rest at either end, evenly timed, shape (m, D).

    Spans are shorter where two cells overlap for a short way only, and where there is little clearance.

    Args:
        ways: See ``first_ways``.
        cells: The cells, as the motion sees them.
        chains: The bases.
        limits: Largest velocities and accelerations, see ``motion_limits``.
        overlap: Fewest spans of an overlap of two cells [-].
    """
    clearances, overlaps = [], []
    for region, places in zip(cells.regions, ways, strict=True):
        clearances.append(shapely.distance(shapely.boundary(region), shapely.points(places[:, :2])))
    for index, (before, after) in enumerate(pairwise(ways)):
        overlaps.append((_inside(cells, index + 1, before), _inside(cells, index, after)))
    way, clearance = np.concatenate(ways), np.concatenate(clearances)
    steps, seconds = np.diff(way, axis=0), times_at_limits(chains, limits, way)
    span_time = max(SPAN_TIME, float(seconds.sum()) / (2 * MOST_SPANS))
    room = np.maximum(np.minimum(clearance[1:], clearance[:-1]), 1e-4)
    spans = np.maximum(seconds / span_time, CLEARANCE_SPANS * np.hypot(*steps[:, :2].T) / room)
    for index, (reached, left) in enumerate(overlaps):
        middle = (index + 1) * SAMPLES
        begin = middle - 1 - int(np.argmin(np.append(reached[::-1], False)))
        end = middle + int(np.argmin(np.append(left, False)))
        piece = slice(max(begin, 0), min(end, len(spans)))
        have = spans[piece].sum()
        if have > 0.0:
            spans[piece] *= max(1.0, overlap / have)
        else:
            spans[piece] = overlap / max(piece.stop - piece.start, 1)
    at = np.append(0.0, np.cumsum(spans))
    places = np.pad(np.linspace(0.0, at[-1], max(int(np.ceil(at[-1])) + 1, 5)), 2, mode="edge")
    columns = [np.interp(places, at, column) for column in way.T]
    return np.column_stack([*columns, span_time * (np.arange(len(places)) - 1.0)])


def _inside(cells: CellSets, index: int, way: FloatArray) -> NDArray[np.bool_]:
    """Return which samples of a way are in a cell, shape (samples,)."""
    axes = way[:, 2:]
    boxed: NDArray[np.bool_] = np.all((axes > cells.lower[index]) & (axes < cells.upper[index]), axis=1)
    boxed[boxed] = shapely.contains_xy(cells.regions[index], *way[boxed, :2].T)
    return boxed


def bezier_points(parts: int) -> FloatArray:
    """Return the Bezier points of equal parts of a span by its control points, shape (parts, 4, 4)."""
    found = np.empty((parts, 4, 4))
    for part in range(parts):
        ends = (part / parts, (part + 1) / parts)
        for row in range(4):
            points = BEZIER
            for level in range(3):
                s = ends[level >= 3 - row]
                points = (1.0 - s) * points[:-1] + s * points[1:]
            found[part, row] = points[0]
    return found


def pieces_inside(cells: CellSets, points: FloatArray, shares: FloatArray) -> NDArray[np.bool_]:
    """Return which parts of spans lie in which cells, their Bezier points and the hull of these.

    Args:
        cells: The cells.
        points: Control points of z, shape (m, 3 + n).
        shares: See ``bezier_points``.

    Returns:
        Shape (cells, spans * parts).
    """
    spans = np.lib.stride_tricks.sliding_window_view(points, 4, axis=0)  # (spans, 3 + n, 4)
    pieces = np.einsum("ske,qbe->sqkb", spans, shares).reshape(-1, points.shape[1], 4)
    inside = np.zeros((len(cells.regions), len(pieces)), bool)
    least, most = pieces[:, 2:].min(axis=2), pieces[:, 2:].max(axis=2)
    hulls = shapely.convex_hull(shapely.linestrings(pieces[:, :2].transpose(0, 2, 1)))
    for index, region in enumerate(cells.regions):
        found = ((least > cells.lower[index]) & (most < cells.upper[index])).all(axis=1)
        inside[index, found] = shapely.contains_properly(region, hulls[found])
    return inside


def pieces_of_cells(inside: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """Return the first and the last piece of every cell; neighbours share at least one.

    Raises:
        PlanError: The pieces leave the cells; names the first one that is not reached.
    """
    cells, pieces = inside.shape
    first, last, begin = np.zeros(cells, np.int64), np.zeros(cells, np.int64), 0
    for cell in range(cells):
        row = inside[cell]
        begin = begin + int(np.argmax(row[begin:] & (inside[max(cell - 1, 0), begin:])))
        low = high = begin
        if not row[begin]:
            raise PlanError(f"the initial path does not enter cell {cell}")
        while low > 0 and row[low - 1]:
            low -= 1
        while high + 1 < pieces and row[high + 1]:
            high += 1
        first[cell], last[cell] = low, high
    if first[0] != 0 or last[-1] != pieces - 1:
        raise PlanError("the initial path leaves the first or the last cell")
    return first, last


# The program.


def quickest_motion(
    plan: Plan,
    problem: PlanningProblem,
    limits: FloatArray,
    gains: TeamGains,
    waiting: float = WAITING,
    room: FloatArray | None = None,
) -> Motion:
    """Return the quickest motion found.

    Args:
        plan: The plan, with its cells.
        problem: The question that it answers, with the team.
        limits: Largest velocities, accelerations and jerks, see ``motion_limits``.
        gains: Gains with which the team will be pulled to the motion.
        waiting: 2 W [s].
        room: Room for departures of the axes, shape (1 + n,) [rad, m]; the regions of a plan with a budget
            have that of the position already. None without a budget.

    Raises:
        PlanError: No motion was found that stays in the cells; says where.
    """
    chains, cells, ways = team_chains(problem), cell_sets(plan, room), first_ways(plan)
    # The program of a slow team is that of a usual one in a longer unit of time.
    usual = motion_limits(problem.limits.usual(len(problem.tree.joints)))
    unit, scaled = slow_limits(chains, limits, usual, ways)
    table = LIMIT_SHARE * scaled
    wait, ramp = waiting / unit, BRAKE_RAMP / unit
    free = np.where([True, True, False], table, inf)  # Jerk is limited where spans are about equal.
    for finer in range(FINER + 1):
        points = first_points(ways, cells, chains, table, OVERLAP_SPANS * 2**finer)
        try:
            last = _Program(cells, chains, free, wait, ramp, points, EVENNESS, parts=1)
            break
        except PlanError:
            if finer == FINER:
                raise
    last.solve(WEIGHTS[0])
    for evenness, weights in ((NEARLY_EVEN, WEIGHTS[1]), (1.0, WEIGHTS[2])):
        before = last.points
        for finer in range(FINER + 1):
            longest = max(PERIOD, float(before[-2, -1]) / MOST_SPANS)
            equal = uniform_points(before, longest / 2**finer)
            try:
                last = _Program(cells, chains, table, wait, ramp, equal, evenness, PARTS)
            except PlanError:
                if finer == FINER:
                    raise
                continue
            last.solve(weights)
            if not last.uniform or last.slow_down() < MUCH_SLOWER:
                break
    if not (np.diff(last.windows, axis=0) > 0.0).all():
        raise PlanError("a cell is not entered and left after the one before it")
    period = unit * float(last.points[2, -1] - last.points[1, -1])
    made = last.points[:, :-1].copy(), period, period * last.windows, last.kappa / unit
    return Motion(*made, waiting, BRAKE_RAMP, min(last.start_rate / unit, LARGEST_START), gains)


def uniform_points(points: FloatArray, period: float) -> FloatArray:
    """Return a motion as a spline of the time with equal spans, through the same places at its knots.

    Args:
        points: Control points (z, t), shape (m, D).
        period: Time of a span, about [s].

    Returns:
        Control points (z, t), t that of equal spans.
    """
    u = np.linspace(0.0, len(points) - 3.0, 16 * (len(points) - 3) + 1)
    dense = BSpline(np.arange(len(points) + 4.0) - 3.0, points, 3)(u)
    count = max(int(np.ceil((dense[-1, -1] - dense[0, -1]) / period)), 6)
    times = np.linspace(dense[0, -1], dense[-1, -1], count + 1)
    knots = np.stack([np.interp(times, dense[:, -1], column) for column in dense[:, :-1].T], axis=1)
    found = np.empty((count + 3, points.shape[1]))
    found[:3, :-1], found[-3:, :-1] = points[0, :-1], points[-1, :-1]
    # The second knot and the last but one are free: there, rest at the ends decides.
    band = np.array([[1.0], [4.0], [1.0]]) / 6.0 * np.ones(count - 3)
    right = knots[2:-2].copy()
    right[0] -= found[2, :-1] / 6.0
    right[-1] -= found[-3, :-1] / 6.0
    found[3:-3, :-1] = scipy.linalg.solve_banded((1, 1), band, right)
    found[:, -1] = (times[1] - times[0]) * (np.arange(count + 3) - 1.0)
    return found


@dataclass
class _Program:
    """The state of the program.

    Attributes:
        cells: The cells.
        chains: The bases.
        limits: Largest velocities, accelerations and jerks, see ``motion_limits``.
        waiting: 2 W [s].
        ramp: r [s].
        points: Control points (z, t), shape (m, D).
        evenness: Largest ratio of times between neighbouring control points, 1 for equal spans [-].
        parts: Parts of a span, at whose ends cells may be entered and left [-].

    Besides, it has the Bezier points of these parts (``shares``), whether spans are equal (``uniform``), the
    first and the last piece of every cell (``first``, ``last``), u at which the motion enters and leaves
    every cell (``windows``, shape (cells, 2)), kappa and where it acts (``kappa``, ``acting``, see
    ``brake``), which unknowns are held (``held``), how they change with the length of a span (``lengths``),
    least times between control points (``shortest``), the ``course`` of ``barrier``, the share of Newton's
    step that was taken last (``share``), and after ``slow_down`` the rate of starts on the way
    (``start_rate``).
    """

    cells: CellSets
    chains: Chains
    limits: FloatArray
    waiting: float
    ramp: float
    points: FloatArray
    evenness: float
    parts: int

    def __post_init__(self) -> None:
        """Find the pieces of cells, and what is held: rest at both ends, and the time at the beginning."""
        self.shares, self.uniform = bezier_points(self.parts), self.evenness == 1.0
        self.first, self.last = pieces_of_cells(self._inside(self.shares))
        m, D = self.points.shape
        fixed = np.zeros((m, D), bool)
        fixed[:3, :-1] = fixed[-3:, :-1] = fixed[1, -1] = True
        fixed[:, -1] |= self.uniform
        self.held, self.lengths = fixed.ravel(), np.zeros(m * D)
        if self.uniform:
            self.lengths[D - 1 :: D] = np.arange(m) - 1.0
        self.kappa, self.acting = np.zeros(len(self.first)), np.zeros((m, 1 + BRAKES), np.int64)
        self.share = 1.0

    def _inside(self, shares: FloatArray) -> NDArray[np.bool_]:
        return pieces_inside(self.cells, self.points[:, :-1], shares)

    def solve(self, weights: tuple[float, ...]) -> None:
        """Take Newton steps with smaller and smaller weights of the barrier, smaller for more points."""
        at, share = 0, min(1.0, FEW / len(self.points))
        for _ in range(ROUNDS):
            self.lay_course()
            done = self.improve(share * weights[at])
            if done and at + 1 == len(weights):
                return
            at += done

    def lay_course(self) -> None:
        """Let cells have all pieces that lie in them, and lay half-planes about these."""
        inside, cells, parts = self._inside(self.shares), len(self.first), len(self.shares)
        for cell in range(cells):
            low, high = self.first[cell], self.last[cell]
            while low > 0 and inside[cell, low - 1] and (cell == 0 or low - 1 > self.first[cell - 1]):
                low -= 1
            while high + 1 < inside.shape[1] and inside[cell, high + 1]:
                high += 1
            self.first[cell], self.last[cell] = low, high
        # Robots expect that cells are entered and left one after the other.
        for cell in range(1, cells):
            self.first[cell] = max(self.first[cell], min(self.first[cell - 1] + 1, self.last[cell - 1]))
        for cell in range(cells - 2, -1, -1):
            self.last[cell] = min(self.last[cell], max(self.first[cell + 1], self.last[cell + 1] - 1))
        self.windows = np.stack([self.first, self.last + 1], axis=1) / parts
        numbers = np.arange(inside.shape[1])
        held = (self.first[:, None] <= numbers) & (numbers <= self.last[:, None])
        spans, parts_of = np.divmod(numbers, parts)
        shares = self.shares[parts_of]
        if parts > 1:  # Spans whose parts lie in the same cells, as they do as a whole, are one piece.
            whole = self._inside(BEZIER[None])
            each = held.reshape(cells, -1, parts)
            alike = (each == each[:, :, :1]).all(axis=(0, 2)) & (whole >= each[:, :, 0]).all(axis=0)
            kept = ~alike[spans] | (parts_of == 0)
            shares[alike[spans]] = BEZIER
            held, spans, shares = held[:, kept], spans[kept], shares[kept]
        lower = np.where(held[..., None], self.cells.lower[:, None], -inf)
        upper = np.where(held[..., None], self.cells.upper[:, None], inf)
        pairs = np.stack([np.argmax(held, axis=0), cells - 1 - np.argmax(held[::-1], axis=0)], axis=1)
        planes, counts = np.zeros((len(spans), HALF_PLANES, 3)), np.zeros(len(spans), np.int64)
        places = self.points[spans[:, None] + np.arange(4), :2]
        hulls, edges, ends = np.einsum("pbe,pei->pbi", shares, places), self.cells.edges, self.cells.ends
        least = lay_planes(hulls, pairs, edges, ends, MARGIN, planes, counts)
        if not least > 0.0:
            raise PlanError("a span of the motion meets the boundary of its cell")
        self.shortest = np.full(len(self.points) - 1, SHORTEST_SPAN)
        if parts == 1:
            steps = np.diff(self.points[:, -1])
            for before, after in zip(self.last[:-1], self.first[1:], strict=True):
                if before < after:
                    raise PlanError("two cells of the motion share no span")
                longest = after + int(np.argmax(steps[after + 1 : before + 2]))
                self.shortest[longest + 1] = min(SHORTEST_OVERLAP, 0.999 * steps[longest + 1])
        self.course = Course(
            self.chains, self.limits, spans, shares, lower.max(axis=0), upper.min(axis=0), planes, counts
        )

    def value(self, points: FloatArray, weight: float, slopes: Slopes | None = None) -> float:
        """Return what is minimised, infinite where a limit is not kept, and add its derivatives."""
        if not brake(points, self.windows, self.waiting, self.ramp, self.kappa, self.acting):
            return inf
        given = slopes or Slopes(*(np.empty(shape) for shape in ((0, 0), 0, (0, 0), 0, 0)))
        value = float(points[-2, -1])
        value += barrier(points, weight, self.course, self.kappa, self.acting, given, slopes is not None)
        if not self.uniform:
            value += add_times(points, weight, self.shortest, self.evenness, given, slopes is not None)
        return value

    def improve(self, weight: float) -> bool:
        """Take a few Newton steps; returns whether the next weight may be taken."""
        (m, D), cells = self.points.shape, len(self.first)
        for _ in range(STEPS):
            shapes = (m * D, 4 * D), m * D, (cells, m * D), cells, cells
            slopes = Slopes(*(np.zeros(shape) for shape in shapes))
            while not isfinite(now := self.value(self.points, weight, slopes)):
                self.points[:, -1] *= SLOWER
                if not self.points[-2, -1] < 1e4:
                    raise PlanError("no pace keeps the limits in the plan's cells")
                for each in slopes:
                    each[:] = 0.0
            slopes.point[(m - 2) * D + D - 1] += 1.0
            u, last, step = self.windows[:-1], len(self.points) - 1, np.empty(m * D)
            places, shares = np.zeros((cells, 8), np.int64), np.zeros((cells, 8))
            at = (np.minimum(u.astype(int)[..., None] + np.arange(4), last) + 1) * D - 1
            by = np.stack(time_shares(u - u.astype(int)), axis=2) * [[[2.0], [-2.0]]]
            places[:-1] = at.reshape(-1, 8)
            shares[:-1] = (self.kappa[:-1, None, None] * by).reshape(-1, 8)
            slope = newton_step(slopes, places, shares, self.held, self.lengths, step)
            share = min(1.0, self.share / SHORTER**2)
            while share > 1e-5:
                moved = self.points + share * step.reshape(m, D)
                then = self.value(moved, weight)
                if then < now + ACCEPTED * share * slope:
                    break
                share *= SHORTER
            else:
                self.share = 1.0
                return True
            self.points, self.share = moved, share
            if -slope < 3.0 * weight:
                return True
        return -slope < DONE * weight

    def slow_down(self) -> float:
        """Lengthen the spans as limits between knots ask for, and return by which factor.

        Slower, the team brakes less quickly, too, so that one factor is enough.
        """
        points, period = self.points[:, :-1].copy(), float(self.points[2, -1] - self.points[1, -1])
        windows = period * self.windows
        brake(self.points, self.windows, self.waiting, self.ramp, self.kappa, self.acting)
        begin = np.append(-inf, windows[:-1, 0] + self.waiting)[:-1]
        ranges = np.stack([begin, windows[:-1, 1]], axis=1)
        shares = largest_shares(points, period, self.chains, self.limits, self.kappa, ranges)
        fast, hard, rough, starting = shares
        factor = max(fast, hard**0.5, rough ** (1.0 / 3.0), 1.0)
        self.points[:, -1] *= factor
        brake(self.points, self.windows, self.waiting, self.ramp, self.kappa, self.acting)
        # With rho' up to alpha (1 - rho^2), a start keeps the limits of acceleration where alpha V does.
        self.start_rate = float(factor) / starting
        return float(factor)
